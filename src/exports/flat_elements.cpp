#include "exports/flat_elements.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pliant {

namespace {

constexpr double flat_below = 0.2;
constexpr double surface_moves = 1.0 / 12.0;  // at most, times the mean edge about a node
constexpr int mending_passes = 4;

/// Nodes that may move, and what is about them.
class Mending {
 public:
  Mending(const TetMesh& mesh, const std::function<bool(const Vector3&)>& is_held)
      : tets_(mesh.tets),
        first_(mesh.nodes),
        nodes_(mesh.nodes),
        is_held_at_(is_held),
        about_(std::size_t(mesh.node_count())),
        is_on_surface_(about_.size(), false),
        is_held_(about_.size(), false) {
    for (std::size_t e = 0; e < tets_.size(); ++e)
      for (const int node : tets_[e]) about_[std::size_t(node)].push_back(int(e));
    for (std::size_t node = 0; node < is_held_.size(); ++node)
      is_held_[node] = is_held(first_.row(Eigen::Index(node)).transpose());
    for (const std::array<int, 3>& face : mesh.boundary)
      for (const int node : face) is_on_surface_[std::size_t(node)] = true;
  }

  Points run() {
    for (int pass = 0; pass < mending_passes; ++pass) {
      const std::vector<int> flat = flat_elements();
      if (flat.empty()) break;
      for (const int e : flat)
        for (const int node : tets_[std::size_t(e)]) improve(node);
    }
    return nodes_;
  }

 private:
  double quality_of(int e) const {
    const auto at = [&](std::size_t k) -> Vector3 { return nodes_.row(tets_[std::size_t(e)][k]).transpose(); };
    return tet_shape_quality(at(0), at(1), at(2), at(3));
  }

  std::vector<int> flat_elements() const {  // flattest first
    std::vector<std::pair<double, int>> found;
    for (int e = 0; e < int(tets_.size()); ++e)
      if (const double q = quality_of(e); q < flat_below) found.emplace_back(q, e);
    std::ranges::sort(found);
    std::vector<int> elements;
    for (const auto& [q, e] : found) elements.push_back(e);
    return elements;
  }

  double worst_about(int node) const {
    double worst = 1.0;
    for (const int e : about_[std::size_t(node)]) worst = std::min(worst, quality_of(e));
    return worst;
  }

  double mean_edge_about(int node) const {
    double sum = 0.0;
    int count = 0;
    for (const int e : about_[std::size_t(node)])
      for (const int other : tets_[std::size_t(e)])
        if (other != node) sum += (first_.row(other) - first_.row(node)).norm(), ++count;
    return sum / count;
  }

  /// Pattern search: the best of 26 directions, at ever shorter ways.
  void improve(int node) {
    const bool is_held = is_held_[std::size_t(node)], is_bound = is_held || is_on_surface_[std::size_t(node)];
    const double edge = mean_edge_about(node), farthest = is_bound ? surface_moves * edge : edge;
    double best = worst_about(node);
    Eigen::RowVector3d place = nodes_.row(node);
    for (double way = 0.4 * edge; way > 0.01 * edge; way *= 0.5) {
      const Eigen::RowVector3d from = place;
      for (int k = 0; k < 27; ++k) {
        const Eigen::RowVector3d direction(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        if (k == 13) continue;  // nowhere
        nodes_.row(node) = from + way * direction.normalized();
        if ((nodes_.row(node) - first_.row(node)).norm() > farthest) continue;
        if (const double worst = worst_about(node);
            worst > best && is_held_at_(nodes_.row(node).transpose()) == is_held)
          best = worst, place = nodes_.row(node);
      }
      nodes_.row(node) = place;
    }
  }

  const std::vector<std::array<int, 4>>& tets_;
  const Points& first_;
  Points nodes_;
  const std::function<bool(const Vector3&)>& is_held_at_;
  std::vector<std::vector<int>> about_;  // elements of each node
  std::vector<bool> is_on_surface_, is_held_;
};

}  // namespace

double tet_shape_quality(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  const Vector3 u = b - a, v = c - a, w = d - a;
  const double squares = u.squaredNorm() + v.squaredNorm() + w.squaredNorm() + (v - u).squaredNorm() +
                         (w - u).squaredNorm() + (w - v).squaredNorm();
  return std::sqrt(2.0) * u.cross(v).dot(w) / std::pow(squares / 6.0, 1.5);
}

TetMesh with_flat_elements_mended(const TetMesh& mesh, const std::function<bool(const Vector3& place)>& is_held) {
  if (mesh.is_quadratic()) throw std::invalid_argument("flat elements are mended of linear meshes alone");
  return make_tet_mesh(Mending(mesh, is_held).run(), mesh.tets);
}

}  // namespace pliant
