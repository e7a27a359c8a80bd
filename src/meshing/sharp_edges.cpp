#include "meshing/sharp_edges.hpp"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "base/disjoint_sets.hpp"

namespace pliant {

namespace {

class SharpEdges {
 public:
  SharpEdges(const TriangleMesh& surface, double angle_deg, double cell_size)
      : surface_(surface), angle_deg_(angle_deg) {
    mark();
    do drop_loose_ends();
    while (drop_small_patches(0.25 * cell_size * cell_size));
  }

  std::vector<std::vector<int>> lines() const {
    std::map<int, std::vector<int>> neighbours;
    for (const auto& [ends, edge] : edges_)
      if (edge.is_sharp) {
        neighbours[ends.first].push_back(ends.second);
        neighbours[ends.second].push_back(ends.first);
      }
    std::set<std::pair<int, int>> walked;
    std::vector<std::vector<int>> all;
    const auto walk = [&](int from, int to) {
      if (!walked.insert(std::minmax(from, to)).second) return;
      all.push_back({from, to});
      while (to != all.back().front() && !is_corner(to, neighbours.at(to))) {
        const auto& next = neighbours.at(to);
        to = next[0] == all.back().end()[-2] ? next[1] : next[0];
        walked.insert(std::minmax(all.back().back(), to));
        all.back().push_back(to);
      }
    };
    for (const auto& [vertex, others] : neighbours)
      if (is_corner(vertex, others))
        for (const int other : others) walk(vertex, other);
    for (const auto& [vertex, others] : neighbours) walk(vertex, others.front());  // what is left are closed lines
    return all;
  }

 private:
  struct Edge {
    std::array<int, 2> triangles = {-1, -1};
    bool is_sharp = false;
  };
  static constexpr double fold_deg = 150.0;

  Vector3 area_vector(int t) const {
    const auto& [a, b, c] = surface_.triangles[std::size_t(t)];
    const auto& v = surface_.vertices;
    return 0.5 * (v[std::size_t(b)] - v[std::size_t(a)]).cross(v[std::size_t(c)] - v[std::size_t(a)]);
  }

  static double angle_deg(const Vector3& a, const Vector3& b) {
    return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
  }

  void mark() {
    for (int t = 0; t < int(surface_.triangles.size()); ++t)
      for (int k = 0; k < 3; ++k) {
        const auto& triangle = surface_.triangles[std::size_t(t)];
        Edge& edge = edges_[std::minmax(triangle[k], triangle[(k + 1) % 3])];
        edge.triangles[edge.triangles[0] >= 0] = t;
      }
    for (auto& [ends, edge] : edges_) {
      const double angle = angle_deg(area_vector(edge.triangles[0]), area_vector(edge.triangles[1]));
      edge.is_sharp = angle > angle_deg_ && angle < fold_deg;
    }
  }

  void drop_loose_ends() {
    std::vector<int> degree(surface_.vertices.size(), 0);
    for (const auto& [ends, edge] : edges_)
      if (edge.is_sharp) ++degree[std::size_t(ends.first)], ++degree[std::size_t(ends.second)];
    for (bool changed = true; changed;) {
      changed = false;
      for (auto& [ends, edge] : edges_) {
        if (!edge.is_sharp || (degree[std::size_t(ends.first)] > 1 && degree[std::size_t(ends.second)] > 1)) continue;
        --degree[std::size_t(ends.first)], --degree[std::size_t(ends.second)];
        edge.is_sharp = false;
        changed = true;
      }
    }
  }

  /// Patches are what sharp edges bound. Returns true where something was dropped.
  bool drop_small_patches(double least_area) {
    DisjointSets patches(surface_.triangles.size());
    for (const auto& [ends, edge] : edges_)
      if (!edge.is_sharp) patches.join(edge.triangles[1], edge.triangles[0]);
    std::vector<double> areas(surface_.triangles.size(), 0.0);
    const auto area = [&](int t) -> double& { return areas[std::size_t(patches.root(t))]; };
    for (int t = 0; t < int(areas.size()); ++t) area(t) += area_vector(t).norm();
    bool dropped = false;
    for (auto& [ends, edge] : edges_) {
      if (!edge.is_sharp || std::min(area(edge.triangles[0]), area(edge.triangles[1])) >= least_area) continue;
      edge.is_sharp = false;
      dropped = true;
    }
    return dropped;
  }

  /// Where lines meet or one turns as sharply as surfaces have to.
  bool is_corner(int vertex, const std::vector<int>& others) const {
    if (others.size() != 2) return true;
    const auto at = [&](int v) -> const Vector3& { return surface_.vertices[std::size_t(v)]; };
    return angle_deg(at(vertex) - at(others[0]), at(others[1]) - at(vertex)) > angle_deg_;
  }

  const TriangleMesh& surface_;
  double angle_deg_;
  std::map<std::pair<int, int>, Edge> edges_;
};

}  // namespace

std::vector<std::vector<int>> sharp_lines(const TriangleMesh& surface, double angle_deg, double cell_size) {
  return SharpEdges(surface, angle_deg, cell_size).lines();
}

}  // namespace pliant
