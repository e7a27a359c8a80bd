#include "capture/depth_points.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

namespace pliant {

namespace {

bool reads_near(const DepthImage& depth, int u, int v, float z, double jump) {
  return depth.contains(u, v) && depth(u, v) > 0 && std::abs(depth(u, v) - z) <= jump;
}

// Difference of the two farthest points on one smooth surface along a direction; zero where there is none.
Vector3 along(const DepthImage& depth, const PinholeCamera& camera, int u, int v, int du, int dv, double jump) {
  const auto end = [&](int sign) {
    int steps = 0;
    for (; steps < 2; ++steps) {
      const int a = u + sign * steps * du, b = v + sign * steps * dv;
      if (!reads_near(depth, a + sign * du, b + sign * dv, depth(a, b), jump)) break;
    }
    const int a = u + sign * steps * du, b = v + sign * steps * dv;
    return camera.unproject(a, b, depth(a, b));
  };
  return end(1) - end(-1);
}

}  // namespace

bool is_supported(const DepthImage& depth, int u, int v, double jump) {
  constexpr int least = 4;  // a corner of 90 degrees in a silhouette keeps three: lost; a straight edge keeps five
  int count = 0;
  for (int dv = -1; dv <= 1; ++dv)
    for (int du = -1; du <= 1; ++du)
      if ((du != 0 || dv != 0) && reads_near(depth, u + du, v + dv, depth(u, v), jump)) ++count;
  return count >= least;
}

bool is_at_discontinuity(const DepthImage& depth, int u, int v, double jump) {
  for (const auto& [du, dv] : {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
    if (!depth.contains(u + du, v + dv)) continue;
    const float other = depth(u + du, v + dv);
    if (other > 0 && std::abs(other - depth(u, v)) > jump) return true;
  }
  return false;
}

Vector3 surface_normal(const DepthImage& depth, const PinholeCamera& camera, int u, int v, double jump) {
  const Vector3 normal = along(depth, camera, u, v, 1, 0, jump).cross(along(depth, camera, u, v, 0, 1, jump));
  const double length = normal.norm();
  if (!(length > 0)) return Vector3::Zero();
  const Vector3 view = camera.unproject(u, v, depth(u, v)) - camera.camera_to_world.translation;
  return normal.dot(view) > 0 ? Vector3(-normal / length) : Vector3(normal / length);
}

}  // namespace pliant
