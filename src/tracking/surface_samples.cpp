#include "tracking/surface_samples.hpp"

#include <cmath>

#include "base/points.hpp"
#include "tracking/neighbours.hpp"

namespace pliant {

namespace {

std::vector<double> vertex_areas(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size());
  for (const auto& t : mesh.triangles) {
    const auto corner = [&](std::size_t i) { return mesh.vertices[std::size_t(t[i])]; };
    const double third = (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm() / 6.0;
    for (const int v : t) areas[std::size_t(v)] += third;
  }
  return areas;
}

/// Vertices in their order, but those too close to one taken before.
SampleLevel level_of(const Points& vertices, const Neighbours& near, const std::vector<double>& areas, double spacing) {
  SampleLevel level{spacing, {}, {}, {}};
  std::vector<bool> covered(areas.size());
  std::vector<Neighbours::Match> found;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    if (covered[v]) continue;
    level.vertex.push_back(int(v));
    near.within(vertices.row(Eigen::Index(v)).transpose(), spacing, found);
    for (const auto& [index, distance] : found) covered[std::size_t(index)] = true;
    covered[v] = true;
  }
  Points samples(Eigen::Index(level.vertex.size()), 3);
  for (std::size_t i = 0; i < level.vertex.size(); ++i) samples.row(Eigen::Index(i)) = vertices.row(level.vertex[i]);
  const Neighbours samples_near(samples);
  level.area.resize(level.vertex.size());
  for (std::size_t v = 0; v < areas.size(); ++v) {
    const int sample = samples_near.nearest(vertices.row(Eigen::Index(v)).transpose()).index;
    level.sample_of.push_back(sample);
    level.area[std::size_t(sample)] += areas[v];
  }
  return level;
}

}  // namespace

std::vector<SampleLevel> sample_levels(const TriangleMesh& mesh, int fewest) {
  const std::vector<double> areas = vertex_areas(mesh);
  const Points vertices = to_points(mesh.vertices);
  const Neighbours near(vertices);
  SampleLevel all{0.0, {}, areas, {}};
  for (int v = 0; v < int(areas.size()); ++v) all.vertex.push_back(v), all.sample_of.push_back(v);
  std::vector<SampleLevel> levels = {std::move(all)};
  constexpr double ratio = 1.5;
  double total = 0.0;
  for (const double area : areas) total += area;
  for (double spacing = ratio * std::sqrt(total / double(areas.size()));; spacing *= ratio) {
    SampleLevel next = level_of(vertices, near, areas, spacing);
    if (int(next.vertex.size()) < fewest) return levels;
    levels.push_back(std::move(next));
  }
}

}  // namespace pliant
