#pragma once

#include <nanoflann.hpp>

#include "base/types.hpp"

namespace pliant {

/// Neighbours among points, by a k-d tree. The points must stay alive and where they are.
class Neighbours {
 public:
  explicit Neighbours(const Points& points) : adaptor_{points}, tree_(3, adaptor_, {16}) {}

  struct Nearest {
    int index = -1;
    double squared_distance = 0.0;  ///< [m^2]
  };
  [[nodiscard]] Nearest nearest(const Vector3& place) const {
    Eigen::Index index = -1;
    Nearest found;
    tree_.knnSearch(place.data(), 1, &index, &found.squared_distance);
    found.index = int(index);
    return found;
  }
  using Match = std::pair<Eigen::Index, double>;  ///< index, squared distance [m^2]
  /// All within a distance [m], in no order.
  void within(const Vector3& place, double distance, std::vector<Match>& found) const {
    tree_.radiusSearch(place.data(), distance * distance, found, nanoflann::SearchParams(32, 0.0f, false));
  }

 private:
  struct Adaptor {
    const Points& points;
    std::size_t kdtree_get_point_count() const { return std::size_t(points.rows()); }
    double kdtree_get_pt(Eigen::Index i, std::size_t d) const { return points(i, Eigen::Index(d)); }
    template <class BBox>
    bool kdtree_get_bbox(BBox&) const {
      return false;
    }
  };
  using Tree =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Adaptor>, Adaptor, 3, Eigen::Index>;
  Adaptor adaptor_;
  Tree tree_;
};

}  // namespace pliant
