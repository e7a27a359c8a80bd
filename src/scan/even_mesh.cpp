#include "scan/even_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/disjoint_sets.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "meshing/level_mesh.hpp"
#include "meshing/mesh_distance.hpp"

namespace pliant {

namespace {

// A mean over the 27 lattice points around, weighted 1 2 1 each way: steps of the raw solid smaller than the lattice
// go.
double smoothed(const SignedDistance& distance, const Vector3& p, double spacing) {
  const double own = distance.value(p);
  if (std::abs(own) > 4.0 * spacing) return own;
  double sum = 0.0;
  for (int k = -1; k <= 1; ++k)
    for (int j = -1; j <= 1; ++j)
      for (int i = -1; i <= 1; ++i)
        sum +=
            (2 - std::abs(i)) * (2 - std::abs(j)) * (2 - std::abs(k)) * distance.value(p + spacing * Vector3(i, j, k));
  return sum / 64.0;
}

}  // namespace

TriangleMesh largest_part(const TriangleMesh& mesh) {
  DisjointSets parts(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) parts.join(a, b), parts.join(a, c);
  std::vector<double> volume(mesh.vertices.size(), 0.0);
  for (const auto& [a, b, c] : mesh.triangles)
    volume[std::size_t(parts.root(a))] +=
        mesh.vertices[std::size_t(a)].dot(mesh.vertices[std::size_t(b)].cross(mesh.vertices[std::size_t(c)]));
  const int largest = int(std::ranges::max_element(volume) - volume.begin());
  TriangleMesh result;
  std::vector<int> number(mesh.vertices.size(), -1);
  for (const auto& triangle : mesh.triangles) {
    if (parts.root(triangle[0]) != largest) continue;
    auto& own = result.triangles.emplace_back();
    for (int k = 0; k < 3; ++k) {
      int& vertex = number[std::size_t(triangle[std::size_t(k)])];
      if (vertex < 0) {
        vertex = int(result.vertices.size());
        result.vertices.push_back(mesh.vertices[std::size_t(triangle[std::size_t(k)])]);
      }
      own[std::size_t(k)] = vertex;
    }
  }
  return result;
}

TriangleMesh even_mesh(const std::function<double(const Vector3&)>& raw, const Box& box, double spacing,
                       const std::optional<Plane>& plane) {
  const double margin = 4.0 * spacing;
  const TriangleMesh rough = largest_part(make_level_surface(raw, box, spacing));
  if (rough.triangles.empty()) return rough;
  const SignedDistance distance = signed_distance(rough, spacing, margin);
  const auto even = [&](const Vector3& p) {
    const double above = plane ? plane->normal.dot(p - plane->point) : std::numeric_limits<double>::max();
    const double inner = plane ? std::max(0.0, 2.0 * spacing - above) : 0.0;  // its edge at the plane stays sharp
    return std::max(smoothed(distance, inner > 0 ? Vector3(p + inner * plane->normal) : p, spacing), -above);
  };
  const Box around = grown(bounding_box(rough), margin);
  const TriangleMesh mesh = largest_part(make_even_level_surface(even, around, spacing));
  if (examine(mesh).is_closed_solid) return mesh;
  return largest_part(make_level_surface(even, around, spacing));
}

}  // namespace pliant
