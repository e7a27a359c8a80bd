#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "capture/region.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/simulation.hpp"
#include "synthesis/scene.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string scene, out;
  std::optional<std::uint32_t> seed;
};

std::shared_ptr<const Body> body_of(const Scene& scene) {
  const Box box = bounding_box(scene.surface);
  const double size = box.extent().maxCoeff(), spacing = std::min(size / 80.0, 0.5 * scene.cell_size);
  const SignedDistance distance = signed_distance(scene.surface, spacing, 0.1 * size + 2.0 * scene.cell_size);
  return std::make_shared<Body>(make_body(make_hex_grid(distance, box, scene.cell_size)));
}

VectorX theta_of(const Scene& scene, const MotionLayout& blocks) {
  VectorX theta = blocks.zero();
  theta[blocks.youngs_moduli.front()] = scene.youngs_modulus;
  theta[blocks.poissons_ratio] = scene.poisson_ratio;
  theta[blocks.mass_damping] = scene.mass_damping;
  theta[blocks.stiffness_damping] = scene.stiffness_damping;
  theta[blocks.density] = scene.true_density();
  theta.segment<3>(blocks.gravity) = scene.gravity;
  theta.segment<3>(blocks.linear_velocity) = scene.initial.linear_velocity;
  theta.segment<3>(blocks.angular_velocity) = scene.initial.angular_velocity;
  for (std::size_t i = 0; i < scene.planes.size(); ++i) {
    theta.segment<3>(blocks.planes[i].point) = scene.planes[i].plane.point;
    theta.segment<3>(blocks.planes[i].normal) = scene.planes[i].plane.normal;
  }
  return theta;
}

SimulationOptions options_of(const Scene& scene, const MotionBlocks& blocks, const Body& body) {
  SimulationOptions options;
  for (int i = 0; i < scene.frames - scene.start_frame; ++i) options.times.push_back(i / scene.frame_rate);
  options.max_dt = 1.0 / (scene.frame_rate * scene.substeps);
  options.newmark_theta = scene.newmark_theta;
  options.contact = default_contact(body, scene.true_density() * body.volume(), scene.gravity.norm());
  if (scene.contact_stiffness > 0.0) options.contact.stiffness = scene.contact_stiffness;
  if (scene.contact_smoothing > 0.0) options.contact.smoothing = scene.contact_smoothing;
  options.blocks = blocks;
  for (const FixedRegion& fixed : scene.fixed) {
    const RigidMotion motion = fixed.displaced_to.value_or(RigidMotion{});
    options.holds.push_back({[region = fixed.region](const Vector3& point) { return contains(region, point); },
                             motion.rotation, motion.translation});
  }
  return options;
}

std::vector<Points> simulate(const Scene& scene) {
  const std::shared_ptr<const Body> body = body_of(scene);
  const Embedding embedding(*body, scene.surface.vertices);
  std::vector<Points> frames(size_t(scene.start_frame), vertex_points(scene.surface));
  const MotionLayout blocks({.planes = int(scene.planes.size())});
  Simulation simulation(body, options_of(scene, blocks, *body));
  const auto on_frame = [&](int, const State& state, std::span<const State>) {
    frames.push_back(embedding.positions(state.x));
    show_progress("simulated", int(frames.size()), scene.frames);
    return !is_interrupted();
  };
  const RolloutSummary summary = simulation.run(theta_of(scene, blocks), on_frame);
  stop_if_interrupted();
  if (!summary.succeeded)
    throw std::runtime_error("the simulation stopped in frame " + std::to_string(frames.size()) + ": " +
                             summary.failure + "; try more `substeps` or a coarser `cell_size`");
  return frames;
}

void run(const Arguments& arguments) {
  Scene scene = read_scene(arguments.scene);
  if (arguments.seed) scene.seed = *arguments.seed;
  const Synthesis synthesis = synthesise(scene, simulate);
  write_synthetic_capture(arguments.out, synthesis,
                          [](int done, int total) { show_progress("recorded", done, total); });
  std::cout << arguments.out << ": " << scene.frames << " frames of " << scene.cameras.size() << " camera"
            << (scene.cameras.size() > 1 ? "s" : "") << ", seed " << scene.seed << "\nthe truth is in " << arguments.out
            << "/truth.json; next: pliant check " << arguments.out << "\n";
}

}  // namespace

void add_synth(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("synth", "Simulate a scene and make a recording of it whose truth is known");
  command.option("scene", arguments->scene, "scene file (docs/scene.md)").required().type_name("SCENE.toml");
  command.option("--out,-o", arguments->out, "folder for the capture").required().type_name("DIR");
  command.option("--seed", arguments->seed, "of the sensor's noise; instead of the scene's");
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
