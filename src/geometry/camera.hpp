#pragma once

#include "base/types.hpp"
#include "geometry/lens.hpp"

namespace pliant {

/// Rigid motion x -> rotation x + translation.
struct RigidMotion {
  Matrix3 rotation = Matrix3::Identity();
  Vector3 translation = Vector3::Zero();
  Vector3 operator()(const Vector3& point) const { return rotation * point + translation; }
  RigidMotion inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
  bool operator==(const RigidMotion&) const = default;
};

/// Camera with axes as in OpenCV (x right, y down, z forward), a pinhole where its lens does not bend; pixel centres at
/// whole numbers.
struct PinholeCamera {
  int width = 0, height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;  ///< [pixels]
  RigidMotion camera_to_world;
  LensDistortion lens = {};

  bool operator==(const PinholeCamera&) const = default;

  /// Ray through pixel (u, v), in the camera's axes, of depth 1; not a number where no ray comes out there.
  Vector3 ray(double u, double v) const {
    const Vector2 seen((u - cx) / fx, (v - cy) / fy);
    return (lens.bends() ? lens.straight(seen) : seen).homogeneous();
  }
  /// World point [m] seen at pixel (u, v) with `depth` [m] along the optical axis.
  Vector3 unproject(double u, double v, double depth) const { return camera_to_world(ray(u, v) * depth); }
  /// (u, v, depth) of a world point; depth <= 0 where it lies behind the camera.
  Vector3 project(const Vector3& world) const {
    const Vector3 p = camera_to_world.rotation.transpose() * (world - camera_to_world.translation);
    if (!lens.bends() || !(p.z() > 0.0)) return {fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy, p.z()};
    const Vector2 seen = lens.distorted(p.hnormalized());
    return {fx * seen.x() + cx, fy * seen.y() + cy, p.z()};
  }
};

}  // namespace pliant
