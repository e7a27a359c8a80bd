#include "meshing/mesh_distance.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <map>
#include <string>
#include <type_traits>
#include <vector>

#include "base/disjoint_sets.hpp"
#include "base/error.hpp"

namespace pliant {

namespace {

/// Triangles of a mesh: those of shells that face outwards, and of each cavity, a shell that faces inwards.
struct Shells {
  TriangleMesh outer;
  std::vector<TriangleMesh> cavities;
};

Shells shells_of(const TriangleMesh& mesh) {
  DisjointSets parts(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) parts.join(a, b), parts.join(a, c);
  std::map<int, TriangleMesh> by_root;
  for (const auto& triangle : mesh.triangles) by_root[parts.root(triangle[0])].triangles.push_back(triangle);
  Shells shells{{mesh.vertices, {}}, {}};
  for (auto& [root, shell] : by_root) {
    shell.vertices = mesh.vertices;
    if (enclosed_volume(shell) < 0.0)
      shells.cavities.push_back(std::move(shell));
    else
      shells.outer.triangles.insert(shells.outer.triangles.end(), shell.triangles.begin(), shell.triangles.end());
  }
  if (shells.outer.triangles.empty()) return {mesh, {}};
  return shells;
}

/// Distances in grid spacings, of a mesh whose vertices are in index space. What lies in a closed shell is inside,
/// whichever way that faces.
openvdb::FloatGrid::Ptr level_set(const std::vector<openvdb::Vec3s>& points, const TriangleMesh& mesh, float band) {
  std::vector<openvdb::Vec3I> triangles;
  for (const auto& [a, b, c] : mesh.triangles) triangles.emplace_back(a, b, c);
  using Adapter = openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I>;
  const Adapter adapter(points, triangles);
  return openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, openvdb::math::Transform(), band, band);
}

}  // namespace

SignedDistance signed_distance(const TriangleMesh& mesh, double spacing, double margin) {
  Box box = bounding_box(mesh);
  box.min.array() -= margin + spacing;
  box.max.array() += margin + spacing;
  SignedDistance distance;
  distance.allocate(box, spacing);
  static const bool initialised = (openvdb::initialize(), true);
  (void)initialised;
  std::vector<openvdb::Vec3s> points;
  points.reserve(mesh.vertices.size());
  for (const Vector3& v : mesh.vertices) {
    const Vector3 p = (v - distance.origin_) / spacing;  // index space: grid point (i, j, k) lies at (i, j, k)
    points.emplace_back(float(p.x()), float(p.y()), float(p.z()));
  }
  const float band = float(margin / spacing) + 3.0f;
  const Shells shells = shells_of(mesh);
  const auto fill = [&](const TriangleMesh& shell, const auto& combined) {
    const auto levels = level_set(points, shell, band);
    auto accessor = levels->getConstAccessor();
    for (int k = 0; k < distance.size_.z(); ++k)
      for (int j = 0; j < distance.size_.y(); ++j)
        for (int i = 0; i < distance.size_.x(); ++i)
          distance.at(i, j, k) = combined(distance.at(i, j, k), accessor.getValue({i, j, k}) * float(spacing));
  };
  fill(shells.outer, [](auto, auto value) { return value; });
  for (const TriangleMesh& cavity : shells.cavities)
    fill(cavity, [](auto before, auto value) { return std::max<std::decay_t<decltype(before)>>(before, -value); });
  bool encloses = false;
  for (int k = 0; k < distance.size_.z(); ++k)
    for (int j = 0; j < distance.size_.y(); ++j)
      for (int i = 0; i < distance.size_.x(); ++i) encloses = encloses || distance.at(i, j, k) < 0.0f;
  if (!encloses)
    throw InputError({{},
                      "the surface encloses no volume at a resolution of " + std::to_string(spacing) + " m",
                      "a closed surface, oriented outwards",
                      "check the mesh or raise the resolution"});
  return distance;
}

}  // namespace pliant
