#include "meshing/part_boundary.hpp"

#include <algorithm>
#include <cmath>

#include "mesh/tet_boundary.hpp"

namespace pliant {

namespace {

using Tet = std::array<int, 4>;
using Edge = std::array<int, 2>;

constexpr double no_distance = 1e-3;    // of an edge: its end inside lies on the boundary already
constexpr double reach_of_node = 0.45;  // of an edge, over which its end outside is moved
constexpr double least_volume = 0.2;    // of an element, that a moved node leaves of it
constexpr int bisections = 40;          // of an edge, to where it crosses the boundary
constexpr int looks = 8;                // at an edge whose ends are outside

double volume(const std::vector<Vector3>& x, const Tet& t) {
  return (x[std::size_t(t[1])] - x[std::size_t(t[0])])
             .cross(x[std::size_t(t[2])] - x[std::size_t(t[0])])
             .dot(x[std::size_t(t[3])] - x[std::size_t(t[0])]) /
         6.0;
}

class Follower {
 public:
  Follower(std::vector<Vector3>& nodes, std::vector<Tet>& tets, const std::function<bool(const Vector3&)>& contains,
           double tolerance)
      : nodes_(nodes), tets_(tets), contains_(contains), tolerance_(tolerance) {}

  void run() {
    enter();
    move_nodes();
    for (const Edge& edge : crossing()) split(edge, crossing_of(edge));
  }

 private:
  const Vector3& at(int n) const { return nodes_[std::size_t(n)]; }

  /// Edges with one end inside, the other out and neither on the boundary: the end inside comes first.
  std::vector<Edge> crossing() const {
    std::vector<Edge> edges;
    for (const Tet& t : tets_)
      for (const auto& [i, j] : tet_edges) {
        const int a = t[std::size_t(i)], b = t[std::size_t(j)];
        if (inside_[std::size_t(a)] == inside_[std::size_t(b)]) continue;
        const Edge edge = inside_[std::size_t(a)] ? Edge{a, b} : Edge{b, a};
        if (!on_[std::size_t(edge[0])]) edges.push_back(edge);
      }
    std::ranges::sort(edges);
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
  }

  /// The last point inside, from the end inside.
  Vector3 crossing_of(const Edge& edge) const {
    double low = 0.0, high = 1.0;
    for (int i = 0; i < bisections; ++i) {
      const double middle = 0.5 * (low + high);
      (contains_(at(edge[0]) + middle * (at(edge[1]) - at(edge[0]))) ? low : high) = middle;
    }
    return at(edge[0]) + low * (at(edge[1]) - at(edge[0]));
  }

  void look() {
    inside_.resize(nodes_.size());
    on_.assign(nodes_.size(), false);
    for (std::size_t n = 0; n < nodes_.size(); ++n) inside_[n] = contains_(nodes_[n]);
    star_.assign(nodes_.size(), {});
    for (std::size_t t = 0; t < tets_.size(); ++t)
      for (const int n : tets_[t]) star_[std::size_t(n)].push_back(int(t));
    boundary_.assign(nodes_.size(), {});
    for (const TetFace& face : boundary_faces(tets_)) {
      const std::array<int, 3> corners = face.corners(tets_);
      for (const int n : corners) boundary_[std::size_t(n)].push_back(corners);
    }
  }

  bool is_boundary_edge(int a, int b) const {
    return std::ranges::any_of(boundary_[std::size_t(a)],
                               [&](const auto& face) { return std::ranges::find(face, b) != face.end(); });
  }

  /// How far the surface changes where one of its nodes moves: the distance of where it was from the faces that it
  /// then has, and of where it is then from those that it had.
  bool keeps_surface(int n, int towards, const Vector3& place) const {
    const auto& faces = boundary_[std::size_t(n)];
    if (faces.empty()) return true;
    if (!is_boundary_edge(n, towards)) return false;
    return std::ranges::all_of(faces, [&](const std::array<int, 3>& face) {
      const auto corner = [&](int k) -> const Vector3& { return face[std::size_t(k)] == n ? place : at(face[k]); };
      const Vector3 before = (at(face[1]) - at(face[0])).cross(at(face[2]) - at(face[0]));
      const Vector3 after = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      if (!(after.dot(before) > 0.0)) return false;
      return std::abs(after.normalized().dot(at(n) - place)) <= tolerance_ &&
             std::abs(before.normalized().dot(place - at(n))) <= tolerance_;
    });
  }

  /// Whether all elements of a node keep some volume where it moves.
  bool keeps_elements(int n, const Vector3& place) {
    const Vector3 was = at(n);
    std::vector<double> before;
    for (const int t : star_[std::size_t(n)]) before.push_back(volume(nodes_, tets_[std::size_t(t)]));
    nodes_[std::size_t(n)] = place;
    bool keeps = true;
    for (std::size_t k = 0; k < before.size() && keeps; ++k)
      keeps = volume(nodes_, tets_[std::size_t(star_[std::size_t(n)][k])]) > least_volume * before[k];
    nodes_[std::size_t(n)] = was;
    return keeps;
  }

  /// Ends outside, nearest first. Those inside stay: elements inside may become thin, and do no harm there.
  void move_nodes() {
    look();
    struct Move {
      double part;
      int node, towards;
      Vector3 place;
    };
    std::vector<Move> moves;
    for (const Edge& edge : crossing()) {
      const Vector3 place = crossing_of(edge);
      const double part = (place - at(edge[0])).norm() / (at(edge[1]) - at(edge[0])).norm();
      if (part < no_distance) on_[std::size_t(edge[0])] = true;
      if (1.0 - part < reach_of_node) moves.push_back({1.0 - part, edge[1], edge[0], place});
    }
    std::ranges::stable_sort(moves, {}, &Move::part);
    for (const Move& m : moves) {
      if (on_[std::size_t(m.node)] || on_[std::size_t(m.towards)]) continue;
      if (!keeps_surface(m.node, m.towards, m.place) || !keeps_elements(m.node, m.place)) continue;
      nodes_[std::size_t(m.node)] = m.place;
      inside_[std::size_t(m.node)] = on_[std::size_t(m.node)] = true;
    }
  }

  /// A node on an edge, inside the part, which divides the elements around it.
  void split(const Edge& edge, const Vector3& place) {
    const int middle = int(nodes_.size());
    nodes_.push_back(place);
    inside_.push_back(true), on_.push_back(true);
    const std::size_t count = tets_.size();
    for (std::size_t t = 0; t < count; ++t) {
      Tet one = tets_[t], other = tets_[t];
      const auto a = std::ranges::find(one, edge[0]), b = std::ranges::find(other, edge[1]);
      if (a == one.end() || b == other.end()) continue;
      *a = middle, *b = middle;
      tets_[t] = one;
      tets_.push_back(other);
    }
  }

  /// Where the part is so small that an edge passes through it and has no end inside, it gets a node there.
  void enter() {
    look();
    std::vector<Edge> edges;
    for (const Tet& t : tets_)
      for (const auto& [i, j] : tet_edges) {
        const auto [a, b] = std::minmax(t[std::size_t(i)], t[std::size_t(j)]);
        if (!inside_[std::size_t(a)] && !inside_[std::size_t(b)]) edges.push_back({a, b});
      }
    std::ranges::sort(edges);
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (const Edge& edge : edges)
      for (int k = 1; k < looks; ++k) {
        const Vector3 place = at(edge[0]) + double(k) / looks * (at(edge[1]) - at(edge[0]));
        if (!contains_(place)) continue;
        split(edge, place);
        break;
      }
  }

  std::vector<Vector3>& nodes_;
  std::vector<Tet>& tets_;
  const std::function<bool(const Vector3&)>& contains_;
  double tolerance_;
  std::vector<bool> inside_, on_;  // of each node: on the boundary of the part
  std::vector<std::vector<int>> star_;
  std::vector<std::vector<std::array<int, 3>>> boundary_;  // faces of the mesh's surface at each node
};

}  // namespace

void follow_part(std::vector<Vector3>& nodes, std::vector<std::array<int, 4>>& tets,
                 const std::function<bool(const Vector3&)>& contains, double tolerance) {
  Follower(nodes, tets, contains, tolerance).run();
}

}  // namespace pliant
