#include "estimation/problem.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "base/error.hpp"
#include "base/instants.hpp"
#include "capture/markers.hpp"
#include "estimation/press_law.hpp"
#include "estimation/pull_places.hpp"
#include "estimation/sensor_poses.hpp"

namespace pliant {

namespace {

constexpr double density_guess = 200.0;  // [kg/m^3], where nothing anchors it: only ratios follow then
constexpr double gravity_guess = 9.81, gravity_std = 10.0;  // [m/s^2]
constexpr double up_std = 0.05;                             // [rad], of a direction that is given as up
constexpr double contact_std = 1.2;      // of the logarithm of its stiffness: a board, a carpet, a furry skin
constexpr double hardest_contact = 2.0;  // times that which is as good as rigid: beyond, motions are erratic
constexpr double friction_guess = 0.3, friction_std = 0.5;  // of its coefficient, of cloth, rubber or skin on floors
constexpr double least_wind = 1.0;                          // [m/s], scale of one that is not known
constexpr double range_error_std = 0.02;                    // [m], of light that enters a translucent material
constexpr double most_outline_error = 20.0;                 // [pixels]

/// Whether forces are known, which fix the absolute scale of stiffness: a weight that is let go, or weights that hang
/// while the object is seen.
bool has_known_forces(const Capture& capture) {
  return capture.scene.initial.release_of.has_value() ||
         std::ranges::any_of(capture.loads, [](const Load& load) { return load.role == "fit"; });
}

/// Of a scalar: its block gives name and unit.
Parameter scalar(const ParameterLayout& layout, const ParameterHandle& at, Transform transform, double lower,
                 double upper, double prior_mean, double prior_std, bool estimated, double scale = 1.0) {
  const ParameterBlock& block = layout.block_of(at);
  Parameter p{block.name, block.unit, transform, at, scale, lower, upper, estimated};
  p.prior_std = prior_std;
  p.prior_mean = VectorX::Constant(1, prior_mean);
  return p;
}

Parameter vector(const ParameterLayout& layout, const ParameterHandle& at, double scale, const Vector3& prior_mean,
                 double prior_std, bool estimated) {
  const ParameterBlock& block = layout.block_of(at);
  Parameter p{block.name, block.unit, Transform::Vector, at, scale};
  p.estimated = estimated;
  p.prior_std = prior_std;
  p.prior_mean = prior_mean;
  return p;
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
                          const Resolution& resolution, const CaptureBlocks& blocks, const VectorX& parameters,
                          const SimulationOptions& settings, const std::vector<Vector3>& tracked) {
  std::vector<Vector3> control_points;
  auto body = make_body_of(capture.scene, *distance, resolution, control_points);
  Discretisation d =
      discretise(capture, std::move(distance), std::move(body), resolution, blocks, parameters, settings, tracked);
  d.control_points = std::move(control_points);
  return d;
}

Mismatch make_mismatch(const Capture& capture, const std::shared_ptr<const SignedDistance>& distance,
                       const std::shared_ptr<const Body>& body, const Resolution& resolution,
                       const std::vector<Vector3>& tracked) {
  Mismatch mismatch;
  const double size = object_size(capture.scene);
  const bool any_load =
      std::ranges::any_of(capture.loads, [](const Load& load) { return load.cloud || !load.images.empty(); });
  if (!capture.depth.empty() || !capture.clouds.empty() || any_load)
    mismatch.surface =
        std::make_shared<SurfaceConstraints>(body, distance, resolution.band * size, size / resolution.cells);
  if (!capture.silhouettes.empty())
    mismatch.outlines = std::make_shared<OutlineConstraints>(*body, *capture.scene.object.surface,
                                                             size / resolution.cells, resolution.band * size);
  if (!tracked.empty()) mismatch.tracks = std::make_shared<PointTracks>(*body, tracked);
  mismatch.centre = centre_of(*capture.scene.object.surface);
  return mismatch;
}

Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          std::shared_ptr<const Body> body, const Resolution& resolution, const CaptureBlocks& blocks,
                          const VectorX& parameters, const SimulationOptions& settings,
                          const std::vector<Vector3>& tracked) {
  if (resolution.offset) {  // what is simulated and compared is an object of that surface
    Capture off = capture;
    TriangleMesh& surface = off.scene.object.surface.emplace(surface_of(capture.scene, resolution));
    Resolution on = resolution;
    on.offset = {};
    const auto outwards = std::make_shared<SignedDistance>(offset_distance(capture.scene, *distance, resolution));
    Discretisation d = discretise(off, outwards, std::move(body), on, blocks, parameters, settings, tracked);
    d.surface = std::move(surface);
    return d;
  }
  Discretisation d;
  d.distance = std::move(distance);
  d.body = std::move(body);
  d.mismatch = make_mismatch(capture, d.distance, d.body, resolution, tracked);
  d.mismatch.sensors = blocks.sensors;
  d.simulation = make_simulation(capture.scene, *d.body, resolution, blocks.motion, parameters, settings);
  if (blocks.law) d.simulation.material.elastic = *blocks.law;
  return d;
}

const TriangleMesh& surface_of(const Capture& capture, const Discretisation& discretisation) {
  return discretisation.surface ? *discretisation.surface : *capture.scene.object.surface;
}

std::vector<std::string> sensor_names(const Capture& capture) {
  std::vector<std::string> names;
  for (const DepthCamera& camera : capture.depth) names.push_back(camera.name);
  if (!capture.clouds.empty()) names.emplace_back("clouds");
  for (const SilhouetteCamera& camera : capture.silhouettes) names.push_back(camera.name);
  if (!capture.markers.empty()) names.emplace_back("markers");
  return names;
}

int silhouette_sensor(const Capture& capture, int camera) {
  return int(capture.depth.size()) + (capture.clouds.empty() ? 0 : 1) + camera;
}

std::vector<std::string> modulus_names(const Capture& capture, int controls) {
  std::vector<std::string> names = named_moduli(capture.scene);
  if (controls == 1) return {"youngs_modulus"};
  if (int(names.size()) == controls) return names;
  names.clear();
  for (int k = 1; k <= controls; ++k) names.push_back("youngs_modulus@" + std::to_string(k));
  return names;
}

CaptureParameters default_parameters(const Capture& capture, double volume, int controls, int pulls, int shapes,
                                     const std::optional<LawForm>& law) {
  const double size = object_size(capture.scene);
  const double gravity = capture.scene.world.gravity ? capture.scene.world.gravity->norm() : gravity_guess;
  const double density = capture.scene.object.mass      ? *capture.scene.object.mass / volume
                         : capture.scene.object.density ? *capture.scene.object.density
                                                        : density_guess;
  const double time = std::sqrt(size / std::max(gravity, 0.1));   // of a fall through the object's own size
  const double stress = density * std::max(gravity, 0.1) * size;  // under its own weight

  ParameterLayout layout;
  CaptureBlocks blocks;
  MotionCounts counts = load_counts(capture.scene);
  counts.moduli = controls, counts.pulls = pulls, counts.scan_corrections = shapes;
  blocks.motion = add_motion_blocks(layout, counts, modulus_names(capture, controls));
  for (const std::string& sensor : sensor_names(capture)) {
    const bool is_silhouette = std::ranges::count(capture.silhouettes, sensor, &SilhouetteCamera::name) > 0;
    blocks.sensors.push_back(add_sensor_blocks(layout, sensor, is_silhouette ? "outline_error" : "range_error"));
  }
  const MotionBlocks& m = blocks.motion;
  if (law) blocks.law = LawLayout::of_motion(layout, m, *law);
  VectorX theta = VectorX::Zero(layout.size());
  m.set_moduli(theta, 20.0 * stress);
  theta[m.poissons_ratio] = 0.35;
  theta[m.mass_damping] = 0.05 / time;
  theta[m.stiffness_damping] = 0.02 * time;
  theta[m.density] = density;
  theta.segment<3>(m.gravity) = capture.scene.world.gravity.value_or(-gravity_guess * capture.scene.world.up);
  theta.segment<3>(m.linear_velocity) = capture.scene.initial.linear_velocity;
  theta.segment<3>(m.angular_velocity) = capture.scene.initial.angular_velocity;

  std::vector<Parameter> p;
  // Priors are wide: they say what soft solids are like and only matter where the recording says nothing.
  for (const ParameterHandle& modulus : m.youngs_moduli)
    p.push_back(scalar(layout, modulus, Transform::Logarithm, 1e-2 * stress, 1e8 * stress, std::log(theta[modulus]),
                       std::numeric_limits<double>::infinity(), true));
  p.push_back(scalar(layout, m.poissons_ratio, Transform::LogitHalf, 0.02, 0.495, std::log(0.35 / 0.15), 0.5, true));
  // Either damping may be as good as none. In a logarithm its derivatives would vanish there: a fit that came near zero
  // would stay, and the other one seem known where only their sum is.
  const auto damping = [&](const ParameterHandle& at, double least, double most) {
    return scalar(layout, at, Transform::InverseSinh, least, most, std::asinh(1.0), 1.5,
                  !capture.scene.timing.is_static, theta[at]);
  };
  p.push_back(damping(m.mass_damping, 1e-4 / time, 20.0 / time));
  p.push_back(damping(m.stiffness_damping, 1e-5 * time, 2.0 * time));
  p.push_back(scalar(layout, m.density, Transform::Logarithm, 0.1, 3e4, std::log(density), 0.5,
                     !capture.scene.object.mass && !capture.scene.object.density && has_known_forces(capture)));
  p.back().given_std = capture.scene.object.relative_mass_std();
  if (capture.scene.world.gravity) {  // its length is known better than how the world's axes stand
    Parameter direction = vector(layout, m.gravity, 1.0, Vector3::Zero(), 0.05, false);
    direction.transform = Transform::Direction;
    direction.prior_mean = VectorX::Zero(2);
    direction.origin = *capture.scene.world.gravity;
    direction.given_std = capture.scene.world.gravity_std;
    p.push_back(std::move(direction));
  } else {
    // How strong it is nobody said; where up is, the capture does.
    Parameter strength = vector(layout, m.gravity, 1.0, m.gravity.vector(theta), gravity_std, true);
    const Matrix3 along = capture.scene.world.up * capture.scene.world.up.transpose();
    strength.prior_shape = along + up_std * gravity_guess / gravity_std * (Matrix3::Identity() - along);
    p.push_back(std::move(strength));
  }
  const double speed = std::sqrt(gravity * size);
  const bool moves = !capture.scene.initial.known && !capture.scene.timing.is_static;
  p.push_back(vector(layout, m.linear_velocity, speed, m.linear_velocity.vector(theta) / speed, 3.0, moves));
  p.push_back(vector(layout, m.angular_velocity, 1.0 / time, m.angular_velocity.vector(theta) * time, 3.0, moves));
  set_obstacles(capture.scene, m, theta);
  // What is not known begins in the middle of what is usual: where nothing rubs, an object that tumbles takes another
  // way, from which steps rarely lead back.
  const auto friction = [&](const ParameterHandle& at, bool is_known) {
    const bool is_estimated = !is_known && !capture.scene.timing.is_static;
    if (is_estimated) theta[at] = friction_guess;
    return scalar(layout, at, Transform::Shift, 0.0, 5.0, theta[at], friction_std, is_estimated);
  };
  for (std::size_t i = 0; i < m.planes.size(); ++i) {
    Parameter plane = vector(layout, m.planes[i].whole(), size, Vector3::Zero(), 0.2, !capture.scene.planes[i].known);
    plane.transform = Transform::PlanePosition;
    plane.origin = theta.segment<6>(m.planes[i].whole());
    p.push_back(std::move(plane));
    p.push_back(friction(m.planes[i].friction, capture.scene.planes[i].knows_friction));
  }
  for (std::size_t i = 0; i < m.obstacles.size(); ++i)
    p.push_back(friction(m.obstacles[i].friction, capture.scene.obstacles[i].knows_friction));
  if (m.contact_stiffness.exists()) {
    theta[m.contact_stiffness] = default_contact_stiffness(density * volume * std::max(gravity, 0.1),
                                                           surface_area(*capture.scene.object.surface), size);
    p.push_back(scalar(layout, m.contact_stiffness, Transform::Logarithm, 1e-3 * theta[m.contact_stiffness],
                       hardest_contact * theta[m.contact_stiffness], std::log(theta[m.contact_stiffness]), contact_std,
                       !capture.scene.timing.is_static));
    p.back().acts_by_inverse = true;
  }
  set_loads(capture.scene, m, theta);
  if (m.wind.exists()) {
    const Vector3 guess = m.wind.vector(theta);
    const double scale = std::max(least_wind, guess.norm());
    p.push_back(vector(layout, m.wind, scale, guess / scale, 1.0, !capture.scene.wind->known));
  }
  for (std::size_t k = 0; k < m.strengths.size(); ++k)
    p.push_back(
        scalar(layout, m.strengths[k], Transform::Logarithm, 1e-3, 1e3, 0.0, 1.5, !capture.scene.forces[k].known));
  for (std::size_t k = 0; k < m.pulls.size(); ++k) {
    if (k < capture.scene.initial.pulls.size()) theta.segment<3>(m.pulls[k]) = capture.scene.initial.pulls[k];
    p.push_back(vector(layout, m.pulls[k], 1.0, Vector3::Zero(), pull_std, true));
    p.back().is_auxiliary = true;
  }
  constexpr double pose_correction_std = 0.05;  // [rad], and times the size: where a pose said to be exact shows wrong
  const std::vector<PoseStd> stds = pose_stds(capture);
  const auto pose = [&](const ParameterHandle& at, double scale, double std) {
    p.push_back(vector(layout, at, scale, Vector3::Zero(), std > 0.0 ? std / scale : pose_correction_std, std > 0.0));
  };
  for (std::size_t k = 0; k < blocks.sensors.size(); ++k) {
    const SensorBlocks& sensor = blocks.sensors[k];
    if (k < capture.depth.size()) {
      const DepthCamera& camera = capture.depth[k];
      const bool errs = camera.range_std.value_or(0.0) > 0.0;
      p.push_back(scalar(layout, sensor.error, Transform::Shift, -0.2, 0.2, 0.0,
                         (errs ? *camera.range_std : range_error_std) / size, errs, size));
      if (camera.range_std) p.back().given_std = *camera.range_std / size;
      for (const auto& [at, std] :
           {std::pair(sensor.range_scale, camera.range_scale_std), std::pair(sensor.focal_error, camera.focal_std)}) {
        if (std == 0.0) continue;
        p.push_back(scalar(layout, at, Transform::Shift, -1.0, 1.0, 0.0, std, true));
        p.back().given_std = std;
      }
    }
    const int silhouette = int(k) - silhouette_sensor(capture, 0);
    if (silhouette >= 0 && silhouette < int(capture.silhouettes.size())) {
      const SilhouetteCamera& masks = capture.silhouettes[std::size_t(silhouette)];
      const double pixel = pixel_size(capture, masks, capture.scene.timing.start_frame), std = masks.outline_error_std;
      p.push_back(scalar(layout, sensor.error, Transform::Shift, -most_outline_error * pixel,
                         most_outline_error * pixel, 0.0, (std > 0.0 ? std : 1.0) * pixel / size, std > 0.0, size));
      p.back().given_std = std * pixel / size;
    }
    pose(sensor.turn, 1.0, stds[k].turn);
    pose(sensor.shift, size, stds[k].shift);
  }
  for (const ParameterHandle& correction : m.scan_corrections) {
    p.push_back(vector(layout, correction, 1.0, Vector3::Zero(), 1.0, true));
    p.back().is_auxiliary = true;
  }
  for (int number = 0; law && number < law->laws; ++number) add_term_parameters(layout, *blocks.law, number, theta, p);
  return {ParameterSet(std::move(layout), std::move(p), std::move(theta)), std::move(blocks)};
}

TrackedPoints tracked_points(const Capture& capture) {
  constexpr double unknown_noise = 1e-3, least_noise = 1e-4;  // over the object's size
  TrackedPoints tracked;
  const double size = capture.scene.object.surface ? object_size(capture.scene) : 1.0;
  for (const MarkerTrack& block : capture.markers) {
    const MarkerSet set = read_markers(block, capture.scene.timing.frame_count());
    const double noise = std::max(least_noise * size, track_noise(set).value_or(unknown_noise * size));
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

OutlineObservation outline_observation(const Capture& capture, const ObservedOutline& seen, int frame) {
  const SilhouetteCamera& camera = capture.silhouettes[std::size_t(seen.camera)];
  const double pixel = pixel_size(capture, camera, frame);
  OutlineObservation observed{
      camera.at(frame), {}, camera.outline_std * pixel, pixel, silhouette_sensor(capture, seen.camera)};
  observed.camera.lens = {};
  for (std::size_t i = 0; i < seen.outline.points.size(); ++i)
    observed.points.push_back({seen.outline.points[i], seen.outline.normals[i]});
  return observed;
}

Sight sight_of(const Capture& capture, const ObservedFrame& seen, std::size_t i) {
  const int camera = i < seen.camera.size() ? seen.camera[i] : -1;
  return camera < 0 ? Sight{} : sight_of(capture.depth[std::size_t(camera)].at(seen.frame), seen.points[i]);
}

std::vector<FrameObservations> frame_observations(const Capture& capture, const std::vector<ObservedFrame>& observed,
                                                  const TrackedPoints& tracked, int first_at_rest) {
  const Timing& timing = capture.scene.timing;
  using Instant = std::pair<int, double>;  // frame of the simulation, and time after it
  const auto instant_of = [&](int recorded, double offset) -> Instant {
    int frame = recorded;
    double after = 0.0;
    if (offset != 0.0 && !timing.is_static) {
      const double time = timing.times[std::size_t(recorded)] + offset;
      const auto next = std::ranges::upper_bound(timing.times, time + same_instant);
      frame = int(next - timing.times.begin()) - 1;
      after = frame < 0 ? 0.0 : std::max(0.0, time - timing.times[std::size_t(frame)]);
      if (after < same_instant) after = 0.0;
    }
    frame -= timing.start_frame;
    const bool is_held = capture.scene.initial.released || (first_at_rest >= 0 && recorded >= first_at_rest);
    if (is_held && frame < 0) return {0, 0.0};  // as it is let go
    return {frame, after};
  };
  const int cameras = int(capture.depth.size());
  std::map<Instant, FrameObservations> frames;
  for (const ObservedFrame& seen : observed) {
    if (first_at_rest >= 0 && seen.frame >= first_at_rest && seen.frame <= timing.start_frame)
      ++frames[{0, 0.0}].at_rest;
    if (seen.points.empty() && seen.outlines.empty()) frames[instant_of(seen.frame, 0.0)];  // seen without a point
    for (const ObservedOutline& outline : seen.outlines) {
      const double offset = capture.silhouettes[std::size_t(outline.camera)].time_offset;
      frames[instant_of(seen.frame, offset)].outlines.push_back(outline_observation(capture, outline, seen.frame));
    }
    for (std::size_t i = 0; i < seen.points.size(); ++i) {
      const int camera = i < seen.camera.size() ? seen.camera[i] : -1;
      const double offset = camera < 0 ? 0.0 : capture.depth[std::size_t(camera)].time_offset;
      frames[instant_of(seen.frame, offset)].points.push_back(
          {seen.points[i], double(seen.noise[i]), camera < 0 ? cameras : camera, sight_of(capture, seen, i)});
    }
  }
  for (const auto& [frame, points] : tracked.frames) {
    auto& tracks = frames[instant_of(frame, 0.0)].tracks;
    tracks.insert(tracks.end(), points.begin(), points.end());
  }
  std::vector<FrameObservations> from_start;
  for (auto& [instant, seen] : frames) {
    if (instant.first < 0 || instant.first >= timing.frame_count() - timing.start_frame) continue;
    std::tie(seen.frame, seen.after) = instant;
    from_start.push_back(std::move(seen));
  }
  return from_start;
}

}  // namespace pliant
