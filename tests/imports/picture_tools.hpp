#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "capture/image_io.hpp"

namespace pliant::test {

/// A picture whose pixels are given by their place, with the same normal noise [levels] in all channels of a pixel.
inline Image<Rgb> painted(int width, int height, const std::function<Rgb(int u, int v)>& colour, double noise = 0.0,
                          unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> deviate(0.0, std::max(noise, 1e-9));
  Image<Rgb> picture(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      picture(u, v) = colour(u, v);
      const double shift = noise > 0.0 ? deviate(random) : 0.0;
      for (std::uint8_t& c : picture(u, v)) c = std::uint8_t(std::lround(std::clamp(c + shift, 0.0, 255.0)));
    }
  return picture;
}

/// Pixels that both masks have over those that one of them has.
inline double intersection_over_union(const Image<std::uint8_t>& a, const Image<std::uint8_t>& b) {
  double both = 0.0, either = 0.0;
  for (std::size_t p = 0; p < a.pixels.size(); ++p) {
    both += a.pixels[p] != 0 && b.pixels[p] != 0;
    either += a.pixels[p] != 0 || b.pixels[p] != 0;
  }
  return either > 0.0 ? both / either : 1.0;
}

/// A ring, wider than high, about (x, y): 255 on it.
inline Image<std::uint8_t> ring_mask(int width, int height, double x, double y, double radius) {
  Image<std::uint8_t> mask(width, height);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u)
      if (const double r = std::hypot((u - x) / 1.2, v - y); r < radius && r > 0.45 * radius) mask(u, v) = 255;
  return mask;
}

}  // namespace pliant::test
