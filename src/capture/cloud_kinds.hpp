#pragma once

#include <optional>
#include <vector>

#include "capture/object_space.hpp"
#include "capture/point_tree.hpp"

namespace pliant {

/// Standard deviation of a cloud's points where the capture states none [m]: fused structured-light or time-of-flight
/// sensors at a metre.
inline constexpr double default_cloud_noise = 0.002;

/// Tells the object's points of a cloud from the others; prepared once, used for every frame.
class CloudSorter {
 public:
  /// @param sequence  whose background and noise hold; nothing: that of a load, without background
  /// Throws InputError where the background or the first cloud cannot be read.
  CloudSorter(const Capture& capture, const CloudSequence* sequence, const ObserveOptions& options);

  /// Points that are within reach, neither on a plane or an obstacle nor as in the background cloud, and do not stand
  /// alone
  /// (`isolated_points`). Adds what was left out to `counts`.
  /// @param time  of the recording [s], for obstacles that move
  std::vector<Vector3> sorted(std::vector<Vector3> points, CloudCounts& counts, double time = 0.0) const;

  const std::vector<Plane>& planes() const { return space_.planes(); }

 private:
  /// Of an object that is at rest in the first frame: in another pose a flat side could be taken for a table.
  void find_undeclared_planes(const Capture& capture, const CloudSequence& sequence);

  ObjectSpace space_;
  double noise_, background_reach_ = 0.0;
  std::optional<PointTree> background_;
};

}  // namespace pliant
