#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings.hpp"
#include "interruption.hpp"
#include "model/model.hpp"
#include "motion.hpp"
#include "simulation/scene_simulation.hpp"
#include "situation/situation_scene.hpp"

namespace pliant::python {

namespace {

using PlaneNumbers = std::tuple<Doubles, Doubles, double>;                    // point, normal, friction
using RegionNumbers = std::tuple<std::string, std::vector<Doubles>, Doubles>;  // kind, its vectors, displacement
using ForceNumbers = std::tuple<Doubles, double, Doubles, Doubles>;           // place, radius, times, forces

Region region_of(const std::string& kind, const std::vector<Doubles>& vectors) {
  const auto vector = [&](std::size_t k, const char* name) { return vector_of(vectors[k], name); };
  if (kind == "box") return RegionBox{vector(0, "least"), vector(1, "greatest")};
  if (kind == "ball") {
    check_shape(vectors[1], "radius", {1});
    return RegionSphere{vector(0, "centre"), vectors[1].data()[0]};
  }
  return RegionHalfSpace{vector(0, "point"), vector(1, "normal").normalized()};
}

KeyFrames<3>::Key key_of(double time, const double* force) {
  KeyFrames<3>::Key key;
  key.time = time;
  key.value = Eigen::Map<const Vector3>(force);
  return key;
}

AppliedForce force_of(const ForceNumbers& numbers) {
  const auto& [place, radius, times, forces] = numbers;
  AppliedForce force;
  force.at = vector_of(place, "at");
  force.radius = radius;
  check_shape(times, "times", {-1});
  check_shape(forces, "force", {times.shape()[0], 3});
  check_finite(times, "times"), check_finite(forces, "force");
  for (py::ssize_t k = 0; k < times.shape()[0]; ++k) {
    if (k > 0 && !(times.at(k) > times.at(k - 1))) throw py::value_error("times: expected growing times");
    force.force.push_back(key_of(times.at(k), forces.data(k, 0)));
  }
  return force;
}

TriangleMesh boundary_of(const Body& body) {
  TriangleMesh surface;
  if (const auto* mesh = std::get_if<TetMesh>(&body.mesh)) {
    VolumeMesh volume;
    volume.nodes = mesh->nodes, volume.tets = mesh->tets;
    return boundary_surface(volume);
  }
  // Hexahedra are cut by the surface that they were made of; regions and sizes only ask where it reaches.
  for (const SurfacePoint& point : body.surface) surface.vertices.push_back(point.position);
  return surface;
}

std::unique_ptr<Motion> motion_of_body(const std::shared_ptr<Body>& body, const Doubles& times, const Doubles& moduli,
                                       double poissons_ratio, double density, double mass_damping,
                                       double stiffness_damping, const Doubles& gravity, const Doubles& linear_velocity,
                                       const Doubles& angular_velocity, const std::vector<PlaneNumbers>& planes,
                                       const std::vector<RegionNumbers>& fixed,
                                       const std::vector<ForceNumbers>& forces, bool is_static, bool corotated,
                                       bool rayleigh, bool newton, double steps) {
  Scene scene;
  scene.object.surface = boundary_of(*body);
  scene.object.density = density;
  scene.world.gravity = vector_of(gravity, "gravity");
  check_shape(times, "times", {-1});
  check_finite(times, "times");
  scene.timing.times.assign(times.data(), times.data() + times.size());
  for (std::size_t k = 1; k < scene.timing.times.size(); ++k)
    if (!(scene.timing.times[k] > scene.timing.times[k - 1])) throw py::value_error("times: expected growing times");
  if (scene.timing.times.empty()) throw py::value_error("times: expected one time or more");
  scene.timing.is_static = is_static;
  for (const auto& [point, normal, friction] : planes)
    scene.planes.push_back({vector_of(point, "point"), vector_of(normal, "normal").normalized(), true, friction, true});
  for (const auto& [kind, vectors, displacement] : fixed) {
    FixedRegion region{region_of(kind, vectors), {}};
    const Vector3 shift = vector_of(displacement, "displacement");
    if (!shift.isZero(0.0)) region.displaced_to = RigidMotion{Matrix3::Identity(), shift};
    scene.fixed.push_back(std::move(region));
  }
  for (const ForceNumbers& force : forces) scene.forces.push_back(force_of(force));
  check_shape(moduli, "youngs_modulus", {body->modulus.controls});
  check_finite(moduli, "youngs_modulus");

  ModelScene made;
  MotionCounts counts = load_counts(scene);
  counts.moduli = body->modulus.controls;
  const MotionLayout blocks(counts);
  made.layout = blocks.layout();
  made.theta = blocks.zero();
  for (std::size_t k = 0; k < blocks.youngs_moduli.size(); ++k)
    made.theta[blocks.youngs_moduli[k]] = moduli.data()[k];
  made.theta[blocks.poissons_ratio] = poissons_ratio;
  made.theta[blocks.mass_damping] = mass_damping;
  made.theta[blocks.stiffness_damping] = stiffness_damping;
  made.theta[blocks.density] = density;
  made.theta.segment<3>(blocks.gravity) = vector_of(gravity, "gravity");
  made.theta.segment<3>(blocks.linear_velocity) = vector_of(linear_velocity, "linear_velocity");
  made.theta.segment<3>(blocks.angular_velocity) = vector_of(angular_velocity, "angular_velocity");
  set_obstacles(scene, blocks, made.theta);
  set_loads(scene, blocks, made.theta);
  SimulationOptions settings;
  if (corotated) settings.material.elastic = ElasticLaw::Corotated;
  if (rayleigh) settings.material.damping = StiffnessDamping::Rayleigh;
  if (newton) settings.integrator = Integrator::Newton;
  Resolution resolution;
  resolution.element = body->kind;
  if (!(steps > 0.0)) throw py::value_error("steps: expected a positive number");
  resolution.steps = steps;
  made.body = body;
  made.simulation = make_simulation(scene, *body, resolution, blocks, made.theta, settings);
  return std::make_unique<Motion>(std::move(made));
}

std::unique_ptr<Motion> motion_of_model(const Model& model, const std::optional<std::filesystem::path>& situation,
                                        double duration) {
  const py::gil_scoped_release unlocked;
  if (!situation) return std::make_unique<Motion>(make_scene(model));
  Situation read = read_situation(*situation);
  if (duration > 0.0) read.duration = duration;
  return std::make_unique<Motion>(make_scene(model, read));
}

RunState state_of(const Body& body, const std::optional<Doubles>& start, const std::optional<Doubles>& start_velocities,
                  const std::optional<Doubles>& reference) {
  RunState state;
  if (start) state.start = points_of(*start, "start", body.node_count());
  if (start_velocities) state.start_velocities = points_of(*start_velocities, "start_velocities", body.node_count());
  if (reference) state.reference = points_of(*reference, "reference", body.node_count());
  return state;
}

VectorX theta_of(const Motion& motion, const Doubles& theta) {
  check_shape(theta, "theta", {motion.scene().layout.size()});
  check_finite(theta, "theta");
  return Eigen::Map<const VectorX>(theta.data(), theta.size());
}

int frames_of(const Motion& motion, int frames) {
  if (frames < 1 || frames > motion.frame_count())
    throw py::value_error("frames: expected 1 to " + std::to_string(motion.frame_count()) + ", got " +
                          std::to_string(frames));
  return frames;
}

py::dict run_motion(Motion& motion, const Doubles& theta, const std::optional<Doubles>& start,
             const std::optional<Doubles>& start_velocities, const std::optional<Doubles>& reference, int frames) {
  const VectorX values = theta_of(motion, theta);
  const RunState state = state_of(motion.body(), start, start_velocities, reference);
  frames_of(motion, frames);
  Interruption interruption;
  Frames made;
  {
    const py::gil_scoped_release unlocked;
    made = motion.run(values, state, frames, [&] { return interruption.asked(); });
  }
  interruption.rethrow();
  const py::ssize_t nodes = motion.body().node_count();
  py::dict out;
  out["positions"] = array_of(std::move(made.positions), {frames, nodes, 3});
  out["velocities"] = array_of(std::move(made.velocities), {frames, nodes, 3});
  out["steps"] = made.steps;
  return out;
}

py::dict gradient_of(Motion& motion, const Doubles& theta, const Doubles& cotangent, const std::optional<Doubles>& start,
                  const std::optional<Doubles>& start_velocities, const std::optional<Doubles>& reference,
                  bool with_reference) {
  const VectorX values = theta_of(motion, theta);
  const RunState state = state_of(motion.body(), start, start_velocities, reference);
  check_shape(cotangent, "cotangent", {-1, motion.body().node_count(), 3});
  check_finite(cotangent, "cotangent");
  const int frames = frames_of(motion, int(cotangent.shape()[0]));
  Interruption interruption;
  Gradient made;
  try {
    const py::gil_scoped_release unlocked;
    made = motion.gradient(values, state, cotangent.data(), frames, with_reference,
                           [&] { return interruption.asked(); });
  } catch (const SimulationFailure&) {
    interruption.rethrow();
    throw;
  }
  py::dict out;
  out["theta"] = array_of(std::move(made.theta));
  out["start"] = array_of(std::move(made.nodes.start));
  out["start_velocities"] = array_of(std::move(made.nodes.start_velocities));
  if (with_reference) out["reference"] = array_of(std::move(made.nodes.reference));
  return out;
}

}  // namespace

void bind_motions(py::module_& module) {
  py::class_<Motion>(module, "Motion")
      .def_static("of_body", &motion_of_body)
      .def_static("of_model", &motion_of_model)
      .def_property_readonly("body",
                             [](const Motion& motion) { return std::const_pointer_cast<Body>(motion.scene().body); })
      .def_property_readonly("times", [](const Motion& motion) { return motion.scene().simulation.times; })
      .def_property_readonly("theta", [](const Motion& motion) { return array_of(motion.scene().theta); })
      .def_property_readonly("blocks",
                             [](const Motion& motion) {
                               py::list blocks;
                               const ParameterLayout& layout = motion.scene().layout;
                               for (const ParameterBlock& block : layout.blocks())
                                 blocks.append(py::make_tuple(block.name, layout.at(block.name).first, block.size,
                                                              block.unit));
                               return blocks;
                             })
      .def_property_readonly("max_dt", [](const Motion& motion) { return motion.scene().simulation.max_dt; })
      .def("run", &run_motion)
      .def("gradient", &gradient_of);
}

}  // namespace pliant::python
