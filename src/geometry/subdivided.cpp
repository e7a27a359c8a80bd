#include "geometry/subdivided.hpp"

#include <map>
#include <utility>

namespace pliant {

namespace {

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

}  // namespace

double mean_edge(const TriangleMesh& mesh) {
  double sum = 0.0;
  for (const auto& t : mesh.triangles)
    for (std::size_t e = 0; e < 3; ++e)
      sum += (mesh.vertices[std::size_t(t[e])] - mesh.vertices[std::size_t(t[(e + 1) % 3])]).norm();
  return sum / (3.0 * double(mesh.triangles.size()));
}

TriangleMesh subdivided(TriangleMesh mesh, double spacing, int most) {
  // A closed surface has about twice as many triangles as vertices: cut in four it has four times as many of both.
  while (4 * int(mesh.vertices.size()) <= most && mean_edge(mesh) > spacing) mesh = cut_in_four(mesh);
  return mesh;
}

}  // namespace pliant
