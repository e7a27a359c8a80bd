#pragma once

#include <cstdint>
#include <vector>

#include "capture/image_io.hpp"

namespace pliant {

/// A picture with the outline of its mask drawn over it, made smaller by a whole number of times to `width` pixels at
/// most.
Image<Rgb> outlined(const Image<Rgb>& picture, const Image<std::uint8_t>& mask, int width);

/// Pictures of one size side by side, row by row; one at least.
Image<Rgb> side_by_side(const std::vector<Image<Rgb>>& pictures, int columns);

}  // namespace pliant
