#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include "base/error.hpp"
#include "base/files.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "elasticity/law_elasticity.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/solid_surface.hpp"
#include "simulation/trajectory.hpp"
#include "situation/probing.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string model, out, surface, path;
  std::vector<double> contact, force, to, axis;
  double radius = 0.01;
  std::string probe = "disc";
  int steps = 1;
};

Vector3 vector_of(const std::vector<double>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

/// The situation of one probe that goes straight where the command line says, in equal steps of a second.
Situation straight_press(const Arguments& arguments) {
  if (arguments.contact.empty())
    throw InputError({{}, "neither --contact nor --path", "one of them", "say where the probe touches the object"});
  if (arguments.force.empty() == arguments.to.empty())
    throw InputError({{}, "neither or both of --force and --move", "one of them", "say what leads the probe"});
  ProbeFacts probe;
  probe.kind = arguments.probe == "disc"    ? ProbeKind::BondedDisc
               : arguments.probe == "punch" ? ProbeKind::Punch
                                            : ProbeKind::Ball;
  probe.at = vector_of(arguments.contact);
  probe.radius = arguments.radius;
  if (!arguments.axis.empty()) probe.axis = vector_of(arguments.axis).normalized();
  probe.led = arguments.to.empty() ? ProbeFacts::Led::Force : ProbeFacts::Led::Displacement;
  const Vector3 end = vector_of(arguments.to.empty() ? arguments.force : arguments.to);
  for (int step = 0; step <= arguments.steps; ++step) {
    KeyFrames<6>::Key key{double(step), KeyFrames<6>::Value::Zero()};
    key.value.head<3>() = double(step) / arguments.steps * end;
    probe.path.push_back(key);
  }
  Situation situation;
  situation.duration = arguments.steps, situation.frame_rate = 1.0;
  situation.probes = {probe};
  return situation;
}

/// Equilibria as they are found: a table of what each probe does and, in a folder, deformed meshes and surfaces.
class Record {
 public:
  Record(const Probing& probing, const TriangleMesh& fine, std::filesystem::path folder)
      : probing_(probing),
        fine_(fine),
        folder_(std::move(folder)),
        elasticity_(LawElasticity::make(probing.body(), probing.law())),
        strains_(*probing.body()) {
    if (folder_.empty()) return;
    follower_.emplace(*probing.body(), fine.vertices);
    table_ << "time,probe,x,y,z,depth,fx,fy,fz,iterations\n";
  }

  void add(int frame, int iterations) {
    const PressSession& session = probing_.session();
    for (int i = 0; i < probing_.probe_count(); ++i) {
      const Vector3 force = session.force(i), moved = session.displacement(i);
      std::cout << fmt::format("{:8.3f} {:5d}  {:10.4g} {:10.4g} {:10.4g}  {:10.4g} {:10.4g} {:10.4g}  {:6d}\n",
                               probing_.time(), i + 1, force.x(), force.y(), force.z(), 1e3 * moved.x(),
                               1e3 * moved.y(), 1e3 * moved.z(), iterations);
      table_ << fmt::format("{:.9g},{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{}\n", probing_.time(), i + 1,
                            moved.x(), moved.y(), moved.z(), probing_.depth(i), force.x(), force.y(), force.z(),
                            iterations);
    }
    const State state{session.nodes(), Points::Zero(session.nodes().rows(), 3)};
    const BodyFields fields = body_fields(*probing_.body(), *elasticity_, state.x);
    strains_.add(fields, std::nullopt);
    if (folder_.empty()) return;
    const std::string name = fmt::format("frames/{:06}", frame);
    write_vtu(folder_ / (name + ".vtu"), frame_grid(*probing_.body(), state, fields), VtuPrecision::Single);
    TriangleMesh deformed = fine_;
    const Points positions = follower_->positions(session.nodes());
    for (std::size_t v = 0; v < deformed.vertices.size(); ++v)
      deformed.vertices[v] = positions.row(Eigen::Index(v)).transpose();
    write_mesh(folder_ / (name + ".ply"), deformed);
    entries_.push_back({probing_.time(), name + ".vtu"});
  }

  /// Also where a path ends early: what was found stays.
  void finish() {
    if (folder_.empty()) return;
    write_pvd(folder_ / "press.pvd", entries_);
    write_file(folder_ / "probes.csv", [&](std::ostream& out) { out << table_.str(); });
  }

  std::optional<DeformationResult> strained() const { return strains_.result(); }

 private:
  const Probing& probing_;
  const TriangleMesh& fine_;
  std::filesystem::path folder_;
  std::optional<SurfaceFollower> follower_;
  std::unique_ptr<LawElasticity> elasticity_;
  StrainRange strains_;
  std::ostringstream table_;
  std::vector<PvdEntry> entries_;
};

int run(const Arguments& arguments) {
  if (!arguments.path.empty() && !(arguments.contact.empty() && arguments.force.empty() && arguments.to.empty()))
    throw InputError({{}, "--path beside --contact, --force or --move", "one of them", "the file says it all"});
  const Situation situation = arguments.path.empty() ? straight_press(arguments) : read_situation(arguments.path);
  const Model model = load_model(arguments.model);
  const std::optional<DeformationResult> recorded = recorded_strain_range(arguments.model);
  Probing probing(model, situation);
  const TriangleMesh fine =
      arguments.surface.empty() ? model.scene.object.surface.value() : read_surface(arguments.surface);
  Record record(probing, fine, arguments.out);
  std::cout << "time [s] probe  force [N]                         displacement [mm]                 iterations\n";
  const int frames = std::max(1, int(std::lround(situation.duration * situation.frame_rate)));
  std::vector<double> milliseconds;
  for (int frame = arguments.path.empty() ? 1 : 0; frame <= frames; ++frame) {
    if (is_interrupted()) record.finish();
    stop_if_interrupted();
    const auto start = std::chrono::steady_clock::now();
    const SolveSummary summary = probing.advance(frame / situation.frame_rate);
    milliseconds.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    if (!summary.converged) {
      record.finish();
      std::cerr << fmt::format("pliant: {:.4g} s: {}\n", probing.time(), probing.failure());
      return NotConverged;
    }
    record.add(frame, summary.iterations);
  }
  record.finish();
  std::ranges::nth_element(milliseconds, milliseconds.begin() + std::ptrdiff_t(milliseconds.size() / 2));
  std::cout << fmt::format("{} equilibria of {} elements, {:.3g} ms each (median)", milliseconds.size(),
                           probing.body()->element_count(), milliseconds[milliseconds.size() / 2]);
  if (!arguments.out.empty())
    std::cout << fmt::format("; {}/press.pvd, surfaces beside them, probes.csv", arguments.out);
  std::cout << "\n";
  say_if_extrapolated(recorded, record.strained());
  return Fine;
}

constexpr const char* footer = R"(Examples:
  pliant press out/foam/model.toml --contact 0,0.1,0 --force 0,-20,0 --radius 0.03 --out out/pressed
  pliant press out/foam/model.toml --contact 0,0.1,0 --move 0,-0.02,0 --probe ball --steps 20 --out out/pressed
  pliant press out/foam/model.toml --path probing.toml --out out/pressed
The probe begins where it touches the surface at rest; each step is an equilibrium. A file leads several probes of any shape
along paths, by displacement, depth or force, and turns them; it is a situation with [[probe]] (docs/formats.md).)";

}  // namespace

void add_press(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("press", "Press a fitted model with a probe, by force or by moving it");
  command.option("model", arguments->model, "model.toml of a fit").required().type_name("MODEL");
  command.option("--contact", arguments->contact, "where the probe touches the surface at rest, metres")
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
  command.option("--path", arguments->path, "probes and how they are led, in the place of --contact").type_name("FILE");
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
