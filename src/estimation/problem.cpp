#include "estimation/problem.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "capture/markers.hpp"

namespace pliant {

namespace {

constexpr double density_guess = 200.0;  // [kg/m^3], where nothing anchors it: only ratios follow then
constexpr double gravity_guess = 9.81;
constexpr double range_error_std = 0.02;  // [m], of light that enters a translucent material

void add_scalar(std::vector<Parameter>& parameters, const char* name, const char* unit, Transform transform, int index,
                double lower, double upper, double prior_mean, double prior_std, bool estimated, double scale = 1.0) {
  Parameter p{name, unit, transform, index, scale, lower, upper, estimated};
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

Vector3 centre_of(const TriangleMesh& surface) {
  const Box box = bounding_box(surface);
  return 0.5 * (box.min + box.max);
}

}  // namespace

std::shared_ptr<const SignedDistance> capture_distance(const Capture& capture, double band) {
  if (!capture.scene.object.surface)
    throw InputError({{capture.file},
                      "there is no scan of the object at rest ([object] surface)",
                      "a closed triangle mesh",
                      "scan the object and name the mesh in capture.toml"});
  return scene_distance(capture.scene, band);
}

Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          const Resolution& resolution, const VectorX& parameters, const SimulationOptions& settings,
                          const std::vector<Vector3>& tracked) {
  std::vector<Vector3> control_points;
  auto body = make_body_of(capture.scene, *distance, resolution, control_points);
  Discretisation d =
      discretise(capture, std::move(distance), std::move(body), resolution, parameters, settings, tracked);
  d.control_points = std::move(control_points);
  return d;
}

Mismatch make_mismatch(const Capture& capture, const std::shared_ptr<const SignedDistance>& distance,
                       const std::shared_ptr<const Body>& body, const Resolution& resolution,
                       const std::vector<Vector3>& tracked) {
  Mismatch mismatch;
  const double size = object_size(capture.scene);
  if (!capture.depth.empty() || !capture.clouds.empty())
    mismatch.surface =
        std::make_shared<SurfaceConstraints>(body, distance, resolution.band * size, size / resolution.cells);
  if (!tracked.empty()) mismatch.tracks = std::make_shared<PointTracks>(*body, tracked);
  mismatch.centre = centre_of(*capture.scene.object.surface);
  return mismatch;
}

Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          std::shared_ptr<const Body> body, const Resolution& resolution, const VectorX& parameters,
                          const SimulationOptions& settings, const std::vector<Vector3>& tracked) {
  Discretisation d;
  d.distance = std::move(distance);
  d.body = std::move(body);
  d.mismatch = make_mismatch(capture, d.distance, d.body, resolution, tracked);
  d.simulation = make_simulation(capture.scene, *d.body, resolution, parameters, settings);
  d.simulation.sensors = int(sensor_names(capture).size());
  return d;
}

std::vector<std::string> sensor_names(const Capture& capture) {
  std::vector<std::string> names;
  for (const DepthCamera& camera : capture.depth) names.push_back(camera.name);
  if (!capture.clouds.empty()) names.emplace_back("clouds");
  if (!capture.markers.empty()) names.emplace_back("markers");
  return names;
}

std::vector<std::string> modulus_names(const Capture& capture, int controls) {
  std::vector<std::string> names;
  for (int k = 0; k < controls; ++k) {
    if (controls == 1 || (k == 0 && !capture.scene.regions.empty()))
      names.emplace_back("youngs_modulus");
    else if (!capture.scene.regions.empty())
      names.push_back("youngs_modulus@" + capture.scene.regions[std::size_t(k) - 1].name);
    else
      names.push_back("youngs_modulus@" + std::to_string(k + 1));
  }
  return names;
}

void set_moduli(VectorX& theta, int controls, double youngs_modulus) {
  for (int k = 0; k < controls; ++k) theta[theta::modulus(k, controls, theta.size())] = youngs_modulus;
}

ParameterSet default_parameters(const Capture& capture, double volume, int controls, int pulls, int shapes) {
  const double size = object_size(capture.scene);
  const double gravity = capture.scene.world.gravity ? capture.scene.world.gravity->norm() : gravity_guess;
  const double density = capture.scene.object.mass      ? *capture.scene.object.mass / volume
                         : capture.scene.object.density ? *capture.scene.object.density
                                                        : density_guess;
  const double time = std::sqrt(size / std::max(gravity, 0.1));   // of a fall through the object's own size
  const double stress = density * std::max(gravity, 0.1) * size;  // under its own weight

  const int planes = int(capture.scene.planes.size());
  const std::vector<std::string> sensors = sensor_names(capture);
  VectorX theta = VectorX::Zero(theta::size(planes, controls, pulls, int(sensors.size()), shapes));
  set_moduli(theta, controls, 20.0 * stress);
  theta[theta::poissons_ratio] = 0.35;
  theta[theta::mass_damping] = 0.05 / time;
  theta[theta::stiffness_damping] = 0.02 * time;
  theta[theta::density] = density;
  theta.segment<3>(theta::gravity) = capture.scene.world.gravity.value_or(-gravity_guess * capture.scene.world.up);
  theta.segment<3>(theta::linear_velocity) = capture.scene.initial.linear_velocity;
  theta.segment<3>(theta::angular_velocity) = capture.scene.initial.angular_velocity;

  std::vector<Parameter> p;
  // Priors are wide: they say what soft solids are like and only matter where the recording says nothing.
  const std::vector<std::string> names = modulus_names(capture, controls);
  for (int k = 0; k < controls; ++k)
    add_scalar(p, names[std::size_t(k)].c_str(), "Pa", Transform::Logarithm, theta::modulus(k, controls, theta.size()),
               1e-2 * stress, 1e8 * stress, std::log(theta[theta::youngs_modulus]),
               std::numeric_limits<double>::infinity(), true);
  add_scalar(p, "poisson_ratio", "1", Transform::LogitHalf, theta::poissons_ratio, 0.02, 0.495, std::log(0.35 / 0.15),
             0.5, true);
  add_scalar(p, "mass_damping", "1/s", Transform::Logarithm, theta::mass_damping, 1e-4 / time, 20.0 / time,
             std::log(theta[theta::mass_damping]), 1.5, !capture.scene.timing.is_static);
  add_scalar(p, "stiffness_damping", "s", Transform::Logarithm, theta::stiffness_damping, 1e-5 * time, 2.0 * time,
             std::log(theta[theta::stiffness_damping]), 1.5, !capture.scene.timing.is_static);
  add_scalar(
      p, "density", "kg/m^3", Transform::Logarithm, theta::density, 0.1, 3e4, std::log(density), 0.5,
      !capture.scene.object.mass && !capture.scene.object.density && capture.scene.initial.release_of.has_value());
  if (capture.scene.world.gravity) {  // its length is known better than how the world's axes stand
    Parameter direction{"gravity", "m/s^2", Transform::Direction, theta::gravity};
    direction.prior_std = 0.05;
    direction.prior_mean = VectorX::Zero(2);
    direction.origin = *capture.scene.world.gravity;
    p.push_back(std::move(direction));
  } else {
    add_vector(p, "gravity", "m/s^2", Transform::Vector, theta::gravity, 1.0, theta.segment<3>(theta::gravity), 10.0,
               true);
  }
  const double speed = std::sqrt(gravity * size);
  const bool moves = !capture.scene.initial.known && !capture.scene.timing.is_static;
  add_vector(p, "linear_velocity", "m/s", Transform::Vector, theta::linear_velocity, speed,
             theta.segment<3>(theta::linear_velocity) / speed, 3.0, moves);
  add_vector(p, "angular_velocity", "rad/s", Transform::Vector, theta::angular_velocity, 1.0 / time,
             theta.segment<3>(theta::angular_velocity) * time, 3.0, moves);
  for (int i = 0; i < int(capture.scene.planes.size()); ++i) {
    theta.segment<3>(theta::plane_point(i)) = capture.scene.planes[i].point;
    theta.segment<3>(theta::plane_normal(i)) = capture.scene.planes[i].normal;
    const std::string name = i == 0 ? "plane" : "plane_" + std::to_string(i + 1);
    Parameter plane{name, "", Transform::PlanePosition, theta::plane_point(i), size};
    plane.estimated = !capture.scene.planes[i].known;
    plane.prior_std = 0.2;
    plane.prior_mean = VectorX::Zero(3);
    plane.origin = theta.segment<6>(theta::plane_point(i));
    p.push_back(std::move(plane));
  }
  for (int k = 0; k < std::min(pulls, int(capture.scene.initial.pulls.size())); ++k)
    theta.segment<3>(theta::pull(k, planes)) = capture.scene.initial.pulls[std::size_t(k)];
  for (int k = 0; k < pulls; ++k)
    add_vector(p, "pull@" + std::to_string(k + 1), "1", Transform::Vector, theta::pull(k, planes), 1.0, Vector3::Zero(),
               0.5, true);
  for (int k = 0; k < int(sensors.size()); ++k) {
    const int at = theta::sensor(k, planes, pulls);
    const std::string& sensor = sensors[std::size_t(k)];
    if (k < int(capture.depth.size()))
      add_scalar(p, ("range_error@" + sensor).c_str(), "m", Transform::Shift, at, -0.2, 0.2, 0.0,
                 range_error_std / size, false, size);
    add_vector(p, "sensor_turn@" + sensor, "rad", Transform::Vector, at + 1, 1.0, Vector3::Zero(), 0.05, false);
    add_vector(p, "sensor_shift@" + sensor, "m", Transform::Vector, at + 4, size, Vector3::Zero(), 0.05, false);
  }
  for (int k = 0; k < shapes; ++k)
    add_vector(p, "scan_correction@" + std::to_string(k + 1), "1", Transform::Vector,
               theta::shape(k, planes, pulls, int(sensors.size())), 1.0, Vector3::Zero(), 1.0, true);
  return {std::move(p), std::move(theta)};
}

TrackedPoints tracked_points(const Capture& capture) {
  TrackedPoints tracked;
  const double noise = capture.scene.object.surface ? 1e-3 * object_size(capture.scene) : 1e-3;
  for (const MarkerTrack& block : capture.markers) {
    const MarkerSet set = read_markers(block, capture.frame_count());
    const int sensor = int(sensor_names(capture).size()) - 1;
    const int first = int(tracked.rest.size());
    for (int m = 0; m < set.marker_count(); ++m) tracked.rest.push_back(set.rest.row(m).transpose());
    for (int frame = 0; frame < int(set.frames.size()); ++frame)
      for (int m = 0; m < set.marker_count(); ++m)
        if (set.is_seen(frame, m))
          tracked.frames[frame].push_back(
              {first + m, set.frames[std::size_t(frame)].row(m).transpose(), noise, sensor});
  }
  return tracked;
}

std::vector<FrameObservations> frame_observations(const Capture& capture, const std::vector<ObservedFrame>& observed,
                                                  const TrackedPoints& tracked) {
  const auto frame_of = [&](int recorded) {
    const int frame = recorded - capture.scene.timing.start_frame;
    return capture.scene.initial.released ? std::max(frame, 0) : frame;
  };
  const int cameras = int(capture.depth.size());
  std::map<int, FrameObservations> frames;
  for (const ObservedFrame& seen : observed) {
    std::vector<SurfaceObservation>& points = frames[frame_of(seen.frame)].points;
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
      const int camera = i < seen.camera.size() ? seen.camera[i] : -1;
      points.push_back({seen.points[i], double(seen.noise[i]), camera < 0 ? cameras : camera,
                        i < seen.view.size() ? seen.view[i] : Vector3::Zero()});
    }
  }
  for (const auto& [frame, points] : tracked.frames) {
    auto& tracks = frames[frame_of(frame)].tracks;
    tracks.insert(tracks.end(), points.begin(), points.end());
  }
  std::vector<FrameObservations> from_start;
  for (auto& [frame, seen] : frames) {
    if (frame < 0 || frame >= capture.frame_count() - capture.scene.timing.start_frame) continue;
    seen.frame = frame;
    from_start.push_back(std::move(seen));
  }
  return from_start;
}

}  // namespace pliant
