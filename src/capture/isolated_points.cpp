#include "capture/isolated_points.hpp"

#include "base/median.hpp"
#include "capture/point_tree.hpp"

namespace pliant {

namespace {

constexpr int neighbours = 6;
constexpr double isolated_reach = 3.0;

}  // namespace

std::vector<bool> isolated_points(std::span<const Vector3> points) {
  std::vector<bool> isolated(points.size(), false);
  if (points.size() <= std::size_t(neighbours)) return isolated;
  const PointTree tree(points);
  std::vector<double> distances;  // squared, to the sixth nearest
  for (const Vector3& p : points) distances.push_back(tree.squared_distance(p, neighbours + 1));  // itself among them
  const double farthest = isolated_reach * isolated_reach * median(distances);
  for (std::size_t i = 0; i < points.size(); ++i) isolated[i] = distances[i] > farthest;
  return isolated;
}

}  // namespace pliant
