#include "geometry/triangle_mesh.hpp"

#include <Eigen/Geometry>

namespace pliant {

Box bounding_box(const TriangleMesh& mesh) {
  Box box;
  for (const Vector3& vertex : mesh.vertices) box.extend(vertex);
  return box;
}

double surface_area(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& t : mesh.triangles) {
    const Vector3 &a = mesh.vertices[std::size_t(t[0])], &b = mesh.vertices[std::size_t(t[1])],
                  &c = mesh.vertices[std::size_t(t[2])];
    area += 0.5 * (b - a).cross(c - a).norm();
  }
  return area;
}

double enclosed_volume(const TriangleMesh& mesh) {
  double six_volumes = 0.0;
  for (const auto& [a, b, c] : mesh.triangles)
    six_volumes += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c]));
  return six_volumes / 6.0;
}

Vector3 enclosed_centroid(const TriangleMesh& mesh) {
  Vector3 moment = Vector3::Zero();
  double volume = 0.0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    const double six = p.dot(q.cross(r));
    volume += six;
    moment += six * (p + q + r) / 4.0;
  }
  return moment / volume;
}

std::vector<Vector3> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Vector3> normals(mesh.vertices.size(), Vector3::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3 n = (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    for (const int v : {a, b, c}) normals[v] += n;
  }
  for (Vector3& normal : normals) normal.normalize();
  return normals;
}

}  // namespace pliant
