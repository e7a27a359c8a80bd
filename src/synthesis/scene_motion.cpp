#include "synthesis/scene_motion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/instants.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/continuation.hpp"
#include "motion/press_session.hpp"
#include "rays/ray_scene.hpp"
#include "simulation/inner_bodies.hpp"
#include "simulation/obstacles.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant {

namespace {

constexpr const char* advice = "; try more `substeps` or a coarser `cell_size`";
constexpr const char* static_advice = ": a softer pull or press, or a stiffer material may have one";

/// What takes part in an equilibrium beside the material, its weight and what holds it.
struct Situation {
  std::vector<Weight> weights = {};        // beside the scene's own
  std::optional<SyntheticPull> pull = {};  // what holds the object until it is let go
  bool at_scan = false;                    // held regions are where they were in the scan
};

class Simulated {
 public:
  Simulated(const SyntheticScene& synthetic, const std::function<bool(int, int)>& on_progress)
      : synthetic_(synthetic),
        on_progress_(on_progress),
        body_(body_of(synthetic)),
        vertices_(*body_, synthetic.scene.object.surface->vertices) {
    if (synthetic.markers) markers_ = Embedding(*body_, synthetic.markers->points);
    if (synthetic.law) law_ = law_at(*body_, synthetic.law_layout(), parameters(synthetic.law_layout()));
    sliding_ = sliding_bodies(scene());
    total_ = scene().timing.frame_count() + int(synthetic.loads.size() + synthetic.presses.size());
  }

  SceneMotion run() {
    SceneMotion motion;
    if (synthetic_.sags()) {
      start_ = equilibrium({.at_scan = true}, "the scan");
      motion.scan = shape(start_);
    }
    if (!scene().timing.times.empty()) motion.frames = frames(), motion.camera_frames = std::move(camera_frames_);
    for (std::size_t i = 0; i < synthetic_.loads.size(); ++i) {
      motion.loads.push_back(
          shape(equilibrium({.weights = {synthetic_.loads[i].weight}}, fmt::format("load {}", i + 1))));
      step();
    }
    for (std::size_t i = 0; i < synthetic_.presses.size(); ++i) {
      motion.presses.push_back(pressed(synthetic_.presses[i], i));
      step();
    }
    for (std::size_t i = 0; i < synthetic_.indentations.size(); ++i)
      motion.indentations.push_back(indented(synthetic_.indentations[i], i));
    return motion;
  }

 private:
  const Scene& scene() const { return synthetic_.scene; }
  VectorX parameters(const LawLayout& layout) const { return synthetic_.law_parameters(layout); }

  TrueShape shape(const Points& nodes) const {
    return {vertices_.positions(nodes), synthetic_.markers ? markers_.positions(nodes) : Points(0, 3)};
  }

  void step() {
    if (++done_; on_progress_ && !on_progress_(done_, total_)) throw std::runtime_error("the simulation was stopped");
  }

  VectorX theta_of(const Scene& facts, const MotionBlocks& blocks) const {
    VectorX theta = VectorX::Zero(blocks_of(facts).size());
    const std::vector<double> moduli = synthetic_.youngs_moduli();
    for (std::size_t k = 0; k < moduli.size(); ++k) theta[blocks.youngs_moduli[k]] = moduli[k];
    theta[blocks.poissons_ratio] = synthetic_.poissons_ratio;
    theta[blocks.mass_damping] = synthetic_.mass_damping;
    theta[blocks.stiffness_damping] = synthetic_.stiffness_damping;
    theta[blocks.density] = synthetic_.true_density();
    theta.segment<3>(blocks.gravity) = *facts.world.gravity;
    theta.segment<3>(blocks.linear_velocity) = facts.initial.linear_velocity;
    theta.segment<3>(blocks.angular_velocity) = facts.initial.angular_velocity;
    set_obstacles(facts, blocks, theta);
    set_loads(facts, blocks, theta);
    return theta;
  }

  MotionLayout blocks_of(const Scene& facts) const {
    MotionCounts counts = load_counts(facts);
    counts.moduli = int(synthetic_.youngs_moduli().size());
    return MotionLayout(counts);
  }

  SimulationOptions options_of(const Scene& facts, const MotionBlocks& blocks) const {
    SimulationOptions options;
    const double gravity = facts.world.gravity->norm();
    const Timing& timing = facts.timing;
    options.times = {timing.times.empty() ? 0.0 : timing.times[std::size_t(timing.start_frame)]};
    options.max_dt = 1.0;
    options.newmark_theta = synthetic_.newmark_theta;
    options.material = synthetic_.material;
    options.contact = default_contact(*body_, synthetic_.true_density() * body_->volume(), gravity);
    options.friction_speed = default_friction_speed(*body_, gravity);
    if (synthetic_.contact_stiffness > 0.0) options.contact.stiffness = synthetic_.contact_stiffness;
    if (synthetic_.contact_smoothing > 0.0) options.contact.smoothing = synthetic_.contact_smoothing;
    options.blocks = blocks;
    options.holds = holds_of(*body_, facts);
    if (law_) options.material.elastic = law_;
    for (const Weight& weight : facts.weights) options.weights.push_back({weight.at, weight.mass});
    add_loads(facts, options);
    add_obstacles(facts, *body_, theta_of(facts, blocks), options);
    return options;
  }

  /// Nodes at rest [m]. Nothing blows, and forces are left out: they act on what moves.
  Points equilibrium(const Situation& situation, const std::string& name) const {
    Scene facts = scene();
    facts.wind.reset();
    if (!facts.timing.is_static) facts.forces.clear();
    facts.weights.insert(facts.weights.end(), situation.weights.begin(), situation.weights.end());
    facts.initial = {};
    if (situation.at_scan)
      for (FixedRegion& fixed : facts.fixed) fixed.displaced_to.reset();
    const auto& pull = situation.pull;
    if (pull && pull->force) facts.forces.push_back({pull->at, pull->radius, {{0.0, *pull->force}}, true});
    if (pull && !pull->force) facts.fixed.push_back({RegionSphere{pull->at, pull->radius}, pull->to});
    const MotionLayout blocks = blocks_of(facts);
    SimulationOptions options = options_of(facts, blocks);
    options.starts_settled = true;
    Simulation simulation(body_, options);
    VectorX theta = theta_of(facts, blocks);
    Points nodes;
    std::string failure;
    // A force may be too much at once; each part of it goes on from the last.
    LoadContinuation steps({.first = 1.0, .least = 1.0 / 64.0});
    while (const auto share = steps.next()) {
      if (pull && pull->force) theta[blocks.strengths.back()] = *share;
      const RolloutSummary summary = simulation.run(theta, [&](int, const State& state, std::span<const State>) {
        nodes = state.x;
        return false;
      });
      failure = summary.failure;
      steps.report(summary.succeeded ? LoadContinuation::Outcome::Carried : LoadContinuation::Outcome::NotFollowed);
      if (!(pull && pull->force)) break;
    }
    if (!failure.empty() && !steps.is_complete()) throw std::runtime_error(name + ": " + failure + static_advice);
    return nodes;
  }

  std::vector<TrueShape> frames() {
    const Timing& timing = scene().timing;
    if (timing.is_static) {
      std::vector<TrueShape> frames(std::size_t(timing.frame_count()), shape(equilibrium({}, "the object at rest")));
      for (int i = 0; i < timing.frame_count(); ++i) step();
      return frames;
    }
    if (synthetic_.pull) start_ = equilibrium({.pull = synthetic_.pull}, "the pulled object");
    const MotionLayout blocks = blocks_of(scene());
    SimulationOptions options = options_of(scene(), blocks);
    const double start = timing.times[std::size_t(timing.start_frame)];
    const std::vector<double> instants = instants_seen(start);
    options.times = instants;
    options.max_dt = 1.0 / (timing.frame_rate * synthetic_.substeps);
    if (const auto& weight = scene().initial.release_of)
      options.released_weights.push_back({weight->at, weight->mass});
    else
      options.start = start_;
    const TrueShape rest = start_.rows() > 0 ? shape(start_) : shape(body_->nodes);
    TrueShape held = start_.rows() > 0 ? rest : TrueShape{vertex_points(*scene().object.surface), rest.markers};
    std::vector<TrueShape> shapes;
    Simulation simulation(body_, options);
    const RolloutSummary summary =
        simulation.run(theta_of(scene(), blocks), [&](int, const State& state, std::span<const State>) {
          shapes.push_back(shape(state.x));
          if (int(shapes.size()) <= timing.frame_count() - timing.start_frame) step();
          return true;
        });
    if (!summary.succeeded)
      throw std::runtime_error("the simulation stopped " + fmt::format("{:.3g} s", instants[shapes.size()] - start) +
                               " after the start: " + summary.failure + advice);
    if (scene().initial.released) held = shapes.front();  // until it is let go
    const auto seen_at = [&](double time) {
      return time < start - same_instant ? held : shapes[instant_at(instants, time)];
    };
    std::vector<TrueShape> frames;
    for (const double time : timing.times) frames.push_back(seen_at(time));
    camera_frames_.resize(synthetic_.cameras.size());
    for (std::size_t k = 0; k < camera_frames_.size(); ++k)
      if (const double offset = synthetic_.cameras[k].time_offset; offset != 0.0)
        for (const double time : timing.times) camera_frames_[k].push_back(seen_at(time + offset));
    return frames;
  }

  /// From the start on: of all frames, and of the images of cameras that take them at other times.
  std::vector<double> instants_seen(double start) const {
    std::vector<double> times;
    for (const double time : scene().timing.times) {
      times.push_back(time);
      for (const SyntheticCamera& camera : synthetic_.cameras) times.push_back(time + camera.time_offset);
    }
    std::erase_if(times, [&](double time) { return time < start - same_instant; });
    return instants_of(std::move(times));
  }

  PressSession session(const ProbeOptions& probe) const {
    PressSessionOptions options;
    options.held = held_nodes(*body_, scene());
    options.dead_load = weight_of(*body_, synthetic_.true_density(), *scene().world.gravity);
    const LawLayout layout = synthetic_.law_layout();
    const auto law = law_ ? law_ : law_at(*body_, layout, parameters(layout));
    options.inner = inner_contacts(*body_, sliding_, mean_modulus(*body_, *law));
    return {body_, law, probe, options};
  }

  /// All the way, in parts where that is too far at once.
  static void lead(PressSession& session, const ProbeMove& whole, const ProbeMove& before, const std::string& name) {
    LoadContinuation steps({.first = 1.0, .least = 1.0 / 256.0});
    while (const auto share = steps.next()) {
      ProbeMove move = whole;
      move.vector = before.vector + *share * (whole.vector - before.vector);
      steps.report(session.lead({move}).converged ? LoadContinuation::Outcome::Carried
                                                  : LoadContinuation::Outcome::NotFollowed);
    }
    if (!steps.is_complete())
      throw std::runtime_error(fmt::format("{}: no equilibrium beyond {:.0f} % of the way: {}{}", name,
                                           100.0 * steps.carried(), session.failure(), static_advice));
  }

  SceneMotion::Pressed pressed(const SyntheticPress& press, std::size_t i) const {
    PressSession probing =
        session({press.glued ? ProbeKind::BondedDisc : ProbeKind::Punch, press.at, press.radius, press.axis});
    const Vector3 axis = *probing.probe().axis;
    using Led = SyntheticPress::Led;
    ProbeMove move;
    const bool by_force = press.led == Led::Force || press.led == Led::Push;
    move.by = by_force ? ProbeMove::By::Force : ProbeMove::By::Displacement;
    move.vector = press.led == Led::Push || press.led == Led::Depth ? Vector3(press.number * axis) : press.vector;
    lead(probing, move, {move.by, Vector3::Zero(), Vector3::Zero()}, fmt::format("press {}", i + 1));
    return {shape(probing.nodes()), probing.force(), probing.displacement(), axis};
  }

  SceneMotion::Indented indented(const SyntheticIndentation& test, std::size_t i) const {
    ProbeOptions probe{test.facts.probe == IndenterShape::Ball ? ProbeKind::Ball : ProbeKind::Punch, test.facts.contact,
                       test.facts.radius, std::nullopt};
    if (!test.facts.direction.isZero()) probe.axis = test.facts.direction;
    PressSession probing = session(probe);
    SceneMotion::Indented made{*probing.probe().axis, {}};
    ProbeMove move;
    for (const double depth : test.depths) {
      const ProbeMove before = move;
      move.vector = depth * made.axis;
      lead(probing, move, before, fmt::format("indentation {}", i + 1));
      made.forces.push_back(probing.force().dot(made.axis));
    }
    return made;
  }

  const SyntheticScene& synthetic_;
  const std::function<bool(int, int)>& on_progress_;
  std::shared_ptr<const Body> body_;
  Embedding vertices_, markers_;
  std::vector<std::shared_ptr<const RigidShape>> sliding_;
  std::shared_ptr<const MaterialLaw> law_;  // null: the scene's elastic law
  std::vector<std::vector<TrueShape>> camera_frames_;
  Points start_;  // where nodes are at the start; empty: where they rest
  int done_ = 0, total_ = 0;
};

}  // namespace

std::shared_ptr<const Body> body_of(const SyntheticScene& synthetic) {
  const TriangleMesh& surface = *synthetic.scene.object.surface;
  const Box box = bounding_box(surface);
  const double size = box.extent().maxCoeff(), spacing = std::min(size / 80.0, 0.5 * synthetic.cell_size);
  if (synthetic.element == ElementKind::Hexahedron) {
    const SignedDistance distance = signed_distance(surface, spacing, 0.1 * size + 2.0 * synthetic.cell_size);
    Body body = make_body(make_hex_grid(distance, box, synthetic.cell_size));
    body.modulus = modulus_field(body, synthetic.scene, {}).field;
    return std::make_shared<Body>(std::move(body));
  }
  Resolution resolution;
  resolution.element = synthetic.element;
  resolution.cells = size / synthetic.cell_size;
  std::vector<Vector3> unused;
  return make_body_of(synthetic.scene, SignedDistance{}, resolution, unused);
}

SceneMotion simulate_scene(const SyntheticScene& scene, const std::function<bool(int, int)>& on_progress) {
  return Simulated(scene, on_progress).run();
}

}  // namespace pliant
