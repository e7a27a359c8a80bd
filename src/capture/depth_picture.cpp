#include "capture/depth_picture.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace pliant {

namespace {

constexpr Rgb black = {0, 0, 0}, red = {230, 40, 40};
constexpr double blue[3] = {70, 130, 200}, grey[3] = {150, 150, 150};

// Viridis at eight points, the last one first.
constexpr double ramp[8][3] = {{253, 231, 37}, {160, 218, 57}, {74, 193, 109}, {31, 161, 135},
                               {39, 127, 142}, {54, 92, 141},  {70, 50, 126},  {68, 1, 84}};

// Colours that are told apart by most people (Okabe and Ito 2008), without the blue of planes and the red of edges.
constexpr double distinct[6][3] = {{240, 228, 66},  {0, 190, 130},   {230, 159, 0},
                                   {220, 140, 190}, {150, 230, 240}, {190, 120, 70}};

std::uint8_t channel(double value) { return std::uint8_t(std::clamp(value, 0.0, 255.0)); }

Rgb shaded(const double (&colour)[3], double light) {
  return {channel(colour[0] * light), channel(colour[1] * light), channel(colour[2] * light)};
}

Rgb ramp_at(double fraction) {
  const double at = std::clamp(fraction, 0.0, 1.0) * 7.0;
  const int below = std::min(6, int(at));
  const double t = at - below;
  Rgb colour;
  for (std::size_t c = 0; c < 3; ++c) colour[c] = channel((1 - t) * ramp[below][c] + t * ramp[below + 1][c]);
  return colour;
}

struct Range {
  double nearest = 0.0, farthest = 1.0;
  double fraction(double z) const { return farthest > nearest ? (z - nearest) / (farthest - nearest) : 0.0; }
};

// From the 2nd to the 98th percentile, so that a few stray readings do not flatten the picture.
template <class Keep>
Range depth_range(const DepthImage& depth, const Keep& keep) {
  std::vector<float> kept;
  for (std::size_t i = 0; i < depth.pixels.size(); ++i)
    if (depth.pixels[i] > 0 && keep(i)) kept.push_back(depth.pixels[i]);
  if (kept.empty()) return {};
  std::ranges::sort(kept);
  return {kept[kept.size() / 50], kept[kept.size() - 1 - kept.size() / 50]};
}

// Lighter where the surface falls away to the right and below, as if lit from the upper left.
double slope_light(const DepthImage& depth, int u, int v) {
  const float z = depth(u, v);
  const auto step = [&](int du, int dv) {
    if (!depth.contains(u + du, v + dv) || !depth.contains(u - du, v - dv)) return 0.0;
    const float ahead = depth(u + du, v + dv), behind = depth(u - du, v - dv);
    return ahead > 0 && behind > 0 ? double(ahead - behind) / double(z) : 0.0;
  };
  return 0.8 + std::clamp(12.0 * (step(2, 0) + step(0, 2)), -0.4, 0.2);
}

}  // namespace

Image<Rgb> picture(const DepthImage& depth, const Image<PixelKind>& kinds) {
  const Range scene = depth_range(depth, [](std::size_t) { return true; });
  const Range object = depth_range(depth, [&](std::size_t i) { return kinds.pixels[i] == PixelKind::Object; });
  Image<Rgb> image(depth.width, depth.height, black);
  for (std::size_t i = 0; i < depth.pixels.size(); ++i) {
    const double light = 1.0 - 0.7 * std::clamp(scene.fraction(depth.pixels[i]), 0.0, 1.0);
    switch (kinds.pixels[i]) {
      case PixelKind::NoReading:
        break;
      case PixelKind::Object:
        image.pixels[i] = ramp_at(object.fraction(depth.pixels[i]));
        break;
      case PixelKind::OnPlane:
        image.pixels[i] = shaded(blue, light);
        break;
      case PixelKind::AtEdge:
        image.pixels[i] = red;
        break;
      case PixelKind::Elsewhere:
        image.pixels[i] = shaded(grey, light);
        break;
    }
  }
  return image;
}

Image<Rgb> picture(const DepthImage& depth, const Segmentation& scene) {
  Image<Rgb> image(depth.width, depth.height, black);
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u) {
      const int label = scene.label(u, v);
      if (!(depth(u, v) > 0)) continue;
      const double light = slope_light(depth, u, v);
      if (label >= 0)
        image(u, v) = shaded(distinct[label % 6], light);
      else if (label == Segmentation::small)
        image(u, v) = red;
      else
        image(u, v) = shaded(blue, light * (label == -2 ? 1.0 : 0.6));
    }
  return image;
}

Image<Rgb> picture(std::span<const Vector3> points, int side) {
  if (points.empty()) return Image<Rgb>(side, side, black);
  Vector3 mean = Vector3::Zero();
  for (const Vector3& point : points) mean += point / double(points.size());
  Matrix3 moment = Matrix3::Zero();
  for (const Vector3& point : points) moment += (point - mean) * (point - mean).transpose();
  const Matrix3 axes = Eigen::SelfAdjointEigenSolver<Matrix3>(moment).eigenvectors();  // the least extent first
  Box box;
  for (const Vector3& point : points) box.extend(axes.transpose() * (point - mean));
  const double scale = (side - 20) / std::max(box.extent().z(), 1e-9);
  Image<Rgb> image(side, int(scale * box.extent().y()) + 21, black);
  Image<float> nearest(image.width, image.height, 2.0f);
  for (const Vector3& point : points) {
    const Vector3 own = axes.transpose() * (point - mean) - box.min;
    const double depth = own.x() / std::max(box.extent().x(), 1e-9);
    for (int dv = 0; dv < 2; ++dv)
      for (int du = 0; du < 2; ++du) {
        const int u = 10 + du + int(scale * own.z()), v = 10 + dv + int(scale * own.y());
        if (!image.contains(u, v) || float(depth) >= nearest(u, v)) continue;
        nearest(u, v) = float(depth);
        image(u, v) = ramp_at(depth);
      }
  }
  return image;
}

}  // namespace pliant
