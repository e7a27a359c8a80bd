#pragma once

#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cstddef>
#include <utility>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Numbered boxes, found by the places that they hold or are near to: a packed R-tree (Guttman 1984). It is slow to
/// compile: for source files only, whose module needs Boost's headers.
using TreePoint = boost::geometry::model::point<double, 3, boost::geometry::cs::cartesian>;
using TreeBox = boost::geometry::model::box<TreePoint>;
using BoxTree = boost::geometry::index::rtree<std::pair<TreeBox, int>, boost::geometry::index::quadratic<8>>;

inline TreePoint tree_point(const Vector3& p) { return {p.x(), p.y(), p.z()}; }

/// @param box_of  the `Box` of each number from 0 to `count` - 1
template <class BoxOf>
BoxTree box_tree(std::size_t count, BoxOf&& box_of) {
  std::vector<std::pair<TreeBox, int>> boxes;
  boxes.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Box box = box_of(i);
    boxes.emplace_back(TreeBox(tree_point(box.min), tree_point(box.max)), int(i));
  }
  return BoxTree(boxes);  // packed
}

}  // namespace pliant
