#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"
#include "capture/pixel_kinds.hpp"

namespace pliant {

/// A ball of known size in one depth image.
struct BallSight {
  Vector3 centre = Vector3::Zero();  ///< [m], in the camera's axes
  double noise = 0.0;                ///< standard deviation of a coordinate of the centre [m]
  double rms = 0.0;                  ///< of its readings' distances from the sphere [m]
  std::vector<Vector3> pixels;       ///< (u, v, depth [m]) of its readings
};

/// Centre of a sphere of known radius through pixels of a camera: least squares of (|p - c| - r), with Tukey's weights.
/// @param centre  [m], in the camera's axes, where to begin
/// @param scale   [m] of the weights
Vector3 ball_centre(const std::vector<Vector3>& pixels, const PinholeCamera& camera, double radius, Vector3 centre,
                    double scale);

/// Looks for a ball among the pixels that may be an object's: random hypotheses from a pixel and its normal, then least
/// squares. Nothing where fewer than 60 readings lie on such a sphere, or they show less than a cap of it.
std::optional<BallSight> find_ball(const DepthImage& depth, const Image<PixelKind>& kinds, const PinholeCamera& camera,
                                   const DepthNoise& noise, double radius, std::uint64_t seed = 1);

}  // namespace pliant
