#include "meshing/mesh_distance.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <string>

#include "base/error.hpp"

namespace pliant {

SignedDistance signed_distance(const TriangleMesh& mesh, double spacing, double margin) {
  static const bool initialised = (openvdb::initialize(), true);
  (void)initialised;
  Box box = bounding_box(mesh);
  box.min.array() -= margin + spacing;
  box.max.array() += margin + spacing;

  SignedDistance distance;
  distance.allocate(box, spacing);
  const Vector3 origin = distance.origin_;

  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  points.reserve(mesh.vertices.size());
  triangles.reserve(mesh.triangles.size());
  for (const Vector3& v : mesh.vertices) {
    const Vector3 p = (v - origin) / spacing;  // index space: grid point (i, j, k) lies at (i, j, k)
    points.emplace_back(float(p.x()), float(p.y()), float(p.z()));
  }
  for (const auto& [a, b, c] : mesh.triangles) triangles.emplace_back(a, b, c);

  using Adapter = openvdb::tools::QuadAndTriangleDataAdapter<openvdb::Vec3s, openvdb::Vec3I>;
  const Adapter adapter(points, triangles);
  const float band = float(margin / spacing) + 3.0f;
  const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(adapter, openvdb::math::Transform(), band, band);
  auto accessor = grid->getConstAccessor();
  bool encloses = false;
  for (int k = 0; k < distance.size_.z(); ++k)
    for (int j = 0; j < distance.size_.y(); ++j)
      for (int i = 0; i < distance.size_.x(); ++i) {
        const float value = accessor.getValue({i, j, k});
        encloses = encloses || value < 0.0f;
        distance.at(i, j, k) = value * float(spacing);
      }
  if (!encloses)
    throw InputError({{},
                      "the surface encloses no volume at a resolution of " + std::to_string(spacing) + " m",
                      "a closed surface, oriented outwards",
                      "check the mesh or raise the resolution"});
  return distance;
}

}  // namespace pliant
