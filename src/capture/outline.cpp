#include "capture/outline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace pliant {

namespace {

constexpr std::size_t half_window = 4;      // edges of pixels on either side that tell a normal
constexpr std::size_t shortest_curve = 12;  // edges of pixels
constexpr double smallest_hole = 0.01;      // over the object's pixels

/// The edge between a pixel of the object and its neighbour in one of four directions, which is none.
struct PixelEdge {
  int u, v, direction;
};

constexpr int step_u[] = {1, 0, -1, 0}, step_v[] = {0, 1, 0, -1};

class Tracer {
 public:
  explicit Tracer(const Image<std::uint8_t>& mask) : mask_(mask), visited_(mask.width, mask.height) {}

  /// The closed curve from an edge on, the object on one side; empty where it was followed before.
  std::vector<PixelEdge> curve_from(PixelEdge edge) {
    std::vector<PixelEdge> curve;
    while (!was_visited(edge)) {
      visited_(edge.u, edge.v) |= std::uint8_t(1u << edge.direction);
      curve.push_back(edge);
      edge = next(edge);
    }
    return curve;
  }
  bool is_edge(const PixelEdge& e) const {
    return shows_object(e.u, e.v) && !shows_object(e.u + step_u[e.direction], e.v + step_v[e.direction]);
  }
  bool is_at_border(const PixelEdge& e) const {
    return !mask_.contains(e.u + step_u[e.direction], e.v + step_v[e.direction]);
  }

 private:
  bool shows_object(int u, int v) const { return mask_.contains(u, v) && mask_(u, v) != 0; }
  bool was_visited(const PixelEdge& e) const { return (visited_(e.u, e.v) >> e.direction & 1) != 0; }
  PixelEdge next(const PixelEdge& e) const {
    const int along = (e.direction + 1) % 4, back = (e.direction + 3) % 4;
    const int u = e.u + step_u[along], v = e.v + step_v[along];
    const int outer_u = u + step_u[e.direction], outer_v = v + step_v[e.direction];
    if (shows_object(outer_u, outer_v)) return {outer_u, outer_v, back};
    if (shows_object(u, v)) return {u, v, e.direction};
    return {e.u, e.v, along};
  }

  const Image<std::uint8_t>& mask_;
  Image<std::uint8_t> visited_;  // a bit for each direction
};

/// Not zero where a pixel or one of its eight neighbours shows the object; with `shown` false where one does not.
Image<std::uint8_t> near(Image<std::uint8_t> image, bool shown) {
  for (std::uint8_t& pixel : image.pixels) pixel = (pixel != 0) == shown ? 1 : 0;
  for (const auto& [du, dv] : {std::array{1, 0}, std::array{0, 1}}) {
    const Image<std::uint8_t> before = image;
    for (int v = 0; v < image.height; ++v)
      for (int u = 0; u < image.width; ++u) {
        if (before.contains(u - du, v - dv)) image(u, v) |= before(u - du, v - dv);
        if (before.contains(u + du, v + dv)) image(u, v) |= before(u + du, v + dv);
      }
  }
  return image;
}

/// The mask with gaps of up to two pixels closed (morphological closing by 3 x 3 pixels): where a sensor has no
/// reading, next to edges of what lies nearer, the object goes on.
Image<std::uint8_t> closed(const Image<std::uint8_t>& mask) {
  Image<std::uint8_t> result = near(near(mask, true), false);
  for (std::uint8_t& pixel : result.pixels) pixel = pixel != 0 ? 0 : 1;
  return result;
}

/// Pixels within a closed curve; negative where the object lies around it.
double area_within(const std::vector<PixelEdge>& curve) {
  // Row by row: each edge at the right of the object counts the pixels to its left, each at the left takes them off.
  double area = 0.0;
  for (const PixelEdge& e : curve) area += step_u[e.direction] * (e.u + 0.5 * step_u[e.direction]);
  return area;
}

Vector2 middle_of(const PixelEdge& e) { return {e.u + 0.5 * step_u[e.direction], e.v + 0.5 * step_v[e.direction]}; }

}  // namespace

Outline outline_of(const Image<std::uint8_t>& mask, const PinholeCamera& camera) {
  const Image<std::uint8_t> whole = closed(mask);
  Outline outline;
  Tracer tracer(whole);
  const auto shown = std::ranges::count_if(whole.pixels, [](std::uint8_t value) { return value != 0; });
  const auto straightened = [&](const Vector2& seen) {
    const Vector3 ray = camera.ray(seen.x(), seen.y());
    return Vector2(camera.fx * ray.x() + camera.cx, camera.fy * ray.y() + camera.cy);
  };
  const auto add_curve = [&](const std::vector<PixelEdge>& curve) {
    const std::size_t n = curve.size();
    for (const PixelEdge& edge : curve) outline.is_cut = outline.is_cut || tracer.is_at_border(edge);
    if (n < shortest_curve || (area_within(curve) < 0.0 && -area_within(curve) < smallest_hole * double(shown))) return;
    for (std::size_t i = 0; i < n; ++i) {
      bool is_at_border = false;
      for (std::size_t k = 0; k <= 2 * half_window; ++k)
        is_at_border = is_at_border || tracer.is_at_border(curve[(i + n - half_window + k) % n]);
      if (is_at_border) continue;
      const Vector2 along = straightened(middle_of(curve[(i + half_window) % n])) -
                            straightened(middle_of(curve[(i + n - half_window) % n]));
      const Vector2 point = straightened(middle_of(curve[i]));
      if (!(along.norm() > 0.0) || !point.allFinite()) continue;
      outline.points.push_back(point);
      outline.normals.push_back(Vector2(along.y(), -along.x()).normalized());
    }
  };
  for (int v = 0; v < mask.height; ++v)
    for (int u = 0; u < mask.width; ++u)
      for (int direction = 0; direction < 4; ++direction)
        if (const PixelEdge edge{u, v, direction}; tracer.is_edge(edge)) add_curve(tracer.curve_from(edge));
  return outline;
}

double pixel_size(const Capture& capture, const SilhouetteCamera& camera, int frame) {
  if (!capture.scene.object.surface) throw std::invalid_argument("pixel_size: a capture without a scan");
  const Box box = bounding_box(*capture.scene.object.surface);
  const PinholeCamera lens = camera.at(frame);
  const double nearest = 0.5 * box.extent().maxCoeff();
  const double depth = std::max(lens.project(0.5 * (box.min + box.max)).z(), nearest);
  return depth / std::sqrt(lens.fx * lens.fy);
}

}  // namespace pliant
