#include "simulation/flat_sheet.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace pliant {

namespace {

constexpr double usual_cells = 12.0;  // along the object

}  // namespace

std::optional<FlatSheet> flat_sheet(const TriangleMesh& surface) {
  constexpr double even = 1.5;  // its extent across, over its volume on one side's area
  Matrix3 faces = Matrix3::Zero();
  for (const auto& [a, b, c] : surface.triangles) {
    const Vector3 &p = surface.vertices[std::size_t(a)], &q = surface.vertices[std::size_t(b)],
                  &r = surface.vertices[std::size_t(c)];
    const Vector3 area = 0.5 * (q - p).cross(r - p);
    if (const double norm = area.norm(); norm > 0.0) faces += area * area.transpose() / norm;
  }
  const Vector3 normal = Eigen::SelfAdjointEigenSolver<Matrix3>(faces).eigenvectors().col(2);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vector3& v : surface.vertices) low = std::min(low, normal.dot(v)), high = std::max(high, normal.dot(v));
  if (high - low > even * 2.0 * enclosed_volume(surface) / faces.trace()) return std::nullopt;
  return FlatSheet{normal, high - low};
}

double hex_cell_size_of_thickness(const Scene& scene, double thickness, double cells, int most) {
  constexpr double slenderness = 5.0;
  const TriangleMesh& surface = *scene.object.surface;
  const double by_count = usual_cells * std::cbrt(enclosed_volume(surface) / most);
  return std::min(bounding_box(surface).extent().maxCoeff(), std::max(slenderness * thickness, by_count)) / cells;
}

bool is_thinner_than_hexahedra(const Scene& scene) {
  const auto sheet = flat_sheet(*scene.object.surface);
  return sheet && sheet->thickness < least_through * hex_cell_size_of_thickness(scene, sheet->thickness, usual_cells);
}

TetMesh flat_tetrahedra(const TriangleMesh& surface, const FlatSheet& sheet, const TetMeshOptions& options) {
  const double stretch = options.cell_size / sheet.thickness;
  const auto stretched = [normal = sheet.normal](const Vector3& p, double by) -> Vector3 {
    return p + (by - 1.0) * normal.dot(p) * normal;
  };
  TetMeshOptions thick = options;
  thick.quadratic = false;
  for (auto& part : thick.parts) part = [=](const Vector3& p) { return part(stretched(p, 1.0 / stretch)); };
  TriangleMesh block = surface;
  for (Vector3& vertex : block.vertices) vertex = stretched(vertex, stretch);
  TetMesh mesh = make_tet_mesh(block, thick);
  for (Eigen::Index n = 0; n < mesh.nodes.rows(); ++n)
    mesh.nodes.row(n) = stretched(mesh.nodes.row(n).transpose(), 1.0 / stretch).transpose();
  mesh = make_tet_mesh(std::move(mesh.nodes), std::move(mesh.tets), {});
  return options.quadratic ? with_mid_nodes(mesh) : mesh;
}

}  // namespace pliant
