#include "geometry/solid_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numeric>
#include <optional>
#include <set>
#include <unordered_map>

#include "base/disjoint_sets.hpp"
#include "geometry/mesh_edges.hpp"
#include "geometry/mesh_io.hpp"

namespace pliant {

namespace {

constexpr double single_rounding = 0x1p-21;  // of the greatest coordinate: corners that single precision tore apart
constexpr double least_tolerance = 1e-7, most_tolerance = 1e-4;  // of the diagonal of the surface's box
constexpr double crumb = 0.01;                                   // of the greatest part

using Triangle = std::array<int, 3>;

std::string text_of(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

std::string counted(std::size_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

/// "0.008 m at (0.45, 0.55, 0.1)"
std::string place_of(const Shell& shell) {
  const Vector3 centre = 0.5 * (shell.box.min + shell.box.max);
  return text_of(shell.box.extent().maxCoeff()) + " m at (" + text_of(centre.x()) + ", " + text_of(centre.y()) + ", " +
         text_of(centre.z()) + ")";
}

std::string places_of(const std::vector<const Shell*>& shells) {
  constexpr std::size_t most = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(most, shells.size()); ++i) text += (i == 0 ? "" : ", ") + place_of(*shells[i]);
  return shells.size() > most ? text + " and " + std::to_string(shells.size() - most) + " more" : text;
}

struct Faults {
  std::size_t open_edges = 0, crowded_edges = 0;  // of one triangle; of more than two
  std::size_t count() const { return open_edges + crowded_edges; }
};

Faults faults_of(const TriangleMesh& mesh) {
  Faults faults;
  const std::vector<EdgeUse> uses = edge_uses(mesh);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    faults.open_edges += edge.size() == 1;
    faults.crowded_edges += edge.size() > 2;
  });
  return faults;
}

std::vector<int> vertices_of_open_edges(const TriangleMesh& mesh) {
  std::vector<bool> is_open(mesh.vertices.size(), false);
  const std::vector<EdgeUse> uses = edge_uses(mesh);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    if (edge.size() == 1) is_open[std::size_t(edge[0].low)] = is_open[std::size_t(edge[0].high)] = true;
  });
  std::vector<int> vertices;
  for (std::size_t v = 0; v < is_open.size(); ++v)
    if (is_open[v]) vertices.push_back(int(v));
  return vertices;
}

/// Sets of vertices that lie within a tolerance of one another; those of each cell of a lattice and of its neighbours
/// are compared.
class Joiner {
 public:
  Joiner(const TriangleMesh& mesh, double tolerance)
      : mesh_(mesh), tolerance_(tolerance), sets_(mesh.vertices.size()) {}

  void join(const std::vector<int>& vertices) {
    std::vector<int> next(vertices.size(), -1);  // of the same cell
    std::unordered_map<std::uint64_t, int> first;
    first.reserve(vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const Vector3& p = position(vertices[i]);
      for_each_cell(p, [&](std::uint64_t cell) {
        const auto found = first.find(cell);
        for (int other = found == first.end() ? -1 : found->second; other >= 0; other = next[std::size_t(other)])
          if ((position(vertices[std::size_t(other)]) - p).norm() <= tolerance_)
            sets_.join(vertices[std::size_t(other)], vertices[i]);
      });
      const auto [found, is_new] = first.try_emplace(hash(cell_of(p)), int(i));
      if (is_new) continue;
      if (position(vertices[std::size_t(found->second)]) == p) continue;  // who is near to one is near to the other
      next[i] = found->second, found->second = int(i);
    }
  }

  /// The mesh with the first vertex of each set in the place of all. Nothing where two ends of an edge would be one.
  std::optional<TriangleMesh> joined() {
    std::vector<int> kept(mesh_.vertices.size(), -1);  // by the set's root
    TriangleMesh mesh = mesh_;
    for (std::size_t v = 0; v < kept.size(); ++v) {
      int& first = kept[std::size_t(sets_.root(int(v)))];
      if (first < 0) first = int(v);
    }
    for (Triangle& triangle : mesh.triangles) {
      const Triangle before = triangle;
      for (int& v : triangle) v = kept[std::size_t(sets_.root(v))];
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t l = (k + 1) % 3;
        if (triangle[k] == triangle[l] && position(before[k]) != position(before[l])) return std::nullopt;
      }
    }
    return mesh;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;

  const Vector3& position(int v) const { return mesh_.vertices[std::size_t(v)]; }
  Cell cell_of(const Vector3& p) const {
    Cell cell;
    for (int d = 0; d < 3; ++d)
      cell[std::size_t(d)] = tolerance_ > 0.0 ? std::int64_t(std::floor(p[d] / tolerance_))
                                              : std::int64_t(std::hash<double>()(p[d] + 0.0));  // -0 is 0
    return cell;
  }
  static std::uint64_t hash(const Cell& cell) {
    std::uint64_t value = 0;
    for (const std::int64_t i : cell) value = (value ^ std::uint64_t(i)) * 0x9E3779B97F4A7C15U, value ^= value >> 29U;
    return value;
  }
  template <class Visit>
  void for_each_cell(const Vector3& p, Visit&& visit) const {
    const Cell middle = cell_of(p);
    if (tolerance_ <= 0.0) return visit(hash(middle));
    for (int n = 0; n < 27; ++n) visit(hash({middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1}));
  }

  const TriangleMesh& mesh_;
  double tolerance_;
  DisjointSets sets_;
};

/// Without triangles that are an edge or a point, and those that are there once more.
TriangleMesh without_repeated(const TriangleMesh& mesh) {
  TriangleMesh result{mesh.vertices, {}};
  std::set<Triangle> seen;
  for (const Triangle& triangle : mesh.triangles) {
    Triangle sorted = triangle;
    std::ranges::sort(sorted);
    if (sorted[0] == sorted[1] || sorted[1] == sorted[2] || !seen.insert(sorted).second) continue;
    result.triangles.push_back(triangle);
  }
  return result;
}

class Mender {
 public:
  explicit Mender(TriangleMesh mesh) : mesh_(std::move(mesh)) {}

  SolidSurface run() {
    const bool is_finite = std::ranges::all_of(mesh_.vertices, [](const Vector3& v) { return v.allFinite(); });
    if (mesh_.triangles.empty() || !is_finite) return {std::move(mesh_), {}};
    faults_ = faults_of(mesh_);
    leave_out_repeated();
    join_corners();
    shells_ = shells_of(mesh_);
    leave_out_open_crumbs();
    if (std::ranges::all_of(shells_, &Shell::is_closed)) {
      agree_on_sides();
      leave_out_copies();
      face_outwards();
      leave_out_crumbs();
      tell_parts();
    }
    move_unused_vertices();
    return {std::move(mesh_), std::move(remarks_)};
  }

 private:
  void join_corners() {
    if (faults_.open_edges == 0) return;
    Box box;
    double farthest = 0.0;
    for (const Triangle& triangle : mesh_.triangles)
      for (const int v : triangle) {
        box.extend(mesh_.vertices[std::size_t(v)]);
        farthest = std::max(farthest, mesh_.vertices[std::size_t(v)].cwiseAbs().maxCoeff());
      }
    const double diagonal = box.extent().norm();
    const std::vector<int> open = vertices_of_open_edges(mesh_);
    const TriangleMesh before = mesh_;
    double used = 0.0, tolerance = 0.0;
    while (faults_.open_edges > 0 && tolerance <= most_tolerance * diagonal) {
      Joiner joiner(before, tolerance);
      joiner.join(open);
      std::optional<TriangleMesh> joined = joiner.joined();
      if (!joined) break;
      joined = without_repeated(*joined);
      if (joined->triangles.empty()) break;
      if (const Faults faults = faults_of(*joined); faults.count() < faults_.count())
        faults_ = faults, mesh_ = std::move(*joined), used = tolerance;
      tolerance = tolerance > 0.0 ? 10.0 * tolerance : std::max(least_tolerance * diagonal, single_rounding * farthest);
      if (tolerance == 0.0) break;  // all corners lie at the origin
    }
    if (mesh_ == before) return;
    joined_ = used_in(before);
    const std::vector<bool> left = used_in(mesh_);
    std::size_t corners = 0;
    for (std::size_t v = 0; v < left.size(); ++v) joined_[v] = joined_[v] && !left[v], corners += joined_[v];
    remarks_.push_back(counted(corners, "corner", "corners") +
                       (used > 0.0 ? " within " + text_of(used) + " m of others" : " at the very places of others") +
                       " joined to them");
    if (const std::size_t fewer = before.triangles.size() - mesh_.triangles.size(); fewer > 0)
      remarks_.push_back(counted(fewer, "triangle", "triangles") + " without area, or there twice, left out");
  }

  static std::vector<bool> used_in(const TriangleMesh& mesh) {
    std::vector<bool> used(mesh.vertices.size(), false);
    for (const Triangle& triangle : mesh.triangles)
      for (const int v : triangle) used[std::size_t(v)] = true;
    return used;
  }

  void leave_out_repeated() {
    if (faults_.count() == 0) return;  // one triangle more would crowd an edge
    TriangleMesh fewer = without_repeated(mesh_);
    const std::size_t count = mesh_.triangles.size() - fewer.triangles.size();
    if (count == 0 || fewer.triangles.empty()) return;
    const Faults faults = faults_of(fewer);
    if (faults.count() >= faults_.count()) return;
    faults_ = faults, mesh_ = std::move(fewer);
    remarks_.push_back(counted(count, "triangle", "triangles") + " without area, or there twice, left out");
  }

  void leave_out(const std::vector<const Shell*>& shells) {
    std::vector<bool> goes(mesh_.triangles.size(), false);
    for (const Shell* shell : shells)
      for (const int t : shell->triangles) goes[std::size_t(t)] = true;
    std::size_t kept = 0;
    for (std::size_t t = 0; t < goes.size(); ++t)
      if (!goes[t]) mesh_.triangles[kept++] = mesh_.triangles[t];
    mesh_.triangles.resize(kept);
    shells_ = shells_of(mesh_);
  }

  void leave_out_open_crumbs() {
    double greatest = 0.0;
    for (const Shell& shell : shells_)
      if (shell.is_closed) greatest = std::max(greatest, shell.area);
    std::vector<const Shell*> crumbs;
    for (const Shell& shell : shells_)
      if (!shell.is_closed && shell.area < crumb * greatest) crumbs.push_back(&shell);
    if (crumbs.empty()) return;
    remarks_.push_back(counted(crumbs.size(), "open crumb", "open crumbs") +
                       " beside the object left out: " + places_of(crumbs));
    leave_out(crumbs);
  }

  void turn(int t) { std::swap(mesh_.triangles[std::size_t(t)][1], mesh_.triangles[std::size_t(t)][2]); }

  /// Turns triangles until neighbours face one side, the fewer ones of each shell. Nothing of a shell of one side.
  void agree_on_sides() {
    struct Neighbour {
      int triangle;
      bool agrees;
    };
    const std::vector<EdgeUse> uses = edge_uses(mesh_);
    bool all_agree = true;
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
      all_agree = all_agree && edge[0].is_forward != edge[1].is_forward;
    });
    if (all_agree) return;
    std::vector<std::vector<Neighbour>> neighbours(mesh_.triangles.size());
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
      const bool agrees = edge[0].is_forward != edge[1].is_forward;
      neighbours[std::size_t(edge[0].triangle)].push_back({edge[1].triangle, agrees});
      neighbours[std::size_t(edge[1].triangle)].push_back({edge[0].triangle, agrees});
    });
    std::size_t turned = 0;
    std::vector<int> side(mesh_.triangles.size(), 0);  // 1: as the shell's first triangle, -1: against it
    for (const Shell& shell : shells_) {
      bool has_two_sides = true;
      std::vector<int> open = {shell.triangles.front()};
      side[std::size_t(open.front())] = 1;
      while (!open.empty()) {
        const int t = open.back();
        open.pop_back();
        for (const auto& [other, agrees] : neighbours[std::size_t(t)]) {
          const int expected = agrees ? side[std::size_t(t)] : -side[std::size_t(t)];
          if (side[std::size_t(other)] == 0)
            side[std::size_t(other)] = expected, open.push_back(other);
          else
            has_two_sides = has_two_sides && side[std::size_t(other)] == expected;
        }
      }
      if (!has_two_sides) continue;
      const auto against = std::ranges::count_if(shell.triangles, [&](int t) { return side[std::size_t(t)] < 0; });
      const int fewer = 2 * std::size_t(against) <= shell.triangles.size() ? -1 : 1;
      for (const int t : shell.triangles)
        if (side[std::size_t(t)] == fewer) turn(t), ++turned;
    }
    if (turned == 0) return;
    remarks_.push_back(counted(turned, "triangle that faced", "triangles that faced") +
                       " another side than the neighbours turned over");
    shells_ = shells_of(mesh_);
  }

  void leave_out_copies() {
    if (shells_.size() < 2) return;
    using Corners = std::array<std::array<double, 3>, 3>;
    std::set<Corners> seen;
    std::vector<const Shell*> copies;
    for (const Shell& shell : shells_) {
      std::vector<Corners> own;
      for (const int t : shell.triangles) {
        Corners corners;
        for (std::size_t k = 0; k < 3; ++k) {
          const Vector3& p = mesh_.vertices[std::size_t(mesh_.triangles[std::size_t(t)][k])];
          corners[k] = {p.x() + 0.0, p.y() + 0.0, p.z() + 0.0};
        }
        std::ranges::sort(corners);
        own.push_back(corners);
      }
      if (std::ranges::all_of(own, [&](const Corners& c) { return seen.contains(c); }))
        copies.push_back(&shell);
      else
        seen.insert(own.begin(), own.end());
    }
    if (copies.empty()) return;
    remarks_.push_back(counted(copies.size(), "part that is a copy of another", "parts that are copies of others") +
                       " left out: " + places_of(copies));
    leave_out(copies);
  }

  /// Of each shell those that it lies in.
  std::vector<std::vector<std::size_t>> around() const {
    std::vector<std::vector<std::size_t>> around(shells_.size());
    for (std::size_t i = 0; i < shells_.size(); ++i)
      for (std::size_t j = 0; j < shells_.size(); ++j)
        if (i != j && std::abs(shells_[j].volume) > std::abs(shells_[i].volume) &&
            lies_in(mesh_, shells_[i], shells_[j]))
          around[i].push_back(j);
    return around;
  }

  /// Turns shells that lie in no other and face inwards, and all that they hold: what was a cavity stays one.
  void face_outwards() {
    const auto outer = around();
    std::size_t turned = 0;
    for (std::size_t i = 0; i < shells_.size(); ++i) {
      std::size_t outermost = i;
      for (const std::size_t j : outer[i])
        if (outer[j].empty()) outermost = j;
      if (shells_[outermost].volume >= 0.0) continue;
      for (const int t : shells_[i].triangles) turn(t);
      ++turned;
    }
    if (turned == 0) return;
    remarks_.push_back(turned == shells_.size()
                           ? std::string("the triangles faced inwards; all are turned over")
                           : counted(turned, "part that faced inwards is", "parts that faced inwards are") +
                                 " turned over");
    shells_ = shells_of(mesh_);
  }

  const Shell& greatest() const { return *std::ranges::max_element(shells_, {}, &Shell::volume); }

  void leave_out_crumbs() {
    if (shells_.size() < 2) return;
    const double least = crumb * greatest().volume;
    std::vector<const Shell*> crumbs;
    double volume = 0.0;
    for (const Shell& shell : shells_)
      if (shell.volume >= 0.0 && shell.volume < least) crumbs.push_back(&shell), volume += shell.volume;
    if (crumbs.empty()) return;
    remarks_.push_back(counted(crumbs.size(), "crumb", "crumbs") + " of together " +
                       text_of(100.0 * volume / greatest().volume) +
                       " % of the object's volume left out: " + places_of(crumbs));
    leave_out(crumbs);
  }

  void tell_parts() {
    std::vector<const Shell*> parts;
    for (const Shell& shell : shells_)
      if (shell.volume > 0.0) parts.push_back(&shell);
    if (parts.size() < 2) return;
    remarks_.push_back("it is in " + std::to_string(parts.size()) + " parts that nothing joins: " + places_of(parts));
  }

  void move_unused_vertices() {
    const std::vector<bool> used = used_in(mesh_);
    const auto first = std::size_t(std::ranges::find(used, true) - used.begin());
    for (std::size_t v = 0; v < used.size(); ++v)
      if (!used[v] && (joined_.empty() || !joined_[v])) mesh_.vertices[v] = mesh_.vertices[first];
  }

  TriangleMesh mesh_;
  std::vector<std::string> remarks_;
  Faults faults_;
  std::vector<bool> joined_;  // to another vertex at their place; empty: none
  std::vector<Shell> shells_;
};

}  // namespace

SolidSurface mend(TriangleMesh mesh) { return Mender(std::move(mesh)).run(); }

TriangleMesh read_surface(const std::filesystem::path& path) { return mend(read_mesh(path)).mesh; }

}  // namespace pliant
