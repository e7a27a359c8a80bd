#include "meshing/volume_match.hpp"

#include <algorithm>
#include <limits>

#include "mesh/tet_boundary.hpp"

namespace pliant {

namespace {

using Tet = std::array<int, 4>;

constexpr int passes = 3;              // gaps after a pass are of the second order in those before
constexpr int parts = 4;               // of a face's edge: gaps are integrated over its square many triangles
constexpr double reach = 0.3;          // of a face's longest edge: what is farther away is not what it stands for
constexpr double least_cosine = 0.7;   // between the way to the surface and a face's normal
constexpr double most_stretch = 4.0;   // of the mean gap: where only some of a node's faces have one
constexpr double least_quality = 0.8;  // of an element's worst one beside a node, that a moved node leaves

/// What the faces of a boundary node say about where it should be.
struct Star {
  double weight = 0.0;                 // integral of the node's linear shape function [m^2]
  double volume = 0.0;                 // that lies between faces and surface, weighted by the shape function [m^3]
  Vector3 mean_gap = Vector3::Zero();  // integral of the way to the surface, weighted likewise [m^3]
  Vector3 area = Vector3::Zero();      // d volume of the mesh / d node [m^2]
  double longest = 0.0;                // edge [m]
};

/// Centres of the parts of a triangle, as barycentric coordinates.
std::vector<Vector3> centres() {
  std::vector<Vector3> at;
  for (int i = 0; i < parts; ++i)
    for (int j = 0; i + j < parts; ++j) {
      at.emplace_back(Vector3(i + 1.0 / 3.0, j + 1.0 / 3.0, 0.0) / parts);
      if (i + j + 1 < parts) at.emplace_back(Vector3(i + 2.0 / 3.0, j + 2.0 / 3.0, 0.0) / parts);
    }
  for (Vector3& b : at) b[2] = 1.0 - b[0] - b[1];
  return at;
}

/// Six volumes over the cube of the longest edge.
double quality_of(const std::vector<Vector3>& x, const Tet& t) {
  const auto at = [&](int k) -> const Vector3& { return x[std::size_t(t[std::size_t(k)])]; };
  double longest = 0.0;
  for (const auto& [i, j] : tet_edges) longest = std::max(longest, (at(i) - at(j)).norm());
  return (at(1) - at(0)).cross(at(2) - at(0)).dot(at(3) - at(0)) / (longest * longest * longest);
}

std::vector<Star> stars_of(const std::vector<Vector3>& x, const std::vector<Tet>& tets,
                           const std::vector<TetFace>& boundary,
                           const std::function<Vector3(const Vector3&)>& nearest) {
  static const std::vector<Vector3> at = centres();
  std::vector<Star> stars(x.size());
  std::vector<Vector3> gaps(at.size());
  std::vector<bool> is_seen(at.size());
  for (const TetFace& face : boundary) {
    const std::array<int, 3> n = face.corners(tets);
    Matrix3 corners;
    for (int k = 0; k < 3; ++k) corners.col(k) = x[std::size_t(n[std::size_t(k)])];
    const Vector3 area = 0.5 * (corners.col(1) - corners.col(0)).cross(corners.col(2) - corners.col(0));
    const Vector3 normal = area.normalized();
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) longest = std::max(longest, (corners.col((k + 1) % 3) - corners.col(k)).norm());
    for (int k = 0; k < 3; ++k) {
      Star& star = stars[std::size_t(n[std::size_t(k)])];
      star.weight += area.norm() / 3.0;
      star.area += area / 3.0;
      star.longest = std::max(star.longest, longest);
    }
    // Behind a sharp edge the nearest point lies on another face's side: there the rest of the face speaks for it.
    Vector3 mean = Vector3::Zero();
    int count = 0;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Vector3 point = corners * at[i];
      gaps[i] = nearest(point) - point;
      const double off = gaps[i].norm();
      is_seen[i] = off <= reach * longest && std::abs(gaps[i].dot(normal)) >= least_cosine * off;
      if (is_seen[i]) mean += gaps[i], ++count;
    }
    if (count == 0) continue;
    mean /= count;
    for (std::size_t i = 0; i < at.size(); ++i) {
      const Vector3& gap = is_seen[i] ? gaps[i] : mean;
      for (int k = 0; k < 3; ++k) {
        Star& star = stars[std::size_t(n[std::size_t(k)])];
        const double w = at[i][k] * area.norm() / double(at.size());
        star.mean_gap += w * gap;
        star.volume += w * gap.dot(normal);
      }
    }
  }
  return stars;
}

/// Along the mean way to the surface, so that the mesh gains the volume that is missing about the node.
Vector3 step_of(const Star& star) {
  if (!(star.weight > 0.0)) return Vector3::Zero();
  const Vector3 mean = star.mean_gap / star.weight;
  const double gained = mean.dot(star.area);
  if (!(gained * star.volume > 0.0)) return Vector3::Zero();
  const Vector3 step = std::min(star.volume / gained, most_stretch) * mean;
  return std::min(1.0, reach * star.longest / step.norm()) * step;
}

}  // namespace

void match_volume(std::vector<Vector3>& nodes, const std::vector<Tet>& tets,
                  const std::function<Vector3(const Vector3&)>& nearest) {
  const std::vector<TetFace> boundary = boundary_faces(tets);
  std::vector<std::vector<int>> elements(nodes.size());
  for (std::size_t t = 0; t < tets.size(); ++t)
    for (const int n : tets[t]) elements[std::size_t(n)].push_back(int(t));
  const auto worst = [&](std::size_t n) {
    double least = std::numeric_limits<double>::max();
    for (const int t : elements[n]) least = std::min(least, quality_of(nodes, tets[std::size_t(t)]));
    return least;
  };
  for (int pass = 0; pass < passes; ++pass) {
    const std::vector<Star> stars = stars_of(nodes, tets, boundary, nearest);
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      const Vector3 from = nodes[n], step = step_of(stars[n]);
      if (step.isZero(0.0)) continue;
      const double before = worst(n);
      double share = 1.0;
      for (; share > 0.1; share *= 0.5) {
        nodes[n] = from + share * step;
        if (worst(n) > least_quality * before) break;
      }
      if (share <= 0.1) nodes[n] = from;
    }
  }
}

}  // namespace pliant
