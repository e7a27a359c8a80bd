#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "capture/capture.hpp"
#include "capture/observe.hpp"

namespace pliant {

/// Standard deviations of a reading within which it counts as one of a plane.
inline constexpr double plane_reach = 3.0;

/// Where the object may be: the rest surface's bounding box grown by `margin` [m] on all sides, and down to where it
/// may fall. Nothing without a rest surface.
std::optional<Box> reachable_box(const Capture& capture, double margin);

/// The part of the world in which readings may be the object's: near it, off the planes and off obstacles. Pixels of
/// depth images and points of clouds are told apart by the same one.
class ObjectSpace {
 public:
  /// Known planes, and those that `find_plane` sees near unknown ones.
  /// Throws InputError where an image or a cloud cannot be read.
  ObjectSpace(const Capture& capture, const ObserveOptions& options);

  bool is_within_reach(const Vector3& point) const;
  /// On a plane, or behind it. @param sigma  standard deviation of the reading [m]
  bool is_on_plane(const Vector3& point, double sigma) const;

  /// On the surface of an obstacle. @param time  of the recording [s], at which obstacles are where they are led
  bool is_on_obstacle(const Vector3& point, double sigma, double time) const;

  /// Takes a plane that nobody declared, seen as these points: a table, where less than 30 % of them lie in the
  /// object's own box, so that a flat side of the object is never taken for it.
  /// @param margin  [m] by which that box is grown, against errors of points on its sides
  void take_undeclared(const Plane& plane, std::span<const Vector3> on_plane, double margin = 0.0);

  const std::vector<Plane>& planes() const { return planes_; }

 private:
  struct SeenObstacle {
    std::function<double(const Vector3&)> distance;  // where its motion is zero [m]
    KeyedMotion motion;
  };
  double plane_margin_;
  std::vector<Plane> planes_;
  std::vector<SeenObstacle> obstacles_;
  std::optional<Box> own_box_, band_;
};

}  // namespace pliant
