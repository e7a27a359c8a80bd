#include "meshing/level_mesh.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>
#include <vector>

namespace pliant {

namespace {

openvdb::FloatGrid::Ptr sampled(const std::function<double(const Vector3&)>& function, const Box& box, double spacing) {
  constexpr float band = 3.0f;  // lattice spacings: beyond it only the sign matters
  auto grid = openvdb::FloatGrid::create(band);
  auto accessor = grid->getAccessor();
  const Eigen::Vector3i size = (box.extent() / spacing).array().ceil().cast<int>() + 1;
  for (int k = 0; k < size.z(); ++k)
    for (int j = 0; j < size.y(); ++j)
      for (int i = 0; i < size.x(); ++i) {
        const float value = float(function(box.min + spacing * Vector3(i, j, k)) / spacing);
        if (value < band) accessor.setValue({i, j, k}, std::max(value, -band));
      }
  return grid;
}

}  // namespace

TriangleMesh make_even_level_surface(const std::function<double(const Vector3&)>& function, const Box& box,
                                     double spacing) {
  if (!(spacing > 0.0) || !(box.extent().minCoeff() > 0.0) || !((box.extent() / spacing).prod() < 1e9))
    throw std::invalid_argument("make_even_level_surface: the box needs a volume of less than 1e9 lattice points");
  static const bool initialised = (openvdb::initialize(), true);
  (void)initialised;
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(*sampled(function, box, spacing), points, triangles, quads, 0.0, 0.0);
  TriangleMesh mesh;
  for (const openvdb::Vec3s& p : points) mesh.vertices.push_back(box.min + spacing * Vector3(p.x(), p.y(), p.z()));
  const auto vertex = [&](int i) -> const Vector3& { return mesh.vertices[std::size_t(i)]; };
  for (const openvdb::Vec3I& t : triangles) mesh.triangles.push_back({int(t[0]), int(t[1]), int(t[2])});
  for (const openvdb::Vec4I& q : quads) {
    const std::array<int, 4> c{int(q[0]), int(q[1]), int(q[2]), int(q[3])};
    const bool first = (vertex(c[0]) - vertex(c[2])).squaredNorm() <= (vertex(c[1]) - vertex(c[3])).squaredNorm();
    mesh.triangles.push_back({c[0], c[1], first ? c[2] : c[3]});
    if (first)
      mesh.triangles.push_back({c[0], c[2], c[3]});
    else
      mesh.triangles.push_back({c[1], c[2], c[3]});
  }
  if (enclosed_volume(mesh) < 0.0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

}  // namespace pliant
