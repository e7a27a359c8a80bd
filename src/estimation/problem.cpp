#include "estimation/problem.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "capture/region.hpp"

namespace pliant {

namespace {

constexpr double density_guess = 200.0;  // [kg/m^3], where nothing anchors it: only ratios follow then
constexpr double gravity_guess = 9.81;

std::function<bool(const Vector3&)> region_test(const Capture& capture, const Region& region) {
  const auto* vertices = std::get_if<RegionVertices>(&region);
  if (!vertices) return [region](const Vector3& p) { return contains(region, p); };
  // Named vertices hold the object around them, as far as the next vertices.
  std::vector<Vector3> centres;
  double radius = 0.0;
  const TriangleMesh& mesh = *capture.surface;
  for (const int v : vertices->indices) centres.push_back(mesh.vertices[std::size_t(v)]);
  for (const auto& triangle : mesh.triangles)
    for (int side = 0; side < 3; ++side)
      radius += (mesh.vertices[triangle[side]] - mesh.vertices[triangle[(side + 1) % 3]]).norm();
  radius /= 3.0 * double(mesh.triangles.size());
  return [centres = std::move(centres), radius](const Vector3& p) {
    return std::any_of(centres.begin(), centres.end(), [&](const Vector3& c) { return (p - c).norm() <= radius; });
  };
}

void add_scalar(std::vector<Parameter>& parameters, const char* name, const char* unit, Transform transform, int index,
                double lower, double upper, double prior_mean, double prior_std, bool estimated) {
  Parameter p{name, unit, transform, index, 1.0, lower, upper, estimated};
  p.prior_std = prior_std;
  p.prior_mean = VectorX::Constant(1, prior_mean);
  parameters.push_back(std::move(p));
}

void add_vector(std::vector<Parameter>& parameters, const std::string& name, const char* unit, Transform transform,
                int index, double scale, const Vector3& prior_mean, double prior_std, bool estimated) {
  Parameter p{name, unit, transform, index, scale};
  p.estimated = estimated;
  p.prior_std = prior_std;
  p.prior_mean = prior_mean;
  parameters.push_back(std::move(p));
}

}  // namespace

double object_size(const Capture& capture) { return bounding_box(*capture.surface).extent().maxCoeff(); }

std::shared_ptr<const SignedDistance> capture_distance(const Capture& capture, double band) {
  if (!capture.surface)
    throw InputError({{capture.file}, "there is no scan of the object at rest ([object] surface)",
                      "a closed triangle mesh", "scan the object and name the mesh in capture.toml"});
  const double size = object_size(capture);
  return std::make_shared<SignedDistance>(signed_distance(*capture.surface, size / 80.0, (band + 0.1) * size));
}

Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          const Resolution& resolution, const VectorX& parameters, const SimulationOptions& settings) {
  Discretisation d;
  d.distance = std::move(distance);
  const double size = object_size(capture);
  d.body = std::make_shared<Body>(make_body(make_hex_grid(*d.distance, bounding_box(*capture.surface), size / resolution.cells)));
  d.constraints = std::make_shared<SurfaceConstraints>(d.body, d.distance, resolution.band * size);
  d.simulation = settings;
  d.simulation.times.assign(capture.times.begin() + capture.start_frame, capture.times.end());
  const double gravity = std::max(theta::vector_at(parameters, theta::gravity).norm(), 0.1);
  d.simulation.max_dt = default_time_step(*d.body, gravity) / resolution.steps;
  d.simulation.planes = int(capture.planes.size());
  d.simulation.contact = default_contact(*d.body, parameters[theta::density] * d.body->volume(), gravity);
  for (const FixedRegion& fixed : capture.fixed) {
    const RigidMotion motion = fixed.displaced_to.value_or(RigidMotion{});
    d.simulation.holds.push_back({region_test(capture, fixed.region), motion.rotation, motion.translation});
  }
  return d;
}

ParameterSet default_parameters(const Capture& capture, double volume) {
  const double size = object_size(capture);
  const double gravity = capture.gravity ? capture.gravity->norm() : gravity_guess;
  const double density = capture.mass      ? *capture.mass / volume
                         : capture.density ? *capture.density
                                           : density_guess;
  const double time = std::sqrt(size / std::max(gravity, 0.1));  // of a fall through the object's own size
  const double stress = density * std::max(gravity, 0.1) * size; // under its own weight

  VectorX theta = VectorX::Zero(theta::size(int(capture.planes.size())));
  theta[theta::youngs_modulus] = 20.0 * stress;
  theta[theta::poissons_ratio] = 0.35;
  theta[theta::mass_damping] = 0.05 / time;
  theta[theta::stiffness_damping] = 0.02 * time;
  theta[theta::density] = density;
  theta.segment<3>(theta::gravity) = capture.gravity.value_or(-gravity_guess * capture.up);
  theta.segment<3>(theta::linear_velocity) = capture.initial.linear_velocity;
  theta.segment<3>(theta::angular_velocity) = capture.initial.angular_velocity;

  std::vector<Parameter> p;
  // Priors are wide: they say what soft solids are like and only matter where the recording says nothing.
  add_scalar(p, "youngs_modulus", "Pa", Transform::Logarithm, theta::youngs_modulus, 1e-2 * stress, 1e8 * stress,
             std::log(theta[theta::youngs_modulus]), std::numeric_limits<double>::infinity(), true);
  add_scalar(p, "poisson_ratio", "1", Transform::LogitHalf, theta::poissons_ratio, 0.02, 0.495, std::log(0.35 / 0.15), 0.5, true);
  add_scalar(p, "mass_damping", "1/s", Transform::Logarithm, theta::mass_damping, 1e-4 / time, 20.0 / time,
             std::log(theta[theta::mass_damping]), 1.5, true);
  add_scalar(p, "stiffness_damping", "s", Transform::Logarithm, theta::stiffness_damping, 1e-5 * time, 2.0 * time,
             std::log(theta[theta::stiffness_damping]), 1.5, true);
  add_scalar(p, "density", "kg/m^3", Transform::Logarithm, theta::density, 0.1, 3e4, std::log(density), 0.5, false);
  add_vector(p, "gravity", "m/s^2", Transform::Vector, theta::gravity, 1.0, theta.segment<3>(theta::gravity),
             capture.gravity ? 0.2 : 10.0, !capture.gravity);
  const double speed = std::sqrt(gravity * size);
  const bool moves = !capture.initial.known;
  add_vector(p, "linear_velocity", "m/s", Transform::Vector, theta::linear_velocity, speed,
             theta.segment<3>(theta::linear_velocity) / speed, 3.0, moves);
  add_vector(p, "angular_velocity", "rad/s", Transform::Vector, theta::angular_velocity, 1.0 / time,
             theta.segment<3>(theta::angular_velocity) * time, 3.0, moves);
  for (int i = 0; i < int(capture.planes.size()); ++i) {
    theta.segment<3>(theta::plane_point(i)) = capture.planes[i].point;
    theta.segment<3>(theta::plane_normal(i)) = capture.planes[i].normal;
    const std::string name = i == 0 ? "plane" : "plane_" + std::to_string(i + 1);
    Parameter plane{name, "", Transform::PlanePosition, theta::plane_point(i), size};
    plane.estimated = !capture.planes[i].known;
    plane.prior_std = 0.2;
    plane.prior_mean = VectorX::Zero(3);
    p.push_back(std::move(plane));
  }
  return {std::move(p), std::move(theta)};
}

std::vector<FrameObservations> frame_observations(const Capture& capture, const std::vector<ObservedFrame>& observed) {
  std::vector<FrameObservations> frames;
  for (const ObservedFrame& seen : observed) {
    if (seen.frame < capture.start_frame || seen.points.empty()) continue;
    FrameObservations& frame = frames.emplace_back();
    frame.frame = seen.frame - capture.start_frame;
    for (std::size_t i = 0; i < seen.points.size(); ++i) frame.points.push_back({seen.points[i], double(seen.noise[i])});
  }
  return frames;
}

}  // namespace pliant
