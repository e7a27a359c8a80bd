#include "geometry/signed_distance.hpp"

#include <openvdb/openvdb.h>
#include <openvdb/tools/MeshToVolume.h>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace pliant {

void SignedDistance::allocate(const Box& box, double spacing) {
  origin_ = box.min;
  spacing_ = spacing;
  for (int d = 0; d < 3; ++d) size_[d] = std::max(2, int(std::ceil(box.extent()[d] / spacing)) + 1);
  values_.assign(std::size_t(size_.x()) * size_.y() * size_.z(), 0.0f);
}

const float* SignedDistance::corner(const Vector3& point, Vector3& local, Vector3& outside) const {
  std::array<int, 3> index;
  for (int d = 0; d < 3; ++d) {
    const double s = (point[d] - origin_[d]) / spacing_;
    const double clamped = std::clamp(s, 0.0, double(size_[d] - 1));
    outside[d] = (s - clamped) * spacing_;
    index[d] = std::min(int(clamped), size_[d] - 2);
    local[d] = clamped - index[d];
  }
  return &values_[(std::size_t(index[2]) * size_.y() + index[1]) * size_.x() + index[0]];
}

SignedDistance::Sample SignedDistance::sample(const Vector3& point) const {
  Vector3 t, outside;
  const float* c = corner(point, t, outside);
  const std::size_t sx = 1, sy = std::size_t(size_.x()), sz = sy * std::size_t(size_.y());
  const double c000 = c[0], c100 = c[sx], c010 = c[sy], c110 = c[sx + sy];
  const double c001 = c[sz], c101 = c[sx + sz], c011 = c[sy + sz], c111 = c[sx + sy + sz];
  const double x = t.x(), y = t.y(), z = t.z();
  const double c00 = c000 + x * (c100 - c000), c10 = c010 + x * (c110 - c010);
  const double c01 = c001 + x * (c101 - c001), c11 = c011 + x * (c111 - c011);
  const double c0 = c00 + y * (c10 - c00), c1 = c01 + y * (c11 - c01);
  Sample s;
  s.value = c0 + z * (c1 - c0);
  s.gradient.x() =
      ((1 - z) * ((1 - y) * (c100 - c000) + y * (c110 - c010)) + z * ((1 - y) * (c101 - c001) + y * (c111 - c011)));
  s.gradient.y() = (1 - z) * (c10 - c00) + z * (c11 - c01);
  s.gradient.z() = c1 - c0;
  s.gradient /= spacing_;
  const double distance = outside.norm();
  if (distance > 0.0) {
    s.value += distance;
    for (int d = 0; d < 3; ++d)
      if (outside[d] != 0.0) s.gradient[d] = 0.0;
    s.gradient += outside / distance;
  }
  return s;
}

double SignedDistance::value(const Vector3& point) const { return sample(point).value; }

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
