#include "capture/pixel_scatter.hpp"

#include <algorithm>
#include <cmath>

#include "base/median.hpp"

namespace pliant {

double pixel_scatter(const DepthImage& depth, const Image<PixelKind>& kinds, const PinholeCamera& camera,
                     const DepthNoise& noise) {
  constexpr std::size_t fewest = 50;
  const auto shows_object = [&](int u, int v) { return kinds(u, v) == PixelKind::Object; };
  std::vector<double> squares;  // over the noise's
  const auto add = [&](int u, int v, int du, int dv) {
    if (!shows_object(u - du, v - dv) || !shows_object(u + du, v + dv)) return;
    const double before = depth(u - du, v - dv), here = depth(u, v), after = depth(u + du, v + dv);
    const double pitch = here / (du > 0 ? camera.fx : camera.fy);
    if (std::abs(after - before) > 2.0 * pitch + 4.0 * noise.axial(here)) return;
    squares.push_back(std::pow((before - 2.0 * here + after) / noise.axial(here), 2) / 6.0);
  };
  for (int v = 1; v + 1 < depth.height; ++v)
    for (int u = 1; u + 1 < depth.width; ++u) {
      if (!shows_object(u, v)) continue;
      add(u, v, 1, 0);
      add(u, v, 0, 1);
    }
  if (squares.size() < fewest) return 0.0;
  constexpr double of_median = 0.4549;  // of the square of a normal deviate
  const double rounded = 1e-3;
  const auto middle = squares.begin() + std::ptrdiff_t(squares.size() / 2);
  std::ranges::nth_element(squares, middle);
  const double farthest = 16.0 * (*middle / of_median + rounded);
  double sum = 0.0;
  int count = 0;
  for (const double square : squares)
    if (square <= farthest) sum += square, ++count;
  return std::sqrt(sum / count);
}

std::vector<double> median_scatter(const std::vector<ObservedFrame>& frames, std::size_t cameras) {
  std::vector<double> scatter(cameras, 0.0);
  for (std::size_t c = 0; c < cameras; ++c) {
    std::vector<double> told;
    for (const ObservedFrame& f : frames)
      if (c < f.scatter.size() && f.scatter[c] > 0.0) told.push_back(f.scatter[c]);
    if (!told.empty()) scatter[c] = median(std::move(told));
  }
  return scatter;
}

}  // namespace pliant
