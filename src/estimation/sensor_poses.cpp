#include "estimation/sensor_poses.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "capture/find_plane.hpp"
#include "estimation/judgement.hpp"
#include "estimation/problem.hpp"

namespace pliant {

namespace {

/// A capture with one of its sensors alone.
Capture with_one_sensor(Capture capture, std::size_t sensor) {
  if (sensor >= capture.depth.size()) {
    capture.depth.clear();
    return capture;
  }
  capture.depth = {capture.depth[sensor]};
  capture.clouds.clear();
  return capture;
}

bool is_where_known(const Plane& known, const PlaneObservation& seen, const PoseStd& pose) {
  const double tilt = std::acos(std::clamp(known.normal.dot(seen.normal), -1.0, 1.0));
  const double height = std::abs(known.normal.dot(seen.point - known.point));
  return tilt < judgement.plane_deviations * std::hypot(pose.turn, seen.tilt_std) &&
         height < judgement.plane_deviations * std::hypot(pose.shift, seen.height_std);
}

using Motion6 = Eigen::Matrix<double, 6, 1>;

/// The rigid motion that one Gauss-Newton step brings a frame's points by: turn over the object's half size, shift [m];
/// nothing where too few are seen.
std::optional<Motion6> step_onto_scan(const ObservedFrame& frame, const SignedDistance& distance, const Vector3& middle,
                                      double size) {
  constexpr int fewest = 50;
  constexpr double outlier = 0.04;  // times the size
  constexpr double little = 1e-3;   // of the mean curvature: what the shape leaves open stays
  if (int(frame.points.size()) < fewest) return std::nullopt;
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Motion6 b = Motion6::Zero();
  const double c2 = std::pow(outlier * size, 2);
  for (const Vector3& p : frame.points) {
    const SignedDistance::Sample s = distance.sample(p);
    const double w = std::pow(c2 / (c2 + s.value * s.value), 2);
    Motion6 row;
    row << (p - middle).cross(s.gradient) / (0.5 * size), s.gradient;
    A += w * row * row.transpose(), b -= w * s.value * row;
  }
  A.diagonal().array() += little * A.trace() / 6.0;
  return Motion6(A.ldlt().solve(b));
}

}  // namespace

std::vector<PoseStd> pose_stds(const Capture& capture) {
  std::vector<PoseStd> all;
  for (const DepthCamera& camera : capture.depth) all.push_back(camera.pose_std);
  if (!capture.clouds.empty()) {
    PoseStd of_clouds{0.0, 0.0};
    for (const CloudSequence& cloud : capture.clouds)
      if (cloud.pose_std) {
        of_clouds.turn = std::max(of_clouds.turn, cloud.pose_std->turn);
        of_clouds.shift = std::max(of_clouds.shift, cloud.pose_std->shift);
      }
    all.push_back(of_clouds);
  }
  for (const SilhouetteCamera& camera : capture.silhouettes) all.push_back(camera.pose_std);
  all.resize(sensor_names(capture).size(), {0.0, 0.0});  // markers' poses are those of their system
  return all;
}

bool estimates_sensors(const Capture& capture) {
  return std::ranges::any_of(pose_stds(capture),
                             [](const PoseStd& std) { return std.turn > 0.0 || std.shift > 0.0; }) ||
         std::ranges::any_of(capture.depth,
                             [](const DepthCamera& camera) {
                               return camera.range_std.value_or(0.0) > 0.0 || camera.range_scale_std > 0.0 ||
                                      camera.focal_std > 0.0;
                             }) ||
         std::ranges::any_of(capture.silhouettes,
                             [](const SilhouetteCamera& camera) { return camera.outline_error_std > 0.0; });
}

bool starts_as_scanned(const Scene& scene) {
  return !scene.timing.is_static && !scene.initial.released && scene.object.shape_is != ShapeIs::Static;
}

std::vector<PlaneObservation> planes_seen(const Capture& capture, std::vector<std::string>& notes) {
  const std::vector<PoseStd> stds = pose_stds(capture);
  const std::size_t sensors = capture.depth.size() + (capture.clouds.empty() ? 0 : 1);
  std::vector<PlaneObservation> all;
  for (int i = 0; i < int(capture.scene.planes.size()); ++i)
    for (std::size_t k = 0; k < sensors; ++k) {
      const Plane& plane = capture.scene.planes[std::size_t(i)];
      const auto found = find_plane(with_one_sensor(capture, k), plane);
      if (!found) continue;
      PlaneObservation seen;
      seen.plane = i, seen.sensor = int(k);
      seen.point = found->point, seen.normal = found->normal;
      if (k < capture.depth.size()) {
        const PinholeCamera& camera = capture.depth[k].camera;
        const Vector3 axis = camera.camera_to_world.rotation.col(2);
        seen.sight = sight_of(camera, seen.point);
        seen.normal_off_axis = seen.normal - axis.dot(seen.normal) * axis;
      }
      seen.tilt_std = seen_plane_std, seen.height_std = seen_plane_std * object_size(capture.scene);
      if (plane.known && !is_where_known(plane, seen, stds[k])) {
        notes.push_back(fmt::format(
            "{} sees a plane {:.1f} degrees and {:.0f} mm from where plane {} is known to be, further than its pose "
            "may "
            "err: it is not taken for that plane. If it is that plane, `pose_std` or the plane's place is wrong.",
            sensor_names(capture)[k],
            std::acos(std::clamp(plane.normal.dot(seen.normal), -1.0, 1.0)) * 180.0 / std::numbers::pi,
            1e3 * std::abs(plane.normal.dot(seen.point - plane.point)), i + 1));
        continue;
      }
      all.push_back(seen);
    }
  return all;
}

int first_frame_at_rest(const Capture& capture, const std::vector<ObservedFrame>& observed,
                        const SignedDistance& distance) {
  constexpr double still = 0.5e-3;  // [m] of the object's ends, beside what noise moves them by
  constexpr double of_noise = 4.0;  // deviations of a frame's pose
  const int start = capture.scene.timing.start_frame;
  const Box box = bounding_box(*capture.scene.object.surface);
  const Vector3 middle = 0.5 * (box.min + box.max);
  const double size = object_size(capture.scene);
  const auto frame_of = [&](int number) { return std::ranges::find(observed, number, &ObservedFrame::frame); };
  const auto at_start = frame_of(start);
  const auto there = at_start == observed.end() ? std::nullopt : step_onto_scan(*at_start, distance, middle, size);
  if (!there) return start;
  double squares = 0.0;
  for (const float noise : at_start->noise) squares += double(noise) * double(noise);
  const double noise = std::sqrt(squares / double(at_start->noise.size()) /
                                 std::min(ObjectiveOptions{}.independent_points, double(at_start->noise.size())));
  int first = start;
  while (first > 0) {
    const auto before = frame_of(first - 1);
    if (before == observed.end()) break;
    const auto step = step_onto_scan(*before, distance, middle, size);
    if (!step) break;
    const Motion6 moved = *step - *there;
    if (std::max(moved.head<3>().norm(), moved.tail<3>().norm()) > still + of_noise * noise) break;
    --first;
  }
  return first;
}

}  // namespace pliant
