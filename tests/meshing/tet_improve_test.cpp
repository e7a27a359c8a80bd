#include "meshing/tet_improve.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pliant::tet_improve_test {
namespace {

struct Elements {
  std::vector<Vector3> nodes;
  std::vector<std::array<int, 4>> tets;

  Matrix3 edges(std::size_t t) const {
    Matrix3 e;
    for (std::size_t k = 0; k < 3; ++k)
      e.col(Eigen::Index(k)) = nodes[std::size_t(tets[t][k + 1])] - nodes[std::size_t(tets[t][0])];
    return e;
  }
  double volume() const {
    double sum = 0.0;
    for (std::size_t t = 0; t < tets.size(); ++t) sum += edges(t).determinant() / 6.0;
    return sum;
  }
  /// Of the least voluminous element, to its longest edge from the first corner cubed.
  double flatness() const {
    double least = 1.0;
    for (std::size_t t = 0; t < tets.size(); ++t)
      least = std::min(least, edges(t).determinant() / std::pow(edges(t).colwise().norm().maxCoeff(), 3));
    return least;
  }
  int add(double x, double y, double z) {
    nodes.emplace_back(x, y, z);
    return int(nodes.size()) - 1;
  }
  void add_tet(std::array<int, 4> t) {
    tets.push_back(t);
    if (edges(tets.size() - 1).determinant() < 0.0) std::swap(tets.back()[2], tets.back()[3]);
  }
};

/// A flat element whose crossing edges lie inside, with `sectors` elements around each of them.
Elements square_between_fans(int sectors) {
  Elements e;
  const int a = e.add(-1, 0, 0), b = e.add(0, 1, 0), c = e.add(1, 0, 0), d = e.add(0, -1, 0);
  e.add_tet({a, c, d, b});
  int above = b, below = a;
  for (int k = 1; k <= sectors; ++k) {
    const double angle = std::numbers::pi * k / sectors;
    const int next_above = k < sectors ? e.add(0, std::cos(angle), std::sin(angle)) : d;
    const int next_below = k < sectors ? e.add(-std::cos(angle), 0, -std::sin(angle)) : c;
    e.add_tet({a, c, above, next_above});
    e.add_tet({b, d, below, next_below});
    above = next_above, below = next_below;
  }
  return e;
}

TEST(TetImprove, TakesAFlatElementAwayByANodeWhereTooManyElementsMeetAtItsEdges) {
  Elements e = square_between_fans(9);
  const double volume = e.volume();
  ASSERT_EQ(e.flatness(), 0.0);
  improve(e.nodes, e.tets, {});
  EXPECT_EQ(e.nodes.size(), 21u);
  EXPECT_EQ(e.tets.size(), 36u);
  EXPECT_NEAR(e.volume(), volume, 1e-12);
  EXPECT_GT(e.flatness(), 0.1);
}

TEST(TetImprove, NeedsNoNodeWhereOtherElementsFillTheRing) {
  Elements e = square_between_fans(2);
  const double volume = e.volume();
  improve(e.nodes, e.tets, {});
  EXPECT_EQ(e.nodes.size(), 6u);
  EXPECT_NEAR(e.volume(), volume, 1e-12);
  EXPECT_GT(e.flatness(), 0.1);
}

TEST(TetImprove, IsTheSameEveryTime) {
  Elements one = square_between_fans(9), other = one;
  improve(one.nodes, one.tets, {});
  improve(other.nodes, other.tets, {});
  EXPECT_EQ(one.nodes, other.nodes);
  EXPECT_EQ(one.tets, other.tets);
}

}  // namespace
}  // namespace pliant::tet_improve_test
