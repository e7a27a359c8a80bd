#pragma once

#include <vector>

#include "capture/capture.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"
#include "capture/plane_fit.hpp"

namespace pliant {

/// A connected part of a depth image that lies on no large plane.
struct SceneObject {
  int pixels = 0;
  Vector3 centroid = Vector3::Zero();  ///< of the points seen [m], world
  Box box;                             ///< of the points seen [m], world
  Vector3 extent = Vector3::Zero();    ///< along their own principal axes, the longest first [m]
  bool stands_on_plane = false;        ///< touches the largest plane and rises from it
  double height = 0.0;                 ///< above the largest plane [m]; 0 where there is none
};

/// What a depth image shows when nothing is known of the scene.
struct Segmentation {
  std::vector<PlaneFit> planes;      ///< normals towards the camera; the largest first
  std::vector<SceneObject> objects;  ///< the largest first
  Image<int> label;                  ///< index into `objects`; -1 no reading, -2 - p on plane p, `small` too small
  static constexpr int small = -100;
};

struct SegmentOptions {
  double least_plane = 0.15;  ///< share of the readings that a plane must explain
  int most_planes = 3;
  int least_pixels = 150;  ///< of an object
  double gap = 0.08;       ///< [m] depth jump that one object may have, as between a chin and the belly behind it
};

/// Splits a depth image into large planes and connected objects: pixels up to two apart belong together where their
/// depths differ by less than `gap` and the noise allow. A plane ends where its pixels do: what merely crosses its
/// extension elsewhere is not part of it.
[[nodiscard]] Segmentation segment(const DepthImage& depth, const PinholeCamera& camera, const DepthNoise& noise,
                                   const SegmentOptions& options = {});

}  // namespace pliant
