#include "motion/contact_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "geometry/surface_distance.hpp"

namespace pliant {

namespace {

struct Face {
  std::array<Vector3, 3> corners;
  Vector3 normal() const { return (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized(); }
  double area() const { return 0.5 * (corners[1] - corners[0]).cross(corners[2] - corners[0]).norm(); }
  Vector3 at(double b1, double b2) const {
    return corners[0] + b1 * (corners[1] - corners[0]) + b2 * (corners[2] - corners[0]);
  }
};

std::vector<Face> boundary_faces(const Body& body) {
  const auto* mesh = std::get_if<TetMesh>(&body.mesh);
  if (!mesh) throw std::invalid_argument("rigid contacts are for tetrahedra");
  std::vector<Face> faces;
  for (const auto& f : mesh->boundary)
    faces.push_back(
        {{mesh->nodes.row(f[0]).transpose(), mesh->nodes.row(f[1]).transpose(), mesh->nodes.row(f[2]).transpose()}});
  return faces;
}

/// Visits the centres of n^2 equal triangles.
template <class Visit>
void cut(const Face& face, int n, Visit&& visit) {
  const double area = face.area() / double(n * n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n - i; ++j) {
      visit(face.at((i + 1.0 / 3.0) / n, (j + 1.0 / 3.0) / n), area);
      if (j < n - i - 1) visit(face.at((i + 2.0 / 3.0) / n, (j + 2.0 / 3.0) / n), area);
    }
}

double squared_distance(const Face& f, const Vector3& p) {
  return (closest_on_triangle(p, f.corners[0], f.corners[1], f.corners[2]) - p).squaredNorm();
}

}  // namespace

ContactSamples surface_samples(const Body& body) {
  ContactSamples samples;
  for (const SurfacePoint& point : body.surface) {
    samples.rest.push_back(point.position);
    samples.area.push_back(point.area);
    samples.normal.push_back(point.normal);
  }
  return samples;
}

ContactSamples boundary_samples(const Body& body, int cuts) {
  ContactSamples samples;
  for (const Face& face : boundary_faces(body)) {
    const Vector3 normal = face.normal();
    cut(face, cuts, [&](const Vector3& point, double area) {
      samples.rest.push_back(point);
      samples.area.push_back(area);
      samples.normal.push_back(normal);
    });
  }
  return samples;
}

ContactSamples mesh_samples(const TriangleMesh& surface, double spacing) {
  ContactSamples samples;
  for (const auto& [a, b, c] : surface.triangles) {
    const Face face{
        {surface.vertices[std::size_t(a)], surface.vertices[std::size_t(b)], surface.vertices[std::size_t(c)]}};
    if (!(face.area() > 0.0)) continue;
    const Vector3 normal = face.normal();
    cut(face, std::max(1, int(std::ceil(std::sqrt(2.0 * face.area()) / spacing))),
        [&](const Vector3& point, double area) {
          samples.rest.push_back(point), samples.area.push_back(area), samples.normal.push_back(normal);
        });
  }
  return samples;
}

ContactSamples disc_samples(const Body& body, const Vector3& centre, double radius) {
  const std::vector<Face> faces = boundary_faces(body);
  double nearest = std::numeric_limits<double>::infinity();
  Vector3 normal = Vector3::UnitZ();
  for (const Face& face : faces)
    if (const double d = squared_distance(face, centre); d < nearest) nearest = d, normal = face.normal();
  ContactSamples samples;
  const double spacing = radius / 12.0;
  for (const Face& face : faces) {
    if (face.normal().dot(normal) < 0.5 || squared_distance(face, centre) > radius * radius) continue;
    const int n = std::clamp(int(std::ceil(std::sqrt(2.0 * face.area()) / spacing)), 1, 64);
    cut(face, n, [&](const Vector3& point, double area) {
      if ((point - centre).squaredNorm() > radius * radius) return;
      samples.rest.push_back(point);
      samples.area.push_back(area);
    });
  }
  return samples;
}

}  // namespace pliant
