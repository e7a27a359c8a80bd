#include "photos/probe.hpp"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>

#include "geometry/surface_distance.hpp"

namespace pliant {

namespace {

constexpr double length_tolerance = 0.03;  // of the distance between the dots

// How far along the ray the triangle is crossed from its outer side, in lengths of the direction; nothing where it is
// not.
std::optional<double> crossing(const Vector3& origin, const Vector3& direction, const Vector3& a, const Vector3& b,
                               const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a, p = direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant < 1e-14 * ab.norm() * ac.norm()) return std::nullopt;
  const Vector3 from = origin - a;
  const double u = from.dot(p) / determinant;
  const Vector3 q = from.cross(ab);
  const double v = direction.dot(q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return std::nullopt;
  return ac.dot(q) / determinant;
}

std::string millimetres(double length) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f mm", 1e3 * length);
  return text;
}

}  // namespace

FoundProbe find_probe(std::span<const Sighting> dots, const ProbeShape& shape, const TriangleMesh& surface,
                      double factor) {
  if (dots.size() < 2) return {{}, "only " + std::to_string(dots.size()) + " of the probe's two dots is seen"};
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  double nearest = 1e300;
  for (std::size_t i = 0; i < dots.size(); ++i)
    for (std::size_t j = i + 1; j < dots.size(); ++j) {
      const double apart = (dots[i].position - dots[j].position).norm();
      if (std::abs(apart - shape.dots_apart) < std::abs(nearest - shape.dots_apart)) nearest = apart;
      if (std::abs(apart - shape.dots_apart) <= length_tolerance * shape.dots_apart) pairs.emplace_back(i, j);
    }
  if (pairs.empty())
    return {{},
            "no two dots of the probe's colour are " + millimetres(shape.dots_apart) +
                " apart; the nearest to it are " + millimetres(nearest)};
  if (pairs.size() > 1)
    return {{}, std::to_string(pairs.size()) + " pairs of dots could be the probe's: something else has its colour"};
  const std::array ends = {dots[pairs[0].first].position, dots[pairs[0].second].position};
  const std::vector<double> away = distances_to_surface(surface, ends);
  const bool first_is_near = away[0] < away[1];
  const Sighting& near = dots[first_is_near ? pairs[0].first : pairs[0].second];
  const Sighting& far = dots[first_is_near ? pairs[0].second : pairs[0].first];
  ProbePose pose;
  pose.direction = (near.position - far.position).normalized();
  pose.tip = near.position + shape.tip * pose.direction;
  const double lever = shape.tip / shape.dots_apart;
  const Matrix3 covariance = std::pow(1.0 + lever, 2) * near.covariance + lever * lever * far.covariance;
  pose.tip_sigma = factor * std::sqrt(covariance.trace() / 3.0);
  return {pose, ""};
}

std::optional<Vector3> contact_of(const ProbePose& pose, const TriangleMesh& surface, double reach) {
  std::optional<double> nearest;
  for (const auto& [a, b, c] : surface.triangles) {
    const auto at = crossing(pose.tip, pose.direction, surface.vertices[std::size_t(a)],
                             surface.vertices[std::size_t(b)], surface.vertices[std::size_t(c)]);
    if (at && std::abs(*at) <= reach && (!nearest || std::abs(*at) < std::abs(*nearest))) nearest = at;
  }
  if (!nearest) return std::nullopt;
  return pose.tip + *nearest * pose.direction;
}

}  // namespace pliant
