#include "scene/region.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace pliant {

namespace {

struct Contains {
  const Vector3& point;
  bool operator()(const RegionBox& box) const {
    return (point.array() >= box.min.array()).all() && (point.array() <= box.max.array()).all();
  }
  bool operator()(const RegionSphere& sphere) const { return (point - sphere.centre).norm() <= sphere.radius; }
  bool operator()(const RegionHalfSpace& half) const { return half.normal.dot(point - half.point) >= 0.0; }
  bool operator()(const RegionVertices&) const { return false; }
};

// The part of the surface's bounding box in which the region lies.
Box overlap(const Region& region, const TriangleMesh& surface) {
  Box box = bounding_box(surface);
  Vector3 min = box.min, max = box.max;
  if (const auto* own = std::get_if<RegionBox>(&region)) min = own->min, max = own->max;
  if (const auto* own = std::get_if<RegionSphere>(&region)) {
    min = own->centre.array() - own->radius;
    max = own->centre.array() + own->radius;
  }
  box.min = box.min.cwiseMax(min);
  box.max = box.max.cwiseMin(max);
  return box;
}

}  // namespace

double winding_number(const TriangleMesh& surface, const Vector3& point) {
  double angle = 0.0;
  for (const auto& [i, j, k] : surface.triangles) {
    const Vector3 a = surface.vertices[i] - point, b = surface.vertices[j] - point, c = surface.vertices[k] - point;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle / (4.0 * std::numbers::pi);
}

bool contains(const Region& region, const Vector3& point) { return std::visit(Contains{point}, region); }

bool contains_vertex(const Region& region, const TriangleMesh& surface, int vertex) {
  if (const auto* list = std::get_if<RegionVertices>(&region))
    return std::ranges::find(list->indices, vertex) != list->indices.end();
  return contains(region, surface.vertices[std::size_t(vertex)]);
}

std::function<bool(const Vector3&)> is_in_region(const TriangleMesh& mesh, const Region& region) {
  const auto* vertices = std::get_if<RegionVertices>(&region);
  if (!vertices) return [region](const Vector3& p) { return contains(region, p); };
  // Named vertices hold the object around them, as far as the next vertices.
  std::vector<Vector3> centres;
  double radius = 0.0;
  for (const int v : vertices->indices) centres.push_back(mesh.vertices[std::size_t(v)]);
  for (const auto& triangle : mesh.triangles)
    for (int side = 0; side < 3; ++side)
      radius += (mesh.vertices[triangle[side]] - mesh.vertices[triangle[(side + 1) % 3]]).norm();
  radius /= 3.0 * double(mesh.triangles.size());
  return [centres = std::move(centres), radius](const Vector3& p) {
    return std::any_of(centres.begin(), centres.end(), [&](const Vector3& c) { return (p - c).norm() <= radius; });
  };
}

bool touches_solid(const Region& region, const TriangleMesh& surface) {
  if (const auto* list = std::get_if<RegionVertices>(&region)) return !list->indices.empty();
  if (std::ranges::any_of(surface.vertices, [&](const Vector3& v) { return contains(region, v); })) return true;
  const Box box = overlap(region, surface);
  if ((box.min.array() > box.max.array()).any()) return false;
  constexpr int steps = 8;  // a region that slips between these points holds next to nothing of the solid
  for (int i = 0; i < steps; ++i)
    for (int j = 0; j < steps; ++j)
      for (int k = 0; k < steps; ++k) {
        const Vector3 fraction = (Vector3(i, j, k).array() + 0.5) / steps;
        const Vector3 point = box.min + fraction.cwiseProduct(box.max - box.min);
        if (contains(region, point) && winding_number(surface, point) > 0.5) return true;
      }
  return false;
}

}  // namespace pliant
