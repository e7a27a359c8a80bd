#pragma once

#include <memory>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// The point of a triangle that is closest to p; of one without area, of its edges.
[[nodiscard]] Vector3 closest_on_triangle(const Vector3& p, const Vector3& a, const Vector3& b, const Vector3& c);

/// Distance [m] to a triangle mesh, closed or not, however far away; without sign. Copies share the mesh.
class SurfaceDistance {
 public:
  /// Throws std::invalid_argument where the mesh has no triangle.
  explicit SurfaceDistance(TriangleMesh surface);
  [[nodiscard]] double operator()(const Vector3& point) const;

 private:
  struct Tree;
  std::shared_ptr<const Tree> tree_;
};

/// Distance [m] of each point (`SurfaceDistance`).
/// Throws std::invalid_argument where the mesh has no triangle.
[[nodiscard]] std::vector<double> distances_to_surface(const TriangleMesh& surface, std::span<const Vector3> points);

}  // namespace pliant
