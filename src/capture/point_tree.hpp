#pragma once

#include <memory>
#include <span>

#include "base/types.hpp"

namespace pliant {

/// Finds neighbours among points in space.
class PointTree {
 public:
  explicit PointTree(std::span<const Vector3> points);
  ~PointTree();
  PointTree(PointTree&&) noexcept;
  PointTree& operator=(PointTree&&) noexcept;

  /// Squared distance [m^2] to the k-th nearest point, k from 1; to the farthest of all where they are fewer, 0 where
  /// there is none. A point of the tree itself counts as its own first.
  double squared_distance(const Vector3& from, int k) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

/// Distance from a point to its sixth nearest neighbour, by the median over all of them [m]; 0 of fewer than seven.
double typical_spacing(std::span<const Vector3> points, const PointTree& tree);

}  // namespace pliant
