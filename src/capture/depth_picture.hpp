#pragma once

#include <span>

#include "capture/depth_frame.hpp"
#include "capture/image_io.hpp"
#include "capture/pixel_kinds.hpp"
#include "capture/segment.hpp"

namespace pliant {

/// A picture of sorted pixels: the object from yellow (near) to violet (far), planes blue, edges red, the rest grey by
/// depth, black without a reading.
Image<Rgb> picture(const DepthImage& depth, const Image<PixelKind>& kinds);

/// A picture of a segmented scene: each object in a colour of its own, planes blue, shaded by the surface's slope.
Image<Rgb> picture(const DepthImage& depth, const Segmentation& scene);

/// A picture of points [m] seen along the direction in which they extend least, the nearest yellow, the farthest
/// violet.
/// @param side  pixels of the picture's longer side
Image<Rgb> picture(std::span<const Vector3> points, int side = 480);

}  // namespace pliant
