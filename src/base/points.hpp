#pragma once

#include <vector>

#include "base/types.hpp"

namespace pliant {

/// The rows of points, one by one.
inline std::vector<Vector3> to_vectors(const Points& points) {
  std::vector<Vector3> vectors;
  for (const auto& point : points.rowwise()) vectors.push_back(point.transpose());
  return vectors;
}

inline Points to_points(const std::vector<Vector3>& vectors) {
  Points points(Eigen::Index(vectors.size()), 3);
  for (std::size_t i = 0; i < vectors.size(); ++i) points.row(Eigen::Index(i)) = vectors[i].transpose();
  return points;
}

}  // namespace pliant
