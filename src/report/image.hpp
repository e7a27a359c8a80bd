#pragma once

#include <string>

#include "capture/image_io.hpp"

namespace pliant {

/// A colour picture for people.
using Picture = Image<Rgb>;

/// The picture as the bytes of an 8-bit RGB PNG file.
/// Throws std::invalid_argument where the size is not positive or does not fit the pixels.
std::string encode_png(const Picture& picture);

/// Colour of a signed number in [-1, 1] (clamped; grey where it is not a number): blue below zero, near white at zero,
/// red above, of like lightness on both sides and told apart by colour-blind people.
Rgb diverging_colour(double value);

/// Colour of a number in [0, 1] (clamped; grey where it is not a number): from dark violet to yellow, its lightness
/// rising evenly, told apart by colour-blind people.
Rgb sequential_colour(double value);

/// "#rrggbb".
std::string css(const Rgb& colour);

}  // namespace pliant
