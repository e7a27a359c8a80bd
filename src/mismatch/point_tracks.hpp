#pragma once

#include <span>

#include "elasticity/body.hpp"

namespace pliant {

/// Where a followed point of the object was seen.
struct TrackObservation {
  int point = 0;     ///< which of the tracks
  Vector3 position;  ///< [m], world
  double noise;      ///< standard deviation of each coordinate [m], > 0
  int sensor = 0;    ///< whose correction applies
};

/// Points of the object that were followed through time (markers, or nodes of a tracked mesh): the residual is where
/// the simulation has them less where they were seen (Wang 2015, eq. 6).
class PointTracks {
 public:
  /// @param rest  positions on or in the object at rest [m]; those outside every element follow the nearest one
  PointTracks(const Body& body, const std::vector<Vector3>& rest) : points_(body, rest) {}

  int count() const { return points_.point_count(); }
  /// k x 3 [m] for node positions n x 3.
  [[nodiscard]] Points residuals(std::span<const TrackObservation> seen, const Points& positions) const;
  /// Changes of the residuals, k x 3, for a change of the node positions.
  [[nodiscard]] Points tangent(std::span<const TrackObservation> seen, const Points& d_positions) const;
  /// positions_bar (n x 3) += the cotangent for one of the residuals, k x 3.
  void add_adjoint(std::span<const TrackObservation> seen, const Points& residual_bar, Points& positions_bar) const;

 private:
  Embedding points_;
};

}  // namespace pliant
