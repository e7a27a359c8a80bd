#include "scan/view_hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/depth_points.hpp"

namespace pliant {

namespace {

constexpr float far_away = 1e6f;  // squared pixels

// Squared distance to the nearest zero of one row (Felzenszwalb and Huttenlocher 2012): the lower envelope of
// parabolas.
void squared_distances(std::vector<float>& row) {
  const int n = int(row.size());
  std::vector<int> place(row.size(), 0);
  std::vector<float> from(row.size() + 1);
  int last = 0;
  from[0] = -std::numeric_limits<float>::infinity(), from[1] = std::numeric_limits<float>::infinity();
  const auto crossing = [&](int q, int p) {
    return (row[std::size_t(q)] + float(q * q) - row[std::size_t(p)] - float(p * p)) / float(2 * (q - p));
  };
  for (int q = 1; q < n; ++q) {
    float s = crossing(q, place[std::size_t(last)]);
    while (s <= from[std::size_t(last)]) s = crossing(q, place[std::size_t(--last)]);
    place[std::size_t(++last)] = q;
    from[std::size_t(last)] = s, from[std::size_t(last) + 1] = std::numeric_limits<float>::infinity();
  }
  std::vector<float> result(row.size());
  for (int q = 0, k = 0; q < n; ++q) {
    while (from[std::size_t(k) + 1] < float(q)) ++k;
    const int p = place[std::size_t(k)];
    result[std::size_t(q)] = float((q - p) * (q - p)) + row[std::size_t(p)];
  }
  row = std::move(result);
}

// Distance [pixels] of each pixel to the nearest one for which `is_target(value)` holds.
template <class Target>
Image<float> distance_to(const Image<std::uint8_t>& image, const Target& is_target) {
  Image<float> result(image.width, image.height);
  for (std::size_t p = 0; p < result.pixels.size(); ++p)
    result.pixels[p] = is_target(image.pixels[p]) ? 0.0f : far_away;
  std::vector<float> line;
  for (int v = 0; v < image.height; ++v) {
    line.assign(&result(0, v), &result(0, v) + image.width);
    squared_distances(line);
    std::ranges::copy(line, &result(0, v));
  }
  for (int u = 0; u < image.width; ++u) {
    line.resize(std::size_t(image.height));
    for (int v = 0; v < image.height; ++v) line[std::size_t(v)] = result(u, v);
    squared_distances(line);
    for (int v = 0; v < image.height; ++v) result(u, v) = std::sqrt(line[std::size_t(v)]);
  }
  return result;
}

// The outline runs halfway between pixel centres inside and outside.
Image<float> signed_outline(const Image<std::uint8_t>& silhouette) {
  const Image<float> outside = distance_to(silhouette, [](std::uint8_t m) { return m != 0; });
  const Image<float> inside = distance_to(silhouette, [](std::uint8_t m) { return m == 0; });
  Image<float> result(silhouette.width, silhouette.height);
  for (std::size_t p = 0; p < result.pixels.size(); ++p)
    result.pixels[p] = silhouette.pixels[p] != 0 ? 0.5f - inside.pixels[p] : outside.pixels[p] - 0.5f;
  return result;
}

// A mean over 5 x 5 pixels without those beyond a jump in depth.
DepthImage smooth(const DepthImage& depth, const DepthNoise& noise) {
  constexpr std::array<double, 3> weight{1.0, 0.7, 0.25};
  DepthImage result(depth.width, depth.height);
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u) {
      const float z = depth(u, v);
      if (!(z > 0)) continue;
      double sum = 0.0, total = 0.0;
      for (int dv = -2; dv <= 2; ++dv)
        for (int du = -2; du <= 2; ++du) {
          // In opposite pairs: a slope that ends at an edge is not flattened.
          if (!depth.contains(u + du, v + dv) || !depth.contains(u - du, v - dv)) continue;
          const float a = depth(u + du, v + dv), b = depth(u - du, v - dv);
          if (!(a > 0) || !(b > 0) || std::abs(a - z) > noise.jump(z) || std::abs(b - z) > noise.jump(z)) continue;
          const double w = weight[std::size_t(std::abs(du))] * weight[std::size_t(std::abs(dv))];
          sum += w * a, total += w;
        }
      result(u, v) = float(sum / total);
    }
  return result;
}

// Continues an image over the outline and a little beyond it, ring by ring, by the mean of the neighbours that have
// one.
void continue_outwards(Image<float>& image, const Image<float>& outside) {
  constexpr float beyond = 3.0f;  // [pixels]
  std::vector<std::pair<int, float>> ring;
  do {
    ring.clear();
    for (int v = 0; v < image.height; ++v)
      for (int u = 0; u < image.width; ++u) {
        if (image(u, v) > 0 || outside(u, v) > beyond) continue;
        float sum = 0.0f;
        int count = 0;
        for (int dv = -1; dv <= 1; ++dv)
          for (int du = -1; du <= 1; ++du)
            if (image.contains(u + du, v + dv) && image(u + du, v + dv) > 0) sum += image(u + du, v + dv), ++count;
        if (count > 0) ring.emplace_back(v * image.width + u, sum / float(count));
      }
    for (const auto& [p, value] : ring) image.pixels[std::size_t(p)] = value;
  } while (!ring.empty());
}

double bilinear(const Image<float>& image, double u, double v) {
  u = std::clamp(u, 0.0, double(image.width - 1)), v = std::clamp(v, 0.0, double(image.height - 1));
  const int a = std::min(int(u), image.width - 2), b = std::min(int(v), image.height - 2);
  const double s = u - a, t = v - b;
  return (1 - t) * ((1 - s) * image(a, b) + s * image(a + 1, b)) +
         t * ((1 - s) * image(a, b + 1) + s * image(a + 1, b + 1));
}

}  // namespace

ViewHull::ViewHull(const ScanView& view)
    : camera_(view.camera), noise_(view.noise), depth_(view.depth), outside_(signed_outline(view.silhouette)) {
  fill_front();
  find_widths();
}

void ViewHull::fill_front() {
  constexpr double least_cosine = 0.2;  // beyond about 78 degrees a normal is mostly noise
  front_ = smooth(depth_, noise_);
  cosine_ = Image<float>(depth_.width, depth_.height);
  for (int v = 0; v < depth_.height; ++v)
    for (int u = 0; u < depth_.width; ++u) {
      if (!(depth_(u, v) > 0)) continue;
      const Vector3 ray = (camera_.unproject(u, v, 1.0) - camera_.camera_to_world.translation).normalized();
      cosine_(u, v) = float(std::max(least_cosine, -normal(u, v).dot(ray)));
    }
  continue_outwards(front_, outside_);
  continue_outwards(cosine_, outside_);
}

void ViewHull::find_widths() {
  width_ = Image<float>(depth_.width, depth_.height);
  for (int v = 0; v < depth_.height; ++v)
    for (int u = 0; u < depth_.width; ++u) {
      const float radius = -outside_(u, v);
      if (!(radius > 0)) continue;
      const int reach = int(radius);
      for (int b = std::max(0, v - reach); b <= std::min(depth_.height - 1, v + reach); ++b)
        for (int a = std::max(0, u - reach); a <= std::min(depth_.width - 1, u + reach); ++a)
          if (float((a - u) * (a - u) + (b - v) * (b - v)) <= radius * radius && width_(a, b) < radius)
            width_(a, b) = radius;
    }
  continue_outwards(width_, outside_);
}

double ViewHull::beyond_back(const Vector3& point) const {
  constexpr double deepest = 2.5;  // radii
  const Vector3 pixel = camera_.project(point);
  const double front = bilinear(front_, pixel.x(), pixel.y()), width = bilinear(width_, pixel.x(), pixel.y());
  return pixel.z() - front - deepest * width * front / std::min(camera_.fx, camera_.fy);
}

Vector3 ViewHull::normal(int u, int v) const {
  const Vector3 own = surface_normal(front_, camera_, u, v, noise_.jump(depth_(u, v)));
  if (!own.isZero()) return own;
  return -(camera_.unproject(u, v, 1.0) - camera_.camera_to_world.translation).normalized();
}

double ViewHull::noise(int u, int v) const { return noise_.axial(depth_(u, v)); }

double ViewHull::value(const Vector3& point) const {
  const Vector3 pixel = camera_.project(point);
  if (!(pixel.z() > 0.0)) return std::numeric_limits<double>::max();
  const double front = bilinear(front_, pixel.x(), pixel.y());
  const double behind = (front - pixel.z()) * bilinear(cosine_, pixel.x(), pixel.y());
  const double focal = std::min(camera_.fx, camera_.fy);
  double outside = bilinear(outside_, pixel.x(), pixel.y());
  const double beyond =
      std::max({0.0, -pixel.x(), -pixel.y(), pixel.x() - (camera_.width - 1), pixel.y() - (camera_.height - 1)});
  if (beyond > 0.0) outside = std::max(outside, 0.0) + beyond;
  return std::max(behind, outside * pixel.z() / focal);
}

bool ViewHull::shows(const Vector3& point, double reach) const {
  const Vector3 pixel = camera_.project(point);
  const int u = int(std::lround(pixel.x())), v = int(std::lround(pixel.y()));
  if (!(pixel.z() > 0.0) || !depth_.contains(u, v) || !(depth_(u, v) > 0)) return false;
  const double gap = (bilinear(front_, pixel.x(), pixel.y()) - pixel.z()) * cosine_(u, v);
  return std::abs(gap) < std::max(reach, 3.0 * noise(u, v));
}

}  // namespace pliant
