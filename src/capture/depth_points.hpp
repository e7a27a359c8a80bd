#pragma once

#include <vector>

#include "capture/capture.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"

namespace pliant {

/// Points of a depth image, in order of its pixels.
struct DepthPoints {
  std::vector<Vector3> points;  ///< [m], world
  std::vector<float> noise;     ///< standard deviation of a reading [m]
  std::vector<int> pixel;       ///< row * width + column
};

/// World points of the pixels with a reading for which `keep(pixel)` holds.
template <class Keep>
DepthPoints points_of(const DepthImage& depth, const PinholeCamera& camera, const DepthNoise& noise, const Keep& keep) {
  DepthPoints result;
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u) {
      const float z = depth(u, v);
      const int pixel = v * depth.width + u;
      if (!(z > 0) || !keep(pixel)) continue;
      result.points.push_back(camera.unproject(u, v, z));
      result.noise.push_back(float(noise.axial(z)));
      result.pixel.push_back(pixel);
    }
  return result;
}

/// Whether a reading belongs to a smooth surface that its neighbours show too: at least four of the eight within the
/// depth jump. False for flying pixels, which sensors invent between a near and a far surface.
bool is_supported(const DepthImage& depth, int u, int v, double jump);

/// Whether a neighbour left, right, above or below reads a depth beyond the jump.
bool is_at_discontinuity(const DepthImage& depth, int u, int v, double jump);

/// Unit normal of the surface around a pixel, towards the camera, world coordinates; from neighbours up to two pixels
/// away. Zero where there are too few.
Vector3 surface_normal(const DepthImage& depth, const PinholeCamera& camera, int u, int v, double jump);

}  // namespace pliant
