#include "capture/find_plane.hpp"

#include <algorithm>
#include <cmath>

#include "capture/cloud_kinds.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"
#include "capture/depth_points.hpp"
#include "capture/plane_fit.hpp"
#include "capture/point_cloud.hpp"

namespace pliant {

namespace {

constexpr int least_plane_pixels = 300;
constexpr double least_share = 0.1;     // of the readings in the region around the guess
constexpr double farthest_guess = 0.1;  // [m] of the guess's point from a plane that can be meant
constexpr int most_frames = 3;          // looked at where there is no background image

// A guess may be wrong by a few centimetres, and by degrees that matter more the farther away.
bool is_near(const Plane& guess, const Vector3& point) {
  const Vector3 arm = point - guess.point;
  const double height = guess.normal.dot(arm);
  return std::abs(height) < 0.05 + 0.3 * (arm - height * guess.normal).norm();
}

void append_near(DepthPoints& all, const DepthPoints& some, const Plane& guess) {
  for (std::size_t i = 0; i < some.points.size(); ++i) {
    if (!is_near(guess, some.points[i])) continue;
    all.points.push_back(some.points[i]);
    all.noise.push_back(some.noise[i]);
  }
}

void append_camera(DepthPoints& all, const Capture& capture, const DepthCamera& camera, const Plane& guess) {
  const DepthNoise noise(camera, typical_depth(capture, camera.camera));
  if (const auto background = read_background(camera)) {
    append_near(all, points_of(*background, camera.camera, noise, [](int) { return true; }), guess);
    return;
  }
  for (int i = 0, frame = 0; i < most_frames && frame < capture.frame_count(); ++i, frame += camera.every) {
    const auto mask = read_object_mask(capture, camera, frame);
    const auto is_scene = [&](int pixel) { return !mask || mask->pixels[std::size_t(pixel)] == 0; };
    append_near(all, points_of(read_depth(capture, camera, frame), camera.at(frame), noise, is_scene), guess);
  }
}

void append_cloud(DepthPoints& all, const CloudSequence& cloud, const Plane& guess) {
  if (!cloud.background) return;  // nothing tells a flat side of the object from a plane
  DepthPoints points;
  points.points = read_points(*cloud.background);
  points.noise.assign(points.points.size(), float(cloud.noise.value_or(default_cloud_noise)));
  append_near(all, points, guess);
}

}  // namespace

std::optional<FoundPlane> find_plane(const Capture& capture, const Plane& guess) {
  DepthPoints readings;
  for (const DepthCamera& camera : capture.depth) append_camera(readings, capture, camera, guess);
  for (const CloudSequence& cloud : capture.clouds) append_cloud(readings, cloud, guess);
  PlaneFitOptions options;
  options.normal = guess.normal;
  const auto fit = fit_plane(readings.points, readings.noise, options);
  if (!fit || fit->inliers < std::max<double>(least_plane_pixels, least_share * double(readings.points.size())))
    return std::nullopt;
  if (std::abs(fit->height(guess.point)) > farthest_guess) return std::nullopt;
  FoundPlane plane;
  plane.normal = fit->normal;
  plane.point = guess.point - fit->height(guess.point) * fit->normal;
  plane.rms = fit->rms;
  plane.pixels = fit->inliers;
  return plane;
}

}  // namespace pliant
