#include "geometry/surface_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "geometry/box_tree.hpp"

namespace pliant {

namespace {

namespace bg = boost::geometry;

BoxTree triangle_tree(const TriangleMesh& surface) {
  return box_tree(surface.triangles.size(), [&](std::size_t t) {
    Box box;
    for (const int v : surface.triangles[t]) box.extend(surface.vertices[std::size_t(v)]);
    return box;
  });
}

}  // namespace

Vector3 closest_on_triangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  const auto on_segment = [&](const Vector3& s, const Vector3& e) -> Vector3 {
    const Vector3 d = e - s;
    const double length = d.squaredNorm();
    return length > 0 ? Vector3(s + std::clamp((p - s).dot(d) / length, 0.0, 1.0) * d) : s;
  };
  const Vector3 n = (b - a).cross(c - a);
  const bool inside = n.squaredNorm() > 0 && n.dot((b - a).cross(p - a)) >= 0 && n.dot((c - b).cross(p - b)) >= 0 &&
                      n.dot((a - c).cross(p - c)) >= 0;
  if (inside) return p - n * (n.dot(p - a) / n.squaredNorm());
  Vector3 best = on_segment(a, b);
  for (const Vector3& other : {on_segment(b, c), on_segment(c, a)})
    if ((other - p).squaredNorm() < (best - p).squaredNorm()) best = other;
  return best;
}

struct SurfaceDistance::Tree {
  TriangleMesh surface;
  BoxTree boxes;
};

SurfaceDistance::SurfaceDistance(TriangleMesh surface) {
  if (surface.triangles.empty()) throw std::invalid_argument("distances to a surface without triangles");
  BoxTree boxes = triangle_tree(surface);
  tree_ = std::make_shared<Tree>(Tree{std::move(surface), std::move(boxes)});
}

double SurfaceDistance::operator()(const Vector3& point) const {
  const TriangleMesh& surface = tree_->surface;
  const BoxTree& boxes = tree_->boxes;
  const TreePoint at = tree_point(point);
  double least = std::numeric_limits<double>::infinity();
  const auto hold_against = [&](const std::pair<TreeBox, int>& box) {
    const auto& [a, b, c] = surface.triangles[std::size_t(box.second)];
    const Vector3 closest = closest_on_triangle(point, surface.vertices[a], surface.vertices[b], surface.vertices[c]);
    least = std::min(least, (closest - point).squaredNorm());
  };
  // The triangles of the nearest boxes bound the distance: what is nearer has a box within that bound.
  constexpr unsigned some = 8;
  for (auto it = boxes.qbegin(bg::index::nearest(at, some)); it != boxes.qend(); ++it) hold_against(*it);
  const Vector3 bound = Vector3::Constant(std::sqrt(least));
  const TreeBox around(tree_point(point - bound), tree_point(point + bound));
  for (auto it = boxes.qbegin(bg::index::intersects(around)); it != boxes.qend(); ++it)
    if (bg::comparable_distance(at, it->first) < least) hold_against(*it);
  return std::sqrt(least);
}

std::vector<double> distances_to_surface(const TriangleMesh& surface, std::span<const Vector3> points) {
  const SurfaceDistance distance(surface);
  std::vector<double> distances;
  distances.reserve(points.size());
  for (const Vector3& point : points) distances.push_back(distance(point));
  return distances;
}

}  // namespace pliant
