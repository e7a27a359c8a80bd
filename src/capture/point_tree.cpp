#include "capture/point_tree.hpp"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cmath>
#include <vector>

#include "base/median.hpp"

namespace pliant {

namespace {

namespace bg = boost::geometry;
using TreePoint = bg::model::point<double, 3, bg::cs::cartesian>;

TreePoint tree_point(const Vector3& p) { return {p.x(), p.y(), p.z()}; }

std::vector<TreePoint> tree_points(std::span<const Vector3> points) {
  std::vector<TreePoint> all;
  for (const Vector3& p : points) all.push_back(tree_point(p));
  return all;
}

}  // namespace

struct PointTree::Tree {
  bg::index::rtree<TreePoint, bg::index::quadratic<8>> points;
};

PointTree::PointTree(std::span<const Vector3> points)
    : tree_(std::make_unique<Tree>(Tree{bg::index::rtree<TreePoint, bg::index::quadratic<8>>(tree_points(points))})) {}
PointTree::~PointTree() = default;
PointTree::PointTree(PointTree&&) noexcept = default;
PointTree& PointTree::operator=(PointTree&&) noexcept = default;

double PointTree::squared_distance(const Vector3& from, int k) const {
  const TreePoint at = tree_point(from);
  double farthest = 0.0;
  for (auto near = tree_->points.qbegin(bg::index::nearest(at, unsigned(k))); near != tree_->points.qend(); ++near)
    farthest = std::max(farthest, bg::comparable_distance(at, *near));
  return farthest;
}

double typical_spacing(std::span<const Vector3> points, const PointTree& tree) {
  constexpr int neighbours = 6;
  if (points.size() <= std::size_t(neighbours)) return 0.0;
  std::vector<double> distances;
  for (const Vector3& p : points) distances.push_back(tree.squared_distance(p, neighbours + 1));
  return std::sqrt(median(std::move(distances)));
}

}  // namespace pliant
