#include "imports/mask_overview.hpp"

#include <algorithm>
#include <array>

namespace pliant {

namespace {

constexpr Rgb outline_colour = {255, 0, 200};  // of hardly any object
constexpr int gap = 4;                         // [pixels] between pictures

}  // namespace

Image<Rgb> outlined(const Image<Rgb>& picture, const Image<std::uint8_t>& mask, int width) {
  const int step = std::max(1, (picture.width + width - 1) / width), pixels = step * step;
  Image<Rgb> small(std::max(1, picture.width / step), std::max(1, picture.height / step));
  Image<std::uint8_t> shown(small.width, small.height);
  for (int v = 0; v < small.height; ++v)
    for (int u = 0; u < small.width; ++u) {
      std::array<int, 3> sum{};
      int of_object = 0;
      for (int y = v * step; y < std::min(picture.height, (v + 1) * step); ++y)
        for (int x = u * step; x < std::min(picture.width, (u + 1) * step); ++x) {
          for (std::size_t c = 0; c < 3; ++c) sum[c] += picture(x, y)[c];
          of_object += mask(x, y) != 0;
        }
      for (std::size_t c = 0; c < 3; ++c) small(u, v)[c] = std::uint8_t(sum[c] / pixels);
      shown(u, v) = 2 * of_object > pixels;
    }
  for (int v = 0; v < small.height; ++v)
    for (int u = 0; u < small.width; ++u)
      if (shown(u, v) != shown(std::max(0, u - 1), v) || shown(u, v) != shown(u, std::max(0, v - 1)))
        small(u, v) = outline_colour;
  return small;
}

Image<Rgb> side_by_side(const std::vector<Image<Rgb>>& pictures, int columns) {
  columns = std::min(columns, int(pictures.size()));
  const int rows = (int(pictures.size()) + columns - 1) / columns;
  const int across = pictures.front().width + gap, down = pictures.front().height + gap;
  Image<Rgb> result(columns * across - gap, rows * down - gap, {255, 255, 255});
  for (int k = 0; k < int(pictures.size()); ++k) {
    const Image<Rgb>& picture = pictures[std::size_t(k)];
    for (int v = 0; v < picture.height; ++v)
      for (int u = 0; u < picture.width; ++u) result(k % columns * across + u, k / columns * down + v) = picture(u, v);
  }
  return result;
}

}  // namespace pliant
