#include "meshing/tet_improve.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>

#include "mesh/tet_shape.hpp"

namespace pliant {

namespace {

using Tet = std::array<int, 4>;

constexpr double perfect = 2.0;      // more than any quality
constexpr double least_gain = 1e-3;  // relative: changes that gain less could go round in circles
constexpr double flat_deg = 20.0;    // between the normals of boundary faces that may be exchanged

/// The least sine of a dihedral angle: 0 where an element is flat, negative where it is inverted.
double quality_of(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const std::array<const Vector3*, 4> x = {&a, &b, &c, &d};
  std::array<double, 4> area;  // times two
  for (int f = 0; f < 4; ++f) {
    const auto& [i, j, k] = tet_faces[f];
    area[f] = (*x[j] - *x[i]).cross(*x[k] - *x[i]).norm();
  }
  const double volume = (b - a).cross(c - a).dot(d - a);  // times six
  double least = std::numeric_limits<double>::max();
  for (int m = 0; m < 6; ++m) {
    const auto& [i, j] = tet_edges[m];
    const auto& [k, l] = tet_edges[5 - m];  // the faces that meet at edge ij are those opposite k and l
    least = std::min(least, (*x[i] - *x[j]).norm() / (area[k] * area[l]));
  }
  return std::isfinite(least) ? volume * least : 0.0;
}

class Improver {
 public:
  Improver(std::vector<Vector3>& nodes, std::vector<Tet>& tets, const TetImprovement& options)
      : nodes_(nodes), tets_(tets), options_(options), alive_(tets.size(), true), star_(nodes.size()) {
    for (int t = 0; t < int(tets.size()); ++t)
      for (const int n : tets[std::size_t(t)]) star_[std::size_t(n)].push_back(t);
  }

  void run() {
    const double good = std::sin(options_.least_dihedral_deg * std::numbers::pi / 180.0);
    for (int pass = 0; pass < 30; ++pass) {
      std::vector<std::pair<double, int>> bad;
      for (int t = 0; t < int(tets_.size()); ++t)
        if (alive_[std::size_t(t)])
          if (const double q = quality(tet(t)); q < good) bad.emplace_back(q, t);
      std::ranges::sort(bad);
      bool changed = false;
      for (const auto& [q, t] : bad)
        if (alive_[std::size_t(t)]) changed |= work_on(t);
      if (!changed) break;
    }
    std::vector<Tet> kept;
    for (std::size_t t = 0; t < tets_.size(); ++t)
      if (alive_[t]) kept.push_back(tets_[t]);
    tets_ = std::move(kept);
  }

 private:
  const Tet& tet(int t) const { return tets_[std::size_t(t)]; }
  const Vector3& at(int n) const { return nodes_[std::size_t(n)]; }
  double quality(const Tet& t) const { return quality_of(at(t[0]), at(t[1]), at(t[2]), at(t[3])); }
  double worst(const std::vector<Tet>& tets) const {
    double least = perfect;
    for (const Tet& t : tets) least = std::min(least, quality(t));
    return least;
  }
  double worst(const std::vector<int>& tets) const {
    double least = perfect;
    for (const int t : tets) least = std::min(least, quality(tet(t)));
    return least;
  }
  static bool is_gain(double before, double after) {
    return after > 0.0 && after > before + least_gain * std::abs(before);
  }
  static bool holds(const Tet& t, int node) { return std::ranges::find(t, node) != t.end(); }

  /// Elements that hold all given nodes.
  template <std::size_t K>
  std::vector<int> around(const std::array<int, K>& nodes) const {
    std::vector<int> found;
    for (const int t : star_[std::size_t(nodes[0])])
      if (std::ranges::all_of(nodes, [&](int n) { return holds(tet(t), n); })) found.push_back(t);
    return found;
  }

  void replace(const std::vector<int>& old, const std::vector<Tet>& by) {
    for (const int t : old) {
      alive_[std::size_t(t)] = false;
      for (const int n : tet(t)) std::erase(star_[std::size_t(n)], t);
    }
    for (const Tet& t : by) {
      for (const int n : t) star_[std::size_t(n)].push_back(int(tets_.size()));
      tets_.push_back(t);
      alive_.push_back(true);
    }
  }

  bool work_on(int t) {
    const Tet nodes = tet(t);
    for (const auto& [i, j] : tet_edges)
      if (remove_edge(nodes[i], nodes[j])) return true;
    for (const auto& [i, j, k] : tet_faces)
      if (remove_face({nodes[i], nodes[j], nodes[k]})) return true;
    if (std::ranges::any_of(nodes, [&](int n) { return move(n); })) return true;
    for (int m = 0; m < 3; ++m) {
      const auto& [i, j] = tet_edges[std::size_t(m)];
      const auto& [k, l] = tet_edges[std::size_t(5 - m)];
      if (join_edges({nodes[i], nodes[j]}, {nodes[k], nodes[l]})) return true;
    }
    return false;
  }

  // ---- an edge: its elements are replaced by a triangulation of the ring around it, with either end

  struct Ring {
    std::vector<int> nodes;  // (a, b, node, next node) is positively oriented
    bool is_closed = true;   // open: the edge lies on the boundary
  };

  /// Nothing where the elements around the edge are not one fan.
  std::optional<Ring> ring(int a, int b, const std::vector<int>& fan) const {
    std::vector<std::array<int, 2>> arcs;
    for (const int t : fan) {
      Tet order = tet(t);  // to (a, b, p, q) by swaps of pairs, which keep the orientation when there are two
      int swaps = 0;
      const auto bring = [&](int node, std::size_t place) {
        const auto found = std::size_t(std::ranges::find(order, node) - order.begin());
        if (found != place) std::swap(order[found], order[place]), ++swaps;
      };
      bring(a, 0);
      bring(b, 1);
      if (swaps % 2 == 1) std::swap(order[2], order[3]);
      arcs.push_back({order[2], order[3]});
    }
    Ring result;
    auto start = arcs.begin();
    for (auto arc = arcs.begin(); arc != arcs.end(); ++arc)
      if (std::ranges::none_of(arcs, [&](const auto& other) { return other[1] == (*arc)[0]; })) {
        start = arc;
        result.is_closed = false;
      }
    result.nodes = {(*start)[0], (*start)[1]};
    arcs.erase(start);
    while (!arcs.empty()) {
      const auto next = std::ranges::find(arcs, result.nodes.back(), [](const auto& arc) { return arc[0]; });
      if (next == arcs.end()) return std::nullopt;
      result.nodes.push_back((*next)[1]);
      arcs.erase(next);
    }
    if (result.is_closed && result.nodes.back() != result.nodes.front()) return std::nullopt;
    if (result.is_closed) result.nodes.pop_back();
    return result;
  }

  /// The triangulation of the ring whose worst element is best, by dynamic programming over its chords (Klincsek 1980).
  std::vector<Tet> fill(int a, int b, const std::vector<int>& ring) const {
    const int m = int(ring.size());
    std::vector<double> best(std::size_t(m * m), perfect);
    std::vector<int> apex(std::size_t(m * m), -1);
    const auto pair = [&](int i, int k, int j) {
      const int p = ring[std::size_t(i)], q = ring[std::size_t(k)], r = ring[std::size_t(j)];
      return std::array<Tet, 2>{Tet{p, q, r, b}, Tet{p, r, q, a}};
    };
    for (int length = 2; length < m; ++length)
      for (int i = 0; i + length < m; ++i) {
        const int j = i + length;
        best[std::size_t(i * m + j)] = -perfect;
        for (int k = i + 1; k < j; ++k) {
          const auto [above, below] = pair(i, k, j);
          const double q =
              std::min({quality(above), quality(below), best[std::size_t(i * m + k)], best[std::size_t(k * m + j)]});
          if (q > best[std::size_t(i * m + j)]) best[std::size_t(i * m + j)] = q, apex[std::size_t(i * m + j)] = k;
        }
      }
    std::vector<Tet> tets;
    std::vector<std::array<int, 2>> open = {{0, m - 1}};
    while (!open.empty()) {
      const auto [i, j] = open.back();
      open.pop_back();
      const int k = apex[std::size_t(i * m + j)];
      if (k < 0) continue;
      for (const Tet& t : pair(i, k, j)) tets.push_back(t);
      open.push_back({i, k});
      open.push_back({k, j});
    }
    return tets;
  }

  bool remove_edge(int a, int b) {
    const std::vector<int> fan = around<2>({a, b});
    if (fan.size() > 8) return false;
    const std::optional<Ring> found = ring(a, b, fan);
    if (!found || (found->is_closed && found->nodes.size() < 3)) return false;
    if (!found->is_closed && !may_exchange(a, b, *found)) return false;
    const std::vector<Tet> by = fill(a, b, found->nodes);
    if (!is_gain(worst(fan), worst(by))) return false;
    replace(fan, by);
    return true;
  }

  /// True where the boundary faces at edge ab may be exchanged for those at the chord between the ring's ends.
  bool may_exchange(int a, int b, const Ring& open) const {
    const int first = open.nodes.front(), last = open.nodes.back();
    const auto normal = [&](int i, int j, int k) -> Vector3 {
      return (at(j) - at(i)).cross(at(k) - at(i)).normalized();
    };
    // (a, b, first, ...) is positively oriented and `first` is reached first: face a b first looks out of the mesh.
    const std::array<Vector3, 4> normals = {normal(a, first, b), normal(a, b, last), normal(a, first, last),
                                            normal(b, last, first)};
    for (const Vector3& n : normals)
      for (const Vector3& other : normals)
        if (!(n.dot(other) > std::cos(flat_deg * std::numbers::pi / 180.0))) return false;
    const Vector3 across = (at(b) - at(a)).cross(at(last) - at(first));
    if (std::abs(across.normalized().dot(at(first) - at(a))) > options_.surface_tolerance) return false;
    // The chord must not be an edge of the boundary already, and no node may be left without elements.
    if (is_boundary_edge(first, last)) return false;
    return open.nodes.size() > 2 || (star_[std::size_t(a)].size() > 1 && star_[std::size_t(b)].size() > 1);
  }

  bool is_boundary_edge(int a, int b) const {
    const std::vector<int> fan = around<2>({a, b});
    for (const int t : fan)
      for (const int n : tet(t))
        if (n != a && n != b && around<3>({a, b, n}).size() == 1) return true;
    return false;
  }

  // ---- a face: two elements beside it become three around the edge between their far nodes

  bool remove_face(const std::array<int, 3>& face) {
    const std::vector<int> pair = around<3>(face);
    if (pair.size() != 2) return false;
    std::array<int, 2> far;
    for (int s = 0; s < 2; ++s)
      far[std::size_t(s)] = *std::ranges::find_if(tet(pair[std::size_t(s)]),
                                                  [&](int n) { return std::ranges::find(face, n) == face.end(); });
    if (!around<2>({far[0], far[1]}).empty()) return false;
    std::vector<Tet> by;
    for (int k = 0; k < 3; ++k) {
      Tet t = {far[0], far[1], face[std::size_t(k)], face[std::size_t((k + 1) % 3)]};
      if (quality(t) < 0.0) std::swap(t[2], t[3]);
      by.push_back(t);
    }
    // Three positive elements fill the two only where the edge passes through the face.
    double before = 0.0, after = 0.0;
    for (const int t : pair) before += volume(tet(t));
    for (const Tet& t : by) after += volume(t);
    if (std::abs(after - before) > 1e-9 * after || !is_gain(worst(pair), worst(by))) return false;
    replace(pair, by);
    return true;
  }

  double volume(const Tet& t) const {
    return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).dot(at(t[3]) - at(t[0])) / 6.0;
  }

  // ---- opposite edges of a flat element that cross: one node between them divides both, and the element is gone

  bool join_edges(const std::array<int, 2>& one, const std::array<int, 2>& other) {
    if (is_boundary_edge(one[0], one[1]) || is_boundary_edge(other[0], other[1])) return false;
    const std::optional<Vector3> crossing = between(one, other);
    if (!crossing) return false;
    const int middle = int(nodes_.size());
    std::vector<int> old;
    std::vector<Tet> by;
    nodes_.push_back(*crossing);
    for (const auto& edge : {one, other})
      for (const int t : around<2>(edge)) {
        if (std::ranges::find(old, t) == old.end()) old.push_back(t);
        if (holds(tet(t), one[0]) && holds(tet(t), one[1]) && holds(tet(t), other[0]) && holds(tet(t), other[1]))
          continue;
        for (const int end : edge) {
          by.push_back(tet(t));
          std::ranges::replace(by.back(), end, middle);
        }
      }
    double before = 0.0, after = 0.0;
    for (const int t : old) before += volume(tet(t));
    for (const Tet& t : by) after += volume(t);
    if (std::abs(after - before) > 1e-9 * after || !is_gain(worst(old), worst(by))) {
      nodes_.pop_back();
      return false;
    }
    star_.emplace_back();
    replace(old, by);
    move(middle);
    return true;
  }

  /// The middle of the two edges' closest points, where both lie well within the edges.
  std::optional<Vector3> between(const std::array<int, 2>& one, const std::array<int, 2>& other) const {
    const Vector3 u = at(one[1]) - at(one[0]), v = at(other[1]) - at(other[0]), w = at(other[0]) - at(one[0]);
    const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), determinant = uu * vv - uv * uv;
    if (!(determinant > 1e-6 * uu * vv)) return std::nullopt;
    const double s = (w.dot(u) * vv - w.dot(v) * uv) / determinant, t = (w.dot(u) * uv - w.dot(v) * uu) / determinant;
    if (!(std::min({s, t, 1.0 - s, 1.0 - t}) > 0.05)) return std::nullopt;
    return 0.5 * (at(one[0]) + s * u + at(other[0]) + t * v);
  }

  // ---- a node inside: a pattern search for the place where its worst element is best

  bool is_inside(int n) const {
    for (const int t : star_[std::size_t(n)])
      for (const auto& [i, j, k] : tet_faces) {
        const std::array<int, 3> face = {tet(t)[i], tet(t)[j], tet(t)[k]};
        if (std::ranges::find(face, n) != face.end() && around<3>(face).size() < 2) return false;
      }
    return true;
  }

  bool move(int n) {
    const std::vector<int>& star = star_[std::size_t(n)];
    if (!is_inside(n)) return false;
    const Vector3 start = at(n);
    Vector3 place = start;
    double reach = 0.0;
    for (const int t : star)
      for (const int other : tet(t)) reach = std::max(reach, (at(other) - start).norm());
    const double before = worst(star);
    double best = before;
    for (double step = 0.2 * reach; step > 0.01 * reach; step *= 0.5)
      for (int d = 0; d < 6; ++d) {
        nodes_[std::size_t(n)] = place + (d < 3 ? step : -step) * Vector3::Unit(d % 3);
        if (const double q = worst(star); q > best) best = q, place = at(n);
      }
    nodes_[std::size_t(n)] = is_gain(before, best) ? place : start;
    return is_gain(before, best);
  }

  std::vector<Vector3>& nodes_;
  std::vector<Tet>& tets_;
  TetImprovement options_;
  std::vector<bool> alive_;
  std::vector<std::vector<int>> star_;  // elements that are alive of each node
};

}  // namespace

void improve(std::vector<Vector3>& nodes, std::vector<std::array<int, 4>>& tets, const TetImprovement& options) {
  Improver(nodes, tets, options).run();
}

}  // namespace pliant
