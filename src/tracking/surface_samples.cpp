#include "tracking/surface_samples.hpp"

#include <cmath>
#include <map>
#include <utility>

#include "base/points.hpp"
#include "tracking/neighbours.hpp"

namespace pliant {

namespace {

double mean_edge(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles)
    for (std::size_t e = 0; e < 3; ++e)
      sum += (mesh.vertices[std::size_t(t[e])] - mesh.vertices[std::size_t(t[(e + 1) % 3])]).norm();
  return sum / (3.0 * double(mesh.triangles.size()));
}

TriangleMesh cut_in_four(const TriangleMesh& mesh) {
  TriangleMesh finer{mesh.vertices, {}};
  std::map<std::pair<int, int>, int> middle;
  const auto middle_of = [&](int a, int b) {
    const auto [at, is_new] = middle.try_emplace(std::minmax(a, b), int(finer.vertices.size()));
    if (is_new) finer.vertices.push_back(0.5 * (mesh.vertices[std::size_t(a)] + mesh.vertices[std::size_t(b)]));
    return at->second;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    const int ab = middle_of(a, b), bc = middle_of(b, c), ca = middle_of(c, a);
    finer.triangles.insert(finer.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return finer;
}

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

TriangleMesh subdivided(TriangleMesh mesh, double spacing, int most) {
  // A closed surface has about twice as many triangles as vertices: cut in four it has four times as many of both.
  while (4 * int(mesh.vertices.size()) <= most && mean_edge(mesh) > spacing) mesh = cut_in_four(mesh);
  return mesh;
}

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
