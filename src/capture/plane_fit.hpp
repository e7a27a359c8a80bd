#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "base/types.hpp"

namespace pliant {

/// A plane through points that have outliers among them.
struct PlaneFit {
  Vector3 point = Vector3::Zero();    ///< centroid of the points on the plane [m]
  Vector3 normal = Vector3::UnitZ();  ///< unit length; towards `PlaneFitOptions::normal` where that is given
  double rms = 0.0;                   ///< of the distances of the points on the plane [m]
  int inliers = 0;                    ///< points on the plane

  double height(const Vector3& p) const { return normal.dot(p - point); }
};

struct PlaneFitOptions {
  double reach = 3.0;             ///< a point is on the plane if it is nearer than this many of its standard deviations
  int hypotheses = 400;           ///< planes through three random points that are tried
  int sample = 4000;              ///< points on which hypotheses are compared
  std::uint64_t seed = 1;         ///< same seed, same plane
  std::optional<Vector3> normal;  ///< unit length: only planes whose normal is within `greatest_angle` of it
  double greatest_angle = 0.44;   ///< [rad]
};

/// The plane that most points lie on: random hypotheses (Fischler and Bolles 1981), then least squares weighted by
/// 1 / noise^2 on the points it explains, repeated until these no longer change. Where the points scatter less than
/// their noise claims, the reach shrinks with them: what lies flat on a table does not count as table.
/// @param points  [m], n
/// @param noise   standard deviation of each along the plane's normal [m], n
/// @return        nothing for fewer than three points, or where all of them lie on a line
[[nodiscard]] std::optional<PlaneFit> fit_plane(std::span<const Vector3> points, std::span<const float> noise,
                                                const PlaneFitOptions& options = {});

}  // namespace pliant
