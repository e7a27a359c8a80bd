#include "mesh/tet_mesh.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>
#include <unsupported/Eigen/BVH>

#include "base/points.hpp"
#include "geometry/offset_surface.hpp"
#include "mesh/tet_boundary.hpp"

namespace pliant {

namespace {

using Corners = Eigen::Matrix<double, 3, 4>;

Corners corners_of(const Points& nodes, const std::array<int, 4>& tet) {
  Corners x;
  for (int a = 0; a < 4; ++a) x.col(a) = nodes.row(tet[a]).transpose();
  return x;
}

/// Columns x1 - x0, x2 - x0, x3 - x0.
Matrix3 edge_matrix(const Corners& x) { return x.rightCols<3>().colwise() - x.col(0); }

Barycentric barycentric(const Corners& x, const Vector3& point) {
  Barycentric b;
  b.tail<3>() = edge_matrix(x).inverse() * (point - x.col(0));
  b[0] = 1.0 - b.tail<3>().sum();
  return b;
}

Vector3 closest_on_segment(const Vector3& a, const Vector3& b, const Vector3& point) {
  const double t = (point - a).dot(b - a) / (b - a).squaredNorm();
  if (t <= 0.0) return a;
  return t >= 1.0 ? b : Vector3(a + t * (b - a));
}

double squared_distance_to_triangle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& point) {
  const Vector3 normal = (b - a).cross(c - a);
  const std::array<std::array<const Vector3*, 2>, 3> sides = {{{&a, &b}, {&b, &c}, {&c, &a}}};
  double nearest_side = std::numeric_limits<double>::max();
  bool projects_inside = true;
  for (const auto& [from, to] : sides) {
    if (normal.cross(*to - *from).dot(point - *from) >= 0.0) continue;
    projects_inside = false;
    nearest_side = std::min(nearest_side, (point - closest_on_segment(*from, *to, point)).squaredNorm());
  }
  if (!projects_inside) return nearest_side;
  const double along = normal.dot(point - a);
  return along * along / normal.squaredNorm();
}

/// 0 inside. The nearest point lies on a face that the point sees.
double squared_distance_to_tet(const Corners& x, const Barycentric& b, const Vector3& point) {
  double nearest = std::numeric_limits<double>::max();
  for (int face = 0; face < 4; ++face) {
    if (b[face] >= 0.0) continue;
    const auto& [i, j, k] = tet_faces[face];
    nearest = std::min(nearest, squared_distance_to_triangle(x.col(i), x.col(j), x.col(k), point));
  }
  return nearest == std::numeric_limits<double>::max() ? 0.0 : nearest;
}

}  // namespace

class TetTree {
 public:
  TetTree(const Points& nodes, const std::vector<std::array<int, 4>>& tets) {
    std::vector<int> elements(tets.size());
    std::vector<Eigen::AlignedBox3d> boxes(tets.size());
    for (std::size_t e = 0; e < tets.size(); ++e) {
      elements[e] = int(e);
      for (const int n : tets[e]) boxes[e].extend(nodes.row(n).transpose());
    }
    tree_.init(elements.begin(), elements.end(), boxes.begin(), boxes.end());
  }

  TetPoint nearest(const TetMesh& mesh, const Vector3& point) const {
    Search search{mesh, point};
    Eigen::BVMinimize(tree_, search);
    return search.best;
  }

 private:
  /// Of elements at the same distance, which share a corner or an edge there, the one that is extrapolated least.
  struct Search {
    using Scalar = double;
    static constexpr double tie = 1e-12;

    double minimumOnVolume(const Eigen::AlignedBox3d& box) const {
      return (1.0 - 2.0 * tie) * box.squaredExteriorDistance(point);
    }
    double minimumOnObject(int e) {
      const Corners x = corners_of(mesh.nodes, mesh.tets[std::size_t(e)]);
      const Barycentric b = barycentric(x, point);
      const double distance = squared_distance_to_tet(x, b, point);
      const bool ties = std::abs(distance - least) <= tie * least;
      if (ties ? b.minCoeff() > best.barycentric.minCoeff() : distance < least) best = {e, b};
      least = std::min(least, distance);
      return distance;
    }

    const TetMesh& mesh;
    Vector3 point;
    TetPoint best = {};
    double least = std::numeric_limits<double>::max();
  };

  Eigen::KdBVH<double, 3, int> tree_;
};

namespace {

[[noreturn]] void refuse(const std::string& why) { throw std::invalid_argument("make_tet_mesh: " + why); }

void check_nodes(const TetMesh& mesh) {
  std::vector<bool> used(std::size_t(mesh.node_count()), false);
  const auto visit = [&](int node, std::size_t e) {
    if (node < 0 || node >= mesh.node_count())
      refuse("element " + std::to_string(e) + " names node " + std::to_string(node) + " of " +
             std::to_string(mesh.node_count()));
    used[std::size_t(node)] = true;
  };
  for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
    for (const int node : mesh.tets[e]) visit(node, e);
    if (mesh.is_quadratic())
      for (const int node : mesh.mid_nodes[e]) visit(node, e);
  }
  const auto unused = std::find(used.begin(), used.end(), false);
  if (unused != used.end()) refuse("node " + std::to_string(unused - used.begin()) + " belongs to no element");
  if (!mesh.nodes.allFinite()) refuse("a node is not finite");
}

void check_volumes(const TetMesh& mesh) {
  for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
    const Matrix3 edges = edge_matrix(corners_of(mesh.nodes, mesh.tets[e]));
    constexpr double flat = 1e-9;  // of the longest edge cubed: rounding would decide on the element's forces
    if (!(edges.determinant() > flat * std::pow(edges.colwise().norm().maxCoeff(), 3)))
      refuse("element " + std::to_string(e) + " has no positive volume");
  }
}

/// Three samples of an element's face, by the element's own shape functions, so that curved faces are followed.
template <int N>
void add_samples(const Eigen::Matrix<double, N, 3>& X, int face, std::vector<SurfacePoint>& samples) {
  for (int k = 0; k < 3; ++k) {
    Barycentric at = Barycentric::Zero();
    for (int c = 0; c < 3; ++c) at[tet_faces[face][c]] = c == k ? 2.0 / 3.0 : 1.0 / 6.0;
    const auto shape = tet_shape_functions<N>(at);
    const Matrix3 J = X.transpose() * tet_shape_derivatives<N>(at);  // dx / d(b1, b2, b3)
    const auto towards = [&](int corner) -> Vector3 {
      return corner == 0 ? Vector3::Zero() : Vector3(J.col(corner - 1));
    };
    const auto& [i, j, l] = tet_faces[face];
    const Vector3 normal = 0.5 * (towards(j) - towards(i)).cross(towards(l) - towards(i));
    Vector3 position = Vector3::Zero();
    for (int a = 0; a < N; ++a) position += shape[a] * X.row(a).transpose();
    samples.push_back({position, normal.normalized(), normal.norm() / 3.0});
  }
}

template <int N>
Eigen::Matrix<double, N, 3> element_nodes(const TetMesh& mesh, int e) {
  Eigen::Matrix<double, N, 3> X;
  for (int a = 0; a < 4; ++a) X.row(a) = mesh.nodes.row(mesh.tets[std::size_t(e)][a]);
  if constexpr (N == 10)
    for (int m = 0; m < 6; ++m) X.row(4 + m) = mesh.nodes.row(mesh.mid_nodes[std::size_t(e)][m]);
  return X;
}

}  // namespace

double TetMesh::volume() const {
  double sum = 0.0;
  for (int e = 0; e < tet_count(); ++e) {
    if (!is_quadratic()) {
      sum += edge_matrix(corners_of(nodes, tets[std::size_t(e)])).determinant() / 6.0;
      continue;
    }
    const auto X = element_nodes<10>(*this, e);
    for (const TetQuadraturePoint& q : tet_quadrature(3))
      sum += q.weight * (X.transpose() * tet_shape_derivatives<10>(q.at)).determinant() / 6.0;
  }
  return sum;
}

TetPoint TetMesh::locate(const Vector3& point) const { return tree->nearest(*this, point); }

TetMesh make_tet_mesh(Points nodes, std::vector<std::array<int, 4>> tets, std::vector<std::array<int, 6>> mid_nodes) {
  TetMesh mesh;
  mesh.nodes = std::move(nodes);
  mesh.tets = std::move(tets);
  mesh.mid_nodes = std::move(mid_nodes);
  if (mesh.tets.empty()) refuse("there are no elements");
  if (mesh.is_quadratic() && mesh.mid_nodes.size() != mesh.tets.size())
    refuse("mid nodes of " + std::to_string(mesh.mid_nodes.size()) + " elements of " +
           std::to_string(mesh.tets.size()));
  check_nodes(mesh);
  check_volumes(mesh);
  for (const TetFace& face : boundary_faces(mesh.tets)) {
    mesh.boundary.push_back(face.corners(mesh.tets));
    if (mesh.is_quadratic())
      add_samples<10>(element_nodes<10>(mesh, face.tet), face.face, mesh.surface);
    else
      add_samples<4>(element_nodes<4>(mesh, face.tet), face.face, mesh.surface);
  }
  mesh.tree = std::make_shared<TetTree>(mesh.nodes, mesh.tets);
  return mesh;
}

TetMesh with_mid_nodes(const TetMesh& mesh) {
  if (mesh.is_quadratic()) return mesh;
  std::map<std::pair<int, int>, int> mid_of_edge;
  std::vector<std::array<int, 6>> mid_nodes(mesh.tets.size());
  std::vector<Vector3> mids;
  for (std::size_t e = 0; e < mesh.tets.size(); ++e)
    for (int m = 0; m < 6; ++m) {
      const int a = mesh.tets[e][tet_edges[m][0]], b = mesh.tets[e][tet_edges[m][1]];
      const auto [entry, is_new] = mid_of_edge.try_emplace(std::minmax(a, b), mesh.node_count() + int(mids.size()));
      if (is_new) mids.push_back(0.5 * (mesh.nodes.row(a) + mesh.nodes.row(b)).transpose());
      mid_nodes[e][m] = entry->second;
    }
  Points nodes(mesh.node_count() + Eigen::Index(mids.size()), 3);
  nodes.topRows(mesh.node_count()) = mesh.nodes;
  for (std::size_t m = 0; m < mids.size(); ++m) nodes.row(mesh.node_count() + Eigen::Index(m)) = mids[m].transpose();
  return make_tet_mesh(std::move(nodes), mesh.tets, std::move(mid_nodes));
}

namespace {

/// Corners that are not given moves go as the mean of those around them does: nearly, after so many sweeps.
void move_along_inside(const std::vector<std::array<int, 4>>& tets, const std::function<bool(int)>& is_given,
                       Points& moves) {
  constexpr int sweeps = 50;
  std::vector<std::set<int>> around(std::size_t(moves.rows()));
  for (const auto& tet : tets)
    for (const int a : tet)
      for (const int b : tet)
        if (a != b && !is_given(a)) around[std::size_t(a)].insert(b);
  for (int sweep = 0; sweep < sweeps; ++sweep)
    for (std::size_t n = 0; n < around.size(); ++n) {
      if (around[n].empty()) continue;
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      for (const int other : around[n]) sum += moves.row(other);
      moves.row(Eigen::Index(n)) = sum / double(around[n].size());
    }
}

}  // namespace

TetMesh with_offset_boundary(const TetMesh& mesh, const std::function<double(const Vector3&)>& offset) {
  const std::vector<Vector3> directions = offset_directions({to_vectors(mesh.nodes), mesh.boundary});
  Points moves = Points::Zero(mesh.node_count(), 3);
  for (std::size_t n = 0; n < directions.size(); ++n)
    if (!directions[n].isZero(0.0))
      moves.row(Eigen::Index(n)) = offset(mesh.nodes.row(Eigen::Index(n))) * directions[n].transpose();
  move_along_inside(
      mesh.tets, [&](int n) { return !directions[std::size_t(n)].isZero(0.0); }, moves);
  for (std::size_t e = 0; e < mesh.mid_nodes.size(); ++e)
    for (std::size_t m = 0; m < 6; ++m) {
      const auto& [a, b] = tet_edges[m];
      moves.row(mesh.mid_nodes[e][m]) =
          0.5 * (moves.row(mesh.tets[e][std::size_t(a)]) + moves.row(mesh.tets[e][std::size_t(b)]));
    }
  return make_tet_mesh(mesh.nodes + moves, mesh.tets, mesh.mid_nodes);
}

TetMesh make_tet_box(const Box& box, const Eigen::Vector3i& cells, bool quadratic) {
  if ((cells.array() < 1).any() || !(box.extent().minCoeff() > 0.0))
    throw std::invalid_argument("make_tet_box: needs a box with positive edges and at least one cell along each");
  const Eigen::Vector3i points = cells.array() + 1;
  const auto node = [&](int i, int j, int k) { return (k * points.y() + j) * points.x() + i; };
  Points nodes(points.prod(), 3);
  std::vector<std::array<int, 4>> tets;
  tets.reserve(6 * std::size_t(cells.prod()));
  for (int k = 0; k < points.z(); ++k)
    for (int j = 0; j < points.y(); ++j)
      for (int i = 0; i < points.x(); ++i) {
        const Vector3 share = Vector3(i, j, k).cwiseQuotient(cells.cast<double>());
        nodes.row(node(i, j, k)) = (box.min + share.cwiseProduct(box.extent())).transpose();
        if (i == cells.x() || j == cells.y() || k == cells.z()) continue;
        // Kuhn's six around the diagonal from the lowest to the highest corner: neighbouring cells agree on shared
        // faces.
        const auto corner = [&](int a) { return node(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2 & 1)); };
        static constexpr int paths[6][2] = {{1, 3}, {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}};
        for (const auto& [p, q] : paths) tets.push_back({corner(0), corner(p), corner(q), corner(7)});
      }
  const TetMesh mesh = make_tet_mesh(std::move(nodes), std::move(tets));
  return quadratic ? with_mid_nodes(mesh) : mesh;
}

TetQuality quality(const TetMesh& mesh) {
  TetQuality q;
  q.least_dihedral_deg = 180.0;
  q.least_volume = q.least_radius_ratio = std::numeric_limits<double>::max();
  for (const auto& tet : mesh.tets) {
    const Corners x = corners_of(mesh.nodes, tet);
    const Matrix3 edges = edge_matrix(x);
    const double volume = edges.determinant() / 6.0;
    std::array<Vector3, 4> normals;
    double area = 0.0;
    for (int f = 0; f < 4; ++f) {
      const auto& [i, j, k] = tet_faces[f];
      normals[f] = 0.5 * (x.col(j) - x.col(i)).cross(x.col(k) - x.col(i));
      area += normals[f].norm();
      normals[f].normalize();
    }
    double least = 180.0;
    for (const auto& [f, g] : tet_edges) {
      const double angle = std::acos(std::clamp(-normals[f].dot(normals[g]), -1.0, 1.0)) * 180.0 / std::numbers::pi;
      least = std::min(least, angle);
      q.greatest_dihedral_deg = std::max(q.greatest_dihedral_deg, angle);
    }
    q.least_dihedral_deg = std::min(q.least_dihedral_deg, least);
    q.below_5_deg += least < 5.0;
    q.below_10_deg += least < 10.0;
    const Vector3 to_circumcentre = edges.transpose().inverse() * (0.5 * edges.colwise().squaredNorm().transpose());
    q.least_radius_ratio = std::min(q.least_radius_ratio, 9.0 * volume / area / to_circumcentre.norm());
    q.least_volume = std::min(q.least_volume, volume);
    q.greatest_volume = std::max(q.greatest_volume, volume);
    q.mean_volume += volume / mesh.tet_count();
  }
  return q;
}

}  // namespace pliant
