#include "capture/isolated_points.hpp"

#include <algorithm>
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>

namespace pliant {

namespace {

namespace bg = boost::geometry;
using TreePoint = bg::model::point<double, 3, bg::cs::cartesian>;
using Tree = bg::index::rtree<TreePoint, bg::index::quadratic<8>>;

constexpr unsigned neighbours = 6;
constexpr double isolated_reach = 3.0;

/// Squared distance of each point to its sixth nearest neighbour.
std::vector<double> neighbour_distances(std::span<const Vector3> points) {
  std::vector<TreePoint> all;
  for (const Vector3& p : points) all.emplace_back(p.x(), p.y(), p.z());
  const Tree tree(all);  // packed
  std::vector<double> distances;
  std::vector<TreePoint> near;
  for (const TreePoint& at : all) {
    near.clear();
    tree.query(bg::index::nearest(at, neighbours + 1), std::back_inserter(near));  // itself among them
    double farthest = 0.0;
    for (const TreePoint& other : near) farthest = std::max(farthest, bg::comparable_distance(at, other));
    distances.push_back(farthest);
  }
  return distances;
}

}  // namespace

std::vector<bool> isolated_points(std::span<const Vector3> points) {
  std::vector<bool> isolated(points.size(), false);
  if (points.size() <= neighbours) return isolated;
  const std::vector<double> distances = neighbour_distances(points);
  std::vector<double> sorted = distances;
  const auto middle = sorted.begin() + std::ptrdiff_t(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  for (std::size_t i = 0; i < points.size(); ++i)
    isolated[i] = distances[i] > isolated_reach * isolated_reach * *middle;
  return isolated;
}

}  // namespace pliant
