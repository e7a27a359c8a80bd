#include "capture/depth_noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pliant {

namespace {

double structured_light(double depth) { return 0.0012 + 0.0019 * (depth - 0.4) * (depth - 0.4); }

// Nguyen et al. 2012, eq. 2: what grazing incidence adds to it [m].
double grazing(double depth, double incidence) {
  constexpr double steepest = 80.0 / 180.0 * std::numbers::pi;  // the formula diverges at 90 degrees
  const double angle = std::min(incidence, steepest);
  return 0.0001 / std::sqrt(depth) * std::pow(angle / (std::numbers::pi / 2 - angle), 2);
}

const double uniform_deviation = 1.0 / std::sqrt(12.0);  // of a value rounded to whole units

}  // namespace

DepthNoise::DepthNoise(const DepthCamera& camera, double typical)
    : scale_(camera.noise ? *camera.noise / structured_light(typical) : 1.0),
      step_(1.0 / camera.depth_scale),
      focal_(std::min(camera.camera.fx, camera.camera.fy)) {}

double DepthNoise::axial(double depth) const {
  return std::hypot(scale_ * structured_light(depth), uniform_deviation * step_);
}

double DepthNoise::along_normal(double depth, double incidence) const {
  const double lateral = uniform_deviation * depth / focal_ * std::sin(incidence);
  return std::hypot(axial(depth), scale_ * grazing(depth, incidence) * std::cos(incidence), lateral);
}

double DepthNoise::jump(double depth) const { return std::max(6.0 * axial(depth), 4.0 * depth / focal_); }

double typical_depth(const Capture& capture, const PinholeCamera& camera) {
  if (!capture.scene.object.surface) return 1.0;
  const Box box = bounding_box(*capture.scene.object.surface);
  const double depth = camera.project(0.5 * (box.min + box.max)).z();
  return depth > 0.05 ? depth : 1.0;
}

}  // namespace pliant
