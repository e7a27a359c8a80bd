#include "synthesis/synthetic_markers.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "geometry/surface_distance.hpp"
#include "motion/pull.hpp"
#include "synthesis/sensor.hpp"

namespace pliant {

namespace {

constexpr std::uint64_t spread_image = 0x73707264u, marker_image = std::uint64_t(0x6d61726bu) << 32;  // counters
enum class MarkerNumber : std::uint64_t { Triangle, Corner, SecondCorner, X, Y, Z, Lost };

double uniform(std::uint64_t seed, std::uint64_t image, MarkerNumber purpose, std::uint64_t i) {
  return counter_uniform(seed, image, std::uint64_t(purpose), i);
}

Vector3 corner(const TriangleMesh& surface, int triangle, int k) {
  return surface.vertices[std::size_t(surface.triangles[std::size_t(triangle)][std::size_t(k)])];
}

// Of a point in the triangle's plane.
Vector3 barycentric(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 normal = (b - a).cross(c - a);
  const double square = normal.squaredNorm();
  if (!(square > 0.0)) return Vector3::UnitX();
  const double u = normal.dot((c - b).cross(p - b)) / square, v = normal.dot((a - c).cross(p - c)) / square;
  return {u, v, 1.0 - u - v};
}

}  // namespace

std::vector<Vector3> spread_markers(const TriangleMesh& surface, int count,
                                    const std::function<bool(const Vector3&)>& is_wanted,
                                    const std::vector<Vector3>& apart, std::uint64_t seed) {
  constexpr std::uint64_t candidates_each = 60, tries_each = 60;
  if (count < 1) throw std::invalid_argument("spread_markers: one marker at least");
  std::vector<double> sums{0.0};
  for (const auto& [a, b, c] : surface.triangles) {
    const Vector3& p = surface.vertices[std::size_t(a)];
    sums.push_back(sums.back() +
                   (surface.vertices[std::size_t(b)] - p).cross(surface.vertices[std::size_t(c)] - p).norm());
  }
  const std::size_t wanted = candidates_each * std::size_t(count);
  std::vector<Vector3> candidates;
  for (std::uint64_t i = 0; i < tries_each * wanted && candidates.size() < wanted; ++i) {
    const double at = uniform(seed, spread_image, MarkerNumber::Triangle, i) * sums.back();
    const int t = int(std::ranges::upper_bound(sums, at) - sums.begin()) - 1;
    if (t < 0 || t >= int(surface.triangles.size())) continue;
    const double root = std::sqrt(uniform(seed, spread_image, MarkerNumber::Corner, i)),
                 v = uniform(seed, spread_image, MarkerNumber::SecondCorner, i);
    const Vector3 p = (1.0 - root) * corner(surface, t, 0) + root * (1.0 - v) * corner(surface, t, 1) +
                      root * v * corner(surface, t, 2);
    if (!is_wanted || is_wanted(p)) candidates.push_back(p);
  }
  if (candidates.size() < std::size_t(count))
    throw std::invalid_argument("hardly any part of the surface is where markers are wanted");
  return far_points(candidates, apart.empty() ? std::vector{candidates.front()} : apart, count);
}

SurfacePlace nearest_place(const TriangleMesh& surface, const Vector3& point) {
  SurfacePlace place;
  double nearest = std::numeric_limits<double>::infinity();
  for (int t = 0; t < int(surface.triangles.size()); ++t) {
    const Vector3 a = corner(surface, t, 0), b = corner(surface, t, 1), c = corner(surface, t, 2);
    const Vector3 there = closest_on_triangle(point, a, b, c);
    const double square = (there - point).squaredNorm();
    if (square < nearest) nearest = square, place = {t, barycentric(there, a, b, c)};
  }
  if (place.triangle < 0) throw std::invalid_argument("nearest_place: a surface without triangles");
  return place;
}

Vector3 SurfacePlace::operator()(const TriangleMesh& surface, const Points& vertices) const {
  Vector3 p = Vector3::Zero();
  for (int k = 0; k < 3; ++k)
    p += weights[k] * vertices.row(surface.triangles[std::size_t(triangle)][std::size_t(k)]).transpose();
  return p;
}

Points measured_markers(const SyntheticMarkers& markers, const Points& rest, const Points& now, std::uint64_t seed,
                        int occasion) {
  const std::uint64_t image = marker_image + std::uint64_t(occasion + 1);
  Points seen = now;
  for (Eigen::Index m = 0; m < now.rows(); ++m) {
    const double std = std::hypot(markers.noise, markers.relative_noise * (now.row(m) - rest.row(m)).norm());
    const bool is_lost = occasion >= 0 && uniform(seed, image, MarkerNumber::Lost, std::uint64_t(m)) < markers.lost;
    for (int k = 0; k < 3; ++k) {
      seen(m, k) +=
          std * counter_normal(seed, image, std::uint64_t(MarkerNumber::X) + std::uint64_t(k), std::uint64_t(m));
      if (is_lost) seen(m, k) = std::numeric_limits<double>::quiet_NaN();
    }
  }
  return seen;
}

}  // namespace pliant
