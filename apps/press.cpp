#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include "base/error.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "elasticity/law_elasticity.hpp"
#include "geometry/mesh_io.hpp"
#include "motion/press_session.hpp"
#include "simulation/law_table.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/scene_simulation.hpp"
#include "simulation/trajectory.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string model, out, surface;
  std::vector<double> contact, force, to, axis;
  double radius = 0.01;
  std::string probe = "disc";
  int steps = 1;
};

Vector3 vector_of(const std::vector<double>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

int run(const Arguments& arguments) {
  const Model model = load_model(arguments.model);
  const auto body = model_body(model);
  const auto law = law_of(model, *body);
  if (arguments.force.empty() == arguments.to.empty())
    throw InputError({{}, "neither or both of --force and --move", "one of them", "say what leads the probe"});
  PressSessionOptions options;
  options.held = held_nodes(*body, held_regions(model.scene));
  if (const auto& gravity = model.scene.world.gravity)
    options.dead_load = weight_of(*body, model.scene.object.density.value(), *gravity);
  ProbeOptions probe;
  probe.centre = vector_of(arguments.contact);
  probe.radius = arguments.radius;
  probe.kind = arguments.probe == "disc"    ? ProbeKind::BondedDisc
               : arguments.probe == "punch" ? ProbeKind::Punch
                                            : ProbeKind::Ball;
  if (!arguments.axis.empty()) probe.axis = vector_of(arguments.axis).normalized();
  PressSession session(body, law, probe, options);
  const std::string file = arguments.surface.empty() ? "" : arguments.surface;
  const TriangleMesh fine = file.empty() ? model.scene.object.surface.value() : read_mesh(file);
  const SurfaceFollower follower(*body, fine.vertices);
  std::vector<PvdEntry> entries;
  std::cout << "step  force [N]                        displacement [mm]              iterations\n";
  const auto elasticity = LawElasticity::make(body, law);
  for (int step = 1; step <= arguments.steps; ++step) {
    stop_if_interrupted();
    const double share = double(step) / arguments.steps;
    const SolveSummary summary = arguments.to.empty() ? session.push(share * vector_of(arguments.force))
                                                      : session.move_to(share * vector_of(arguments.to));
    if (!summary.converged) {
      std::cerr << "pliant: step " << step << ": " << session.failure() << "\n";
      return NotConverged;
    }
    const Vector3 force = session.force(), moved = 1e3 * session.displacement();
    char line[160];
    std::snprintf(line, sizeof line, "%4d  %8.4g %8.4g %8.4g      %8.4g %8.4g %8.4g      %d\n", step, force.x(),
                  force.y(), force.z(), moved.x(), moved.y(), moved.z(), summary.iterations);
    std::cout << line;
    if (arguments.out.empty()) continue;
    char name[40];
    std::snprintf(name, sizeof name, "frames/%06d", step);
    const State state{session.nodes(), Points::Zero(session.nodes().rows(), 3)};
    const std::filesystem::path folder = arguments.out;
    write_vtu(folder / (std::string(name) + ".vtu"), frame_grid(*body, state, *elasticity), VtuPrecision::Single);
    TriangleMesh deformed = fine;
    const Points positions = follower.positions(session.nodes());
    for (std::size_t v = 0; v < deformed.vertices.size(); ++v)
      deformed.vertices[v] = positions.row(Eigen::Index(v)).transpose();
    write_mesh(folder / (std::string(name) + ".ply"), deformed);
    entries.push_back({double(step), std::string(name) + ".vtu"});
  }
  if (arguments.out.empty()) return Fine;
  write_pvd(std::filesystem::path(arguments.out) / "press.pvd", entries);
  std::cout << arguments.steps << " equilibria in " << arguments.out << "/press.pvd, surfaces beside them\n";
  return Fine;
}

constexpr const char* footer = R"(Examples:
  pliant press out/foam/model.toml --contact 0,0.1,0 --force 0,-20,0 --radius 0.03 --out out/pressed
  pliant press out/foam/model.toml --contact 0,0.1,0 --move 0,-0.02,0 --probe ball --steps 20 --out out/pressed
The probe begins where it touches the surface at rest; each step is an equilibrium.)";

}  // namespace

void add_press(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("press", "Press a fitted model with a probe, by force or by moving it");
  command.option("model", arguments->model, "model.toml of a fit, of tetrahedra").required().type_name("MODEL");
  command.option("--contact", arguments->contact, "where the probe touches the surface at rest, metres")
      .required()
      .delimiter(',')
      .expected(3)
      .type_name("X,Y,Z");
  command.option("--force", arguments->force, "of the probe on the object, newtons")
      .delimiter(',')
      .expected(3)
      .type_name("X,Y,Z");
  command.option("--move", arguments->to, "where the probe goes from there, metres")
      .delimiter(',')
      .expected(3)
      .type_name("X,Y,Z");
  command.option("--probe", arguments->probe, "a disc that is glued on, a flat punch or a ball that slides")
      .one_of({"disc", "punch", "ball"});
  command.option("--radius", arguments->radius, "of the probe, metres").positive();
  command
      .option("--axis", arguments->axis,
              "along which a punch or ball points into the object; else the force's or the surface's")
      .delimiter(',')
      .expected(3)
      .type_name("X,Y,Z");
  command.option("--steps", arguments->steps, "equilibria on the way").positive();
  command.option("--surface", arguments->surface, "a finer mesh of the same object that follows along")
      .type_name("FILE");
  command.option("--out,-o", arguments->out, "folder for the deformed meshes and surfaces").type_name("DIR");
  command.footer(footer);
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
