#pragma once

#include "capture/capture.hpp"

namespace pliant {

/// How far readings of a depth camera scatter.
///
/// The axial noise of a structured-light camera, 0.0012 + 0.0019 (z - 0.4)^2 m (Nguyen, Izadi and Lovell 2012, eq. 1),
/// with its growth at grazing incidence; time-of-flight cameras of that class have a like one. Where the capture
/// states a typical value, the curve is scaled to it at the object's distance.
class DepthNoise {
 public:
  /// @param typical_depth  distance of the object from the camera [m], where `camera.noise` holds
  DepthNoise(const DepthCamera& camera, double typical_depth);

  /// Standard deviation of a reading `depth` [m] of a surface seen head on [m].
  double axial(double depth) const;

  /// Standard deviation of the point along the surface normal [m].
  /// @param incidence  angle between the ray and the surface normal [rad], 0 head on
  /// Never below `axial`: what scatters less along the normal at grazing incidence is biased instead, since a
  /// reading mixes the depths that its pixel covers. The pixel's own width adds to it there.
  double along_normal(double depth, double incidence) const;

  /// Depth difference between neighbouring pixels [m] beyond which they do not show one smooth surface: six standard
  /// deviations, or the slope of a surface seen at 76 degrees.
  double jump(double depth) const;

 private:
  double scale_ = 1.0;
  double step_ = 0.0;   // one raw unit [m]
  double focal_ = 1.0;  // [pixels]
};

/// The distance at which a camera sees the object at rest [m]; 1 m where there is no rest surface.
double typical_depth(const Capture& capture, const PinholeCamera& camera);

}  // namespace pliant
