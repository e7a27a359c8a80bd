#include "exports/formats.hpp"
#include "model/vtu.hpp"
#include "simulation/trajectory.hpp"

namespace pliant {

/// Newton's vertex block descent has a stable neo-Hookean energy, in which k_lambda plays lambda + mu of small strains,
/// and a damping that acts on its shear part alone. Which nodes are held stands in `export.json`: its reader takes no
/// arrays of nodes that it does not know.
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
    lambda.values.push_back(first + shear);
    damp.values.push_back(0.5 * model.stiffness_damping * shear);
    density.values.push_back(model.density);
  }
  grid.cell_data = {std::move(mu), std::move(lambda), std::move(damp), std::move(density)};
  write_vtu(folder / "model.vtu", grid);
  return {"model.vtu"};
}

}  // namespace pliant
