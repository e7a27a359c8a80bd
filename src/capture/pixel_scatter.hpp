#pragma once

#include <vector>

#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"
#include "capture/observe.hpp"
#include "capture/pixel_kinds.hpp"

namespace pliant {

/// How far the readings of neighbouring pixels scatter about a smooth surface, in standard deviations of `noise`: the
/// root mean square of the second differences d(u-1) - 2 d(u) + d(u+1) over sqrt(6) times the noise, along rows and
/// columns, of pixels that show the object at less than 45 degrees; what stands out by more than four deviations is
/// left out. 1 where the sensor errs as it says, each pixel on its own; less where neighbours err together.
/// 0 where fewer than 50 pixels tell it.
double pixel_scatter(const DepthImage& depth, const Image<PixelKind>& kinds, const PinholeCamera& camera,
                     const DepthNoise& noise);

/// The median over the frames of each depth camera's scatter (`ObservedFrame::scatter`); 0 where none tells it.
std::vector<double> median_scatter(const std::vector<ObservedFrame>& frames, std::size_t cameras);

}  // namespace pliant
