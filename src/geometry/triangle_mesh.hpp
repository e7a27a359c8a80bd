#pragma once

#include <array>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// A triangle surface in the order of its file: vertex indices that a user writes down stay valid.
struct TriangleMesh {
  std::vector<Vector3> vertices;              ///< [m]
  std::vector<std::array<int, 3>> triangles;  ///< counter-clockwise seen from outside
  bool operator==(const TriangleMesh&) const = default;
};

/// Smallest axis-aligned box around points.
struct Box {
  Vector3 min = Vector3::Constant(1e300);
  Vector3 max = Vector3::Constant(-1e300);
  void extend(const Vector3& point) {
    min = min.cwiseMin(point);
    max = max.cwiseMax(point);
  }
  Vector3 extent() const { return max - min; }
};

/// A box with `margin` [m] more on each side.
inline Box grown(Box box, double margin) {
  box.min.array() -= margin;
  box.max.array() += margin;
  return box;
}

Box bounding_box(const TriangleMesh& mesh);

/// Enclosed volume [m^3] of a closed, outward oriented mesh (negative where it is oriented inwards).
double enclosed_volume(const TriangleMesh& mesh);
/// [m^2]
double surface_area(const TriangleMesh& mesh);

/// Centre of the enclosed volume [m].
Vector3 enclosed_centroid(const TriangleMesh& mesh);

/// Unit normals of the vertices, area weighted, in the order of `mesh.vertices`.
std::vector<Vector3> vertex_normals(const TriangleMesh& mesh);

}  // namespace pliant
