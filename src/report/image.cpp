#include "report/image.hpp"

#include <png.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pliant {

namespace {

// Anchors from -1 to 1 of the "RdBu" scheme of ColorBrewer, blue first.
constexpr std::array<std::array<double, 3>, 9> diverging_anchors{{{33, 102, 172},
                                                                  {67, 147, 195},
                                                                  {146, 197, 222},
                                                                  {209, 229, 240},
                                                                  {247, 247, 247},
                                                                  {253, 219, 199},
                                                                  {244, 165, 130},
                                                                  {214, 96, 77},
                                                                  {178, 24, 43}}};

}  // namespace

std::string encode_png(const Picture& picture) {
  if (picture.width <= 0 || picture.height <= 0 ||
      picture.pixels.size() != size_t(picture.width) * size_t(picture.height))
    throw std::invalid_argument("encode_png: the picture's size does not fit its pixels");
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(picture.width), image.height = png_uint_32(picture.height);
  image.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  std::string bytes;
  if (png_image_write_get_memory_size(image, size, 0, picture.pixels.data(), 0, nullptr)) {
    bytes.resize(size);
    if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.pixels.data(), 0, nullptr)) return bytes;
  }
  throw std::runtime_error(std::string("encode_png: ") + image.message);
}

Rgb diverging_colour(double value) {
  if (std::isnan(value)) return {128, 128, 128};
  const double position = (std::clamp(value, -1.0, 1.0) + 1.0) * 0.5 * (diverging_anchors.size() - 1);
  const size_t below = std::min(size_t(position), diverging_anchors.size() - 2);
  const double t = position - double(below);
  Rgb colour;
  for (int k = 0; k < 3; ++k)
    colour[k] = uint8_t(std::lround((1.0 - t) * diverging_anchors[below][k] + t * diverging_anchors[below + 1][k]));
  return colour;
}

Rgb sequential_colour(double value) {
  // A polynomial of sixth degree in each channel, near Matplotlib's viridis.
  constexpr double k[7][3] = {{0.2777, 0.0054, 0.3340},     {0.1051, 1.4046, 1.3846},   {-0.3309, 0.2148, 0.0951},
                              {-4.6342, -5.7991, -19.3324}, {6.2283, 14.1799, 56.6906}, {4.7764, -13.7451, -65.3530},
                              {-5.4355, 4.6459, 26.3124}};
  if (std::isnan(value)) return {128, 128, 128};
  const double t = std::clamp(value, 0.0, 1.0);
  Rgb colour;
  for (std::size_t c = 0; c < 3; ++c) {
    double sum = 0.0;
    for (int i = 6; i >= 0; --i) sum = sum * t + k[i][c];
    colour[c] = std::uint8_t(std::lround(255.0 * std::clamp(sum, 0.0, 1.0)));
  }
  return colour;
}

std::string css(const Rgb& colour) {
  constexpr char digits[] = "0123456789abcdef";
  std::string text = "#";
  for (const uint8_t c : colour) text += digits[c >> 4], text += digits[c & 15];
  return text;
}

}  // namespace pliant
