#pragma once

#include "scan/scan_views.hpp"

namespace pliant {

/// The space that one camera leaves to an object: behind its readings and inside its outline, a cone that ends nowhere.
class ViewHull {
 public:
  explicit ViewHull(const ScanView& view);

  /// Negative in that space; near its border about the distance from it [m].
  double value(const Vector3& point) const;
  /// How far [m] a point lies beyond a plausible back: no part is deeper along its ray than 2.5 times the radius of the
  /// largest disc in the outline that covers it there. Negative before it.
  double beyond_back(const Vector3& point) const;
  /// Whether a reading shows the point, up to the reading's noise or `reach` [m], whichever is more.
  bool shows(const Vector3& point, double reach) const;

  const PinholeCamera& camera() const { return camera_; }
  const DepthImage& depth() const { return depth_; }  ///< readings [m], 0 where there is none
  /// Unit normal of the surface at a reading, towards the camera; against the view where neighbours are too few.
  Vector3 normal(int u, int v) const;
  /// Standard deviation of a reading along the normal [m], at least the sensor's own.
  double noise(int u, int v) const;

 private:
  void fill_front();
  void find_widths();

  PinholeCamera camera_;
  DepthNoise noise_;
  DepthImage depth_;
  Image<float> front_;    // depth [m], smooth and continued over the whole image
  Image<float> cosine_;   // of the angle between ray and normal, continued the same way
  Image<float> width_;    // radius of the largest disc in the outline over a pixel [pixels], continued the same way
  Image<float> outside_;  // signed distance from the outline [pixels], negative inside
};

}  // namespace pliant
