#include <fmt/format.h>

#include <algorithm>

#include "base/files.hpp"
#include "exports/formats.hpp"
#include "model/vtu.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

namespace {

/// Settings under which Newton 1.8 was measured to converge (docs/exports.md): so many stable steps of explicit
/// integration are one of its, but none so short that single precision loses gravity.
constexpr int sweeps = 10;
constexpr double stable_steps = 3.0, shortest_step = 1e-4;  // [s]

double newton_step(const ExportModel& model) { return std::max(stable_steps * 2.0 / model.stiffest, shortest_step); }

/// A program that runs the model as the settings say; `build` and `solver` are for others.
std::string newton_scene(const ExportModel& model) {
  return fmt::format(
      R"(import json
import pathlib

import newton
import warp as wp

FOLDER = pathlib.Path(__file__).resolve().parent
STEP = {:.3g}  # [s]
SWEEPS = {}
# Stiffness damping makes vertex block descent need many times the sweeps: 0 leaves it out, 1 has the model's.
DAMPING = 0.0


def build(gravity=1.0, device=None):
    """The model at rest, under so many times its gravity."""
    about = json.loads((FOLDER / "export.json").read_text())
    builder = newton.ModelBuilder(gravity=[gravity * g for g in about["gravity"]])
    mesh = newton.TetMesh.create_from_file(str(FOLDER / "model.vtu"))
    builder.add_soft_mesh(pos=wp.vec3(0, 0, 0), rot=wp.quat_identity(), scale=1.0, vel=wp.vec3(0, 0, 0), mesh=mesh)
    for i in about["held_nodes"]:
        builder.particle_mass[i] = 0.0
        builder.particle_flags[i] = int(builder.particle_flags[i]) & ~int(newton.ParticleFlags.ACTIVE)
    builder.color()
    model = builder.finalize(device=device)
    model.particle_grid = None  # particles do not meet each other
    materials = model.tet_materials.numpy()
    materials[:, 2] *= DAMPING
    model.tet_materials = wp.array(materials, dtype=model.tet_materials.dtype, device=model.device)
    return model


def solver(model):
    return newton.solvers.SolverVBD(model, iterations=SWEEPS)


def run(model, duration, on_step):
    """Calls on_step(time, positions) after each step, positions as an array of numpy."""
    vbd, now, then, control = solver(model), model.state(), model.state(), model.control()
    for k in range(1, int(duration / STEP) + 1):
        now.clear_forces()
        vbd.step(now, then, control, None, STEP)
        now, then = then, now
        on_step(k * STEP, now.particle_q.numpy())


if __name__ == "__main__":
    run(build(), 1.0, lambda time, positions: print(f"{{time:.4f}} s, lowest point {{positions.min(axis=0)}}"))
)",
      newton_step(model), sweeps);
}

}  // namespace

/// Newton's vertex block descent has the stable neo-Hookean energy of Smith et al. 2018, whose constants it makes of
/// Lame's (`k_mu`, `k_lambda`) itself, and a damping that acts on its shear part alone. Which nodes are held stands in
/// `export.json`: its reader takes no arrays of nodes that it does not know.
std::vector<std::string> write_newton(const ExportModel& model, const std::filesystem::path& folder) {
  const Body& body = *model.body;
  VtuGrid grid;
  grid.points = body.nodes;
  grid.kind = vtu_cell(body.kind);
  grid.connectivity = body.connectivity;
  VtuArray mu{"k_mu", 1, {}}, lambda{"k_lambda", 1, {}}, damp{"k_damp", 1, {}}, density{"density", 1, {}};
  const double nu = model.poissons_ratio;
  for (const double E : model.moduli) {
    const double shear = E / (2.0 * (1.0 + nu)), first = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
    mu.values.push_back(shear);
    lambda.values.push_back(first);
    damp.values.push_back(0.5 * model.stiffness_damping * shear);
    density.values.push_back(model.density);
  }
  grid.cell_data = {std::move(mu), std::move(lambda), std::move(damp), std::move(density)};
  write_vtu(folder / "model.vtu", grid);
  write_file(folder / "scene.py", newton_scene(model));
  return {"model.vtu", "scene.py"};
}

}  // namespace pliant
