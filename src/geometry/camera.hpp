#pragma once

#include "base/types.hpp"

namespace pliant {

/// Rigid motion x -> rotation x + translation.
struct RigidMotion {
  Matrix3 rotation = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();
  Vector3 operator()(const Vector3& point) const { return rotation * point + translation; }
  RigidMotion inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
  bool operator==(const RigidMotion&) const = default;
};

/// Pinhole camera with axes as in OpenCV (x right, y down, z forward); pixel centres at whole numbers.
struct PinholeCamera {
  int width = 0, height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< [pixels]
  RigidMotion camera_to_world;

  bool operator==(const PinholeCamera&) const = default;

  /// World point [m] seen at pixel (u, v) with `depth` [m] along the optical axis.
  Vector3 unproject(double u, double v, double depth) const {
    return camera_to_world(Vector3((u - cx) / fx * depth, (v - cy) / fy * depth, depth));
  }
  /// (u, v, depth) of a world point; depth <= 0 where it lies behind the camera.
  Vector3 project(const Vector3& world) const {
    const Vector3 p = camera_to_world.rotation.transpose() * (world - camera_to_world.translation);
    return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy, p.z()};
  }
};

}  // namespace pliant
