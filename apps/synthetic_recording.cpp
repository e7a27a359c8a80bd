#include "synthetic_recording.hpp"

#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "commands.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/simulation.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant::apps {

namespace {

std::shared_ptr<const Body> body_of(const SyntheticScene& synthetic) {
  const TriangleMesh& surface = *synthetic.scene.object.surface;
  const Box box = bounding_box(surface);
  const double size = box.extent().maxCoeff(), spacing = std::min(size / 80.0, 0.5 * synthetic.cell_size);
  const SignedDistance distance = signed_distance(surface, spacing, 0.1 * size + 2.0 * synthetic.cell_size);
  Body body = make_body(make_hex_grid(distance, box, synthetic.cell_size));
  body.modulus = modulus_field(body, synthetic.scene, {}).field;
  return std::make_shared<Body>(std::move(body));
}

VectorX theta_of(const SyntheticScene& synthetic, const MotionLayout& blocks) {
  const Scene& scene = synthetic.scene;
  VectorX theta = blocks.zero();
  const std::vector<double> moduli = synthetic.youngs_moduli();
  for (std::size_t k = 0; k < moduli.size(); ++k) theta[blocks.youngs_moduli[k]] = moduli[k];
  theta[blocks.poissons_ratio] = synthetic.poissons_ratio;
  theta[blocks.mass_damping] = synthetic.mass_damping;
  theta[blocks.stiffness_damping] = synthetic.stiffness_damping;
  theta[blocks.density] = synthetic.true_density();
  theta.segment<3>(blocks.gravity) = *scene.world.gravity;
  theta.segment<3>(blocks.linear_velocity) = scene.initial.linear_velocity;
  theta.segment<3>(blocks.angular_velocity) = scene.initial.angular_velocity;
  set_planes(scene.planes, blocks, theta);
  set_loads(scene, blocks, theta);
  return theta;
}

SimulationOptions options_of(const SyntheticScene& synthetic, const MotionBlocks& blocks, const Body& body) {
  const Scene& scene = synthetic.scene;
  SimulationOptions options;
  const Timing& timing = scene.timing;
  for (int i = 0; i < timing.frame_count() - timing.start_frame; ++i)
    options.times.push_back(timing.times[std::size_t(timing.start_frame) + std::size_t(i)]);
  options.max_dt = 1.0 / (timing.frame_rate * synthetic.substeps);
  options.newmark_theta = synthetic.newmark_theta;
  if (synthetic.is_corotated) options.elastic_law = ElasticLaw::Corotated;
  if (synthetic.is_rayleigh) options.stiffness_damping = StiffnessDamping::Rayleigh;
  options.contact = default_contact(body, synthetic.true_density() * body.volume(), scene.world.gravity->norm());
  options.friction_speed = default_friction_speed(body, scene.world.gravity->norm());
  if (synthetic.contact_stiffness > 0.0) options.contact.stiffness = synthetic.contact_stiffness;
  if (synthetic.contact_smoothing > 0.0) options.contact.smoothing = synthetic.contact_smoothing;
  options.blocks = blocks;
  options.holds = held_regions(scene);
  for (const Weight& weight : scene.weights) options.weights.push_back({weight.at, weight.mass});
  if (const auto& weight = scene.initial.release_of) options.released_weights.push_back({weight->at, weight->mass});
  add_loads(scene, options);
  return options;
}

std::vector<Points> simulate(const SyntheticScene& synthetic) {
  const std::shared_ptr<const Body> body = body_of(synthetic);
  const Timing& timing = synthetic.scene.timing;
  const TriangleMesh& surface = *synthetic.scene.object.surface;
  const Embedding embedding(*body, surface.vertices);
  std::vector<Points> frames(size_t(timing.start_frame), vertex_points(surface));
  MotionCounts counts = load_counts(synthetic.scene);
  counts.moduli = int(synthetic.youngs_moduli().size());
  const MotionLayout blocks(counts);
  Simulation simulation(body, options_of(synthetic, blocks, *body));
  const auto on_frame = [&](int, const State& state, std::span<const State>) {
    frames.push_back(embedding.positions(state.x));
    show_progress("simulated", int(frames.size()), timing.frame_count());
    return !is_interrupted();
  };
  const RolloutSummary summary = simulation.run(theta_of(synthetic, blocks), on_frame);
  stop_if_interrupted();
  if (!summary.succeeded)
    throw std::runtime_error("the simulation stopped in frame " + std::to_string(frames.size()) + ": " +
                             summary.failure + "; try more `substeps` or a coarser `cell_size`");
  if (synthetic.scene.initial.released)  // held there until it is let go
    std::fill_n(frames.begin(), timing.start_frame, frames[size_t(timing.start_frame)]);
  return frames;
}

}  // namespace

void write_recording(const std::filesystem::path& folder, const SyntheticScene& scene) {
  write_synthetic_capture(folder, synthesise(scene, simulate),
                          [](int done, int total) { show_progress("recorded", done, total); });
}

}  // namespace pliant::apps
