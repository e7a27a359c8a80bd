#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "rays/ray_scene.hpp"
#include "scene/region.hpp"
#include "synthesis/synthetic_markers.hpp"
#include "synthesis/synthetic_scene.hpp"

// From a scene to its recording; `read_synthetic_scene` is in a file of its own.

namespace pliant {

namespace {

/// Points of the stress-free surface to where they are in the scan.
class ToScan {
 public:
  ToScan(const TriangleMesh& surface, const Points& scan) : surface_(surface), scan_(scan) {}
  Vector3 operator()(const Vector3& point) const {
    return scan_.rows() == 0 ? point : nearest_place(surface_, point)(surface_, scan_);
  }

 private:
  const TriangleMesh& surface_;
  const Points& scan_;
};

/// What the capture says of places, in the pose of its scan.
void move_to_scan(Scene& scene, const ToScan& to_scan) {
  for (Weight& weight : scene.weights) weight.at = to_scan(weight.at);
  for (AppliedForce& force : scene.forces) force.at = to_scan(force.at);
  for (MaterialControl& control : scene.controls) control.point = to_scan(control.point);
  if (scene.initial.release_of) scene.initial.release_of->at = to_scan(scene.initial.release_of->at);
}

std::vector<TrueParameter> true_parameters(const SyntheticScene& scene) {
  std::vector<TrueParameter> truth;
  const LawLayout layout = scene.law_layout();
  const VectorX numbers = scene.law_parameters(layout);
  for (const ParameterHandle& handle : layout.all()) {
    const ParameterBlock& block = layout.layout().block_of(handle);
    truth.push_back({block.name, numbers[handle], block.unit});
  }
  const auto add = [&](const char* name, const auto& value, const char* unit) { truth.push_back({name, value, unit}); };
  if (!scene.scene.timing.times.empty()) {
    add("mass_damping", scene.mass_damping, "1/s");
    add("stiffness_damping", scene.stiffness_damping, "s");
  }
  add("density", scene.true_density(), "kg/m^3");
  add("gravity", *scene.scene.world.gravity, "m/s^2");
  if (!scene.scene.timing.times.empty()) {
    add("linear_velocity", scene.scene.initial.linear_velocity, "m/s");
    add("angular_velocity", scene.scene.initial.angular_velocity, "rad/s");
  }
  if (const auto& wind = scene.scene.wind) add("wind", wind->velocity, "m/s");
  for (std::size_t k = 0; k < scene.scene.forces.size(); ++k)
    truth.push_back({fmt::format("strength@{}", k + 1), 1.0, "1"});
  return truth;
}

void check_count(const char* what, std::size_t simulated, std::size_t asked) {
  if (simulated != asked)
    throw std::invalid_argument(fmt::format("synthesise: the simulation gave {} of {} {}", simulated, asked, what));
}

}  // namespace

Synthesis synthesise(const SyntheticScene& scene, const Simulate& simulate) {
  Synthesis s;
  s.name = scene.name, s.scene = scene.scene, s.plane_half_sizes = scene.plane_half_sizes;
  s.scan_noise = scene.scan_noise, s.cameras = scene.cameras, s.seed = scene.seed;
  s.cloud = scene.cloud, s.markers = scene.markers;
  s.write_trajectory = scene.write_trajectory;
  s.truth = true_parameters(scene);
  SceneMotion motion = simulate(scene);
  check_count("frames", motion.frames.size(), std::size_t(scene.scene.timing.frame_count()));
  check_count("loads", motion.loads.size(), scene.loads.size());
  check_count("presses", motion.presses.size(), scene.presses.size());
  check_count("indentations", motion.indentations.size(), scene.indentations.size());
  s.frames = std::move(motion.frames);
  s.camera_frames = std::move(motion.camera_frames);
  if (motion.scan) s.scan = std::move(motion.scan->vertices), s.scan_markers = std::move(motion.scan->markers);
  if (scene.markers && !motion.scan) s.scan_markers = vertex_points({scene.markers->points, {}});
  if (Initial& initial = s.scene.initial; !initial.known)  // the capture knows nothing of them
    initial.linear_velocity = initial.angular_velocity = Vector3::Zero();
  const ToScan to_scan(*scene.scene.object.surface, s.scan);
  move_to_scan(s.scene, to_scan);
  if (scene.sags()) {  // densities are over the scan's volume
    s.scene.object.mass = scene.true_density() * enclosed_volume(*scene.scene.object.surface);
    s.scene.object.density.reset();
  }
  for (std::size_t i = 0; i < scene.loads.size(); ++i)
    s.loads.push_back({{scene.loads[i].weight.mass, to_scan(scene.loads[i].weight.at)},
                       scene.loads[i].role,
                       std::move(motion.loads[i])});
  for (std::size_t i = 0; i < scene.presses.size(); ++i) {
    const SyntheticPress& press = scene.presses[i];
    SceneMotion::Pressed& pressed = motion.presses[i];
    Press facts;
    facts.force = pressed.force, facts.contact_centre = press.at, facts.contact_radius = press.radius;
    facts.glued = press.glued, facts.role = press.role;
    s.presses.push_back({facts, pressed.axis, pressed.shift, press.force_noise, std::move(pressed.shape)});
  }
  for (std::size_t i = 0; i < scene.indentations.size(); ++i) {
    const SyntheticIndentation& test = scene.indentations[i];
    TrueIndentation made{test.facts, {test.depths, motion.indentations[i].forces, {}}};
    made.facts.direction = motion.indentations[i].axis;
    made.curve.stds.assign(test.depths.size(), test.force_noise);
    s.indentations.push_back(std::move(made));
  }
  return s;
}

}  // namespace pliant
