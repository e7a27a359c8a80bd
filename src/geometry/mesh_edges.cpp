#include "geometry/mesh_edges.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <tuple>

#include "base/disjoint_sets.hpp"
#include "geometry/box_tree.hpp"

namespace pliant {

namespace {

const Vector3& corner(const TriangleMesh& mesh, int triangle, int k) {
  return mesh.vertices[std::size_t(mesh.triangles[std::size_t(triangle)][std::size_t(k)])];
}

Box box_of(const TriangleMesh& mesh, int triangle) {
  Box box;
  for (int k = 0; k < 3; ++k) box.extend(corner(mesh, triangle, k));
  return box;
}

/// On a triangle, and on no line of a regular mesh.
Vector3 place_on(const TriangleMesh& mesh, int triangle) {
  return 0.2137 * corner(mesh, triangle, 0) + 0.3121 * corner(mesh, triangle, 1) + 0.4742 * corner(mesh, triangle, 2);
}

bool overlap(const Box& a, const Box& b) {
  return (a.min.array() <= b.max.array()).all() && (b.min.array() <= a.max.array()).all();
}

/// Six times the signed volume of a tetrahedron over the greatest that edges of these lengths could have.
double relative_volume(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const Vector3 u = b - a, v = c - a, w = d - a;
  const double most = u.norm() * v.norm() * w.norm();
  return most > 0.0 ? u.cross(v).dot(w) / most : 0.0;
}

/// Strictly: ends on both sides, and inside of the triangle.
bool goes_through(const Vector3& from, const Vector3& to, const TriangleMesh& mesh, int triangle) {
  constexpr double rounding = 1e-9;  // of a volume: what lies closer to a plane touches it
  const Vector3 &a = corner(mesh, triangle, 0), &b = corner(mesh, triangle, 1), &c = corner(mesh, triangle, 2);
  const double below = relative_volume(a, b, c, from), above = relative_volume(a, b, c, to);
  if (std::min(below, above) > -rounding || std::max(below, above) < rounding) return false;
  const double u = relative_volume(from, to, a, b), v = relative_volume(from, to, b, c),
               w = relative_volume(from, to, c, a);
  return std::min({u, v, w}) > rounding || std::max({u, v, w}) < -rounding;
}

bool edges_go_through(const TriangleMesh& mesh, const Shell& edges_of, const Shell& faces_of) {
  std::vector<int> faces;
  for (const int t : faces_of.triangles)
    if (overlap(box_of(mesh, t), edges_of.box)) faces.push_back(t);
  if (faces.empty()) return false;
  const BoxTree tree = box_tree(faces.size(), [&](std::size_t i) { return box_of(mesh, faces[i]); });
  std::vector<BoxTree::value_type> near;
  for (const int t : edges_of.triangles) {
    if (!overlap(box_of(mesh, t), faces_of.box)) continue;
    for (int k = 0; k < 3; ++k) {
      const Vector3 &from = corner(mesh, t, k), &to = corner(mesh, t, (k + 1) % 3);
      Box box;
      box.extend(from), box.extend(to);
      near.clear();
      tree.query(boost::geometry::index::intersects(TreeBox(tree_point(box.min), tree_point(box.max))),
                 std::back_inserter(near));
      for (const auto& [where, face] : near)
        if (goes_through(from, to, mesh, faces[std::size_t(face)])) return true;
    }
  }
  return false;
}

/// Whether places lie inside of a closed shell: by how often a ray along x from there goes out of it and into it.
class RayCounter {
 public:
  /// @param triangles  those of the shell that rays may meet
  RayCounter(const TriangleMesh& mesh, const Shell& shell, const std::vector<int>& triangles)
      : mesh_(mesh), shell_(shell), triangles_(triangles) {}

  bool is_inside(const Vector3& from) const {
    int winding = 0;
    for (const int t : triangles_) winding += crossing(from, t);
    return winding != 0;
  }
  /// With the triangles in a tree.
  bool is_inside(const Vector3& from, const BoxTree& tree) const {
    const Vector3 end(shell_.box.max.x(), from.y(), from.z());
    int winding = 0;
    for (auto hit = tree.qbegin(boost::geometry::index::intersects(TreeBox(tree_point(from), tree_point(end))));
         hit != tree.qend(); ++hit)
      winding += crossing(from, triangles_[std::size_t(hit->second)]);
    return from.x() <= end.x() && winding != 0;
  }

 private:
  int crossing(const Vector3& from, int t) const {
    const Vector3 &a = corner(mesh_, t, 0), &b = corner(mesh_, t, 1), &c = corner(mesh_, t, 2);
    const auto side = [&](const Vector3& p, const Vector3& q) {
      return (p.y() - from.y()) * (q.z() - from.z()) - (p.z() - from.z()) * (q.y() - from.y());
    };
    const double u = side(b, c), v = side(c, a), w = side(a, b), sum = u + v + w;
    const bool is_hit = sum > 0.0 ? std::min({u, v, w}) >= 0.0 : sum < 0.0 && std::max({u, v, w}) <= 0.0;
    if (!is_hit || (u * a.x() + v * b.x() + w * c.x()) / sum <= from.x()) return 0;
    return sum > 0.0 ? 1 : -1;
  }

  const TriangleMesh& mesh_;
  const Shell& shell_;
  const std::vector<int>& triangles_;
};

/// Whether a vertex or a triangle of one shell lies deeper in the other than rounding puts it. Of bodies that are
/// mirrored in a plane or flush edges meet edges, and go through no triangle.
bool reaches_into(const TriangleMesh& mesh, const Shell& shell, const Shell& other) {
  const double depth = 1e-6 * other.box.extent().norm();
  const BoxTree tree =
      box_tree(other.triangles.size(), [&](std::size_t i) { return box_of(mesh, other.triangles[i]); });
  const RayCounter rays(mesh, other, other.triangles);
  // Off the lines of regular meshes, along which rays would meet edges.
  static const Vector3 around[] = {{0.9, 0.31, 0.17},    {-0.9, -0.23, 0.29}, {0.19, 0.9, -0.27},
                                   {-0.13, -0.9, -0.21}, {0.11, -0.33, 0.9},  {0.37, 0.29, -0.9}};
  const auto is_deep = [&](const Vector3& p) {
    if ((p.array() < other.box.min.array()).any() || (p.array() > other.box.max.array()).any()) return false;
    return std::ranges::all_of(around, [&](const Vector3& off) { return rays.is_inside(p + depth * off, tree); });
  };
  std::vector<bool> seen(mesh.vertices.size(), false);
  for (const int t : shell.triangles) {
    if (is_deep(place_on(mesh, t))) return true;
    for (const int v : mesh.triangles[std::size_t(t)]) {
      if (!seen[std::size_t(v)] && is_deep(mesh.vertices[std::size_t(v)])) return true;
      seen[std::size_t(v)] = true;
    }
  }
  return false;
}

}  // namespace

std::vector<EdgeUse> edge_uses(const TriangleMesh& mesh) {
  std::vector<EdgeUse> uses;
  uses.reserve(3 * mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      if (a != b) uses.push_back({std::min(a, b), std::max(a, b), int(t), a < b});
    }
  std::ranges::sort(uses, {}, [](const EdgeUse& use) { return std::tuple(use.low, use.high, use.triangle); });
  return uses;
}

std::vector<Shell> shells_of(const TriangleMesh& mesh) {
  DisjointSets sets(mesh.triangles.size());
  const std::vector<EdgeUse> uses = edge_uses(mesh);
  std::vector<bool> is_open(mesh.triangles.size(), false);
  for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
    for (const EdgeUse& use : edge) {
      sets.join(edge.front().triangle, use.triangle);
      if (edge.size() != 2) is_open[std::size_t(use.triangle)] = true;
    }
  });
  std::map<int, std::size_t> number;  // by the set's root
  std::vector<Shell> shells;
  for (int t = 0; t < int(mesh.triangles.size()); ++t) {
    const auto [found, is_new] = number.try_emplace(sets.root(t), shells.size());
    if (is_new) shells.emplace_back().is_closed = true;
    Shell& shell = shells[found->second];
    shell.triangles.push_back(t);
    shell.is_closed = shell.is_closed && !is_open[std::size_t(t)];
    const Vector3 &a = corner(mesh, t, 0), &b = corner(mesh, t, 1), &c = corner(mesh, t, 2);
    for (const Vector3* p : {&a, &b, &c}) shell.box.extend(*p);
    shell.area += 0.5 * (b - a).cross(c - a).norm();
  }
  for (Shell& shell : shells) {
    const Vector3& origin =
        corner(mesh, shell.triangles.front(), 0);  // near: volumes of crumbs far from 0 keep their digits
    for (const int t : shell.triangles)
      shell.volume +=
          (corner(mesh, t, 0) - origin).dot((corner(mesh, t, 1) - origin).cross(corner(mesh, t, 2) - origin)) / 6.0;
  }
  return shells;
}

bool lies_in(const TriangleMesh& mesh, const Shell& inner, const Shell& outer) {
  if ((inner.box.min.array() < outer.box.min.array()).any() || (inner.box.max.array() > outer.box.max.array()).any())
    return false;
  return RayCounter(mesh, outer, outer.triangles).is_inside(place_on(mesh, inner.triangles.front()));
}

bool cut(const TriangleMesh& mesh, const Shell& a, const Shell& b) {
  return overlap(a.box, b.box) && (edges_go_through(mesh, a, b) || edges_go_through(mesh, b, a));
}

bool share_volume(const TriangleMesh& mesh, const Shell& a, const Shell& b) {
  return overlap(a.box, b.box) && (cut(mesh, a, b) || reaches_into(mesh, a, b) || reaches_into(mesh, b, a));
}

}  // namespace pliant
