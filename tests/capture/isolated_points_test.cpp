#include "capture/isolated_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace pliant::isolated_points_test {
namespace {

std::vector<Vector3> sheet(int count, double spacing) {
  std::vector<Vector3> points;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) points.emplace_back(spacing * i, spacing * j, 0.0);
  return points;
}

TEST(IsolatedPoints, AreThoseFarFromTheOthers) {
  for (const double spacing : {1e-3, 0.1}) {  // whatever the unit
    std::vector<Vector3> points = sheet(12, spacing);
    const std::size_t sound = points.size();
    points.emplace_back(5 * spacing, 5 * spacing, 6 * spacing);
    points.emplace_back(-40 * spacing, 0.0, 0.0);
    const std::vector<bool> isolated = isolated_points(points);
    EXPECT_EQ(std::count(isolated.begin(), isolated.begin() + std::ptrdiff_t(sound), true), 0) << "corners are none";
    EXPECT_TRUE(isolated[sound]);
    EXPECT_TRUE(isolated[sound + 1]);
  }
}

TEST(IsolatedPoints, AreNoneOfAFew) {
  EXPECT_TRUE(isolated_points({}).empty());
  const std::vector<bool> few = isolated_points(std::vector<Vector3>{{0, 0, 0}, {1, 0, 0}, {900, 0, 0}});
  EXPECT_EQ(few, std::vector<bool>(3, false));
}

TEST(IsolatedPoints, MayCoincide) {
  const std::vector<Vector3> same(20, Vector3(1, 2, 3));
  EXPECT_EQ(isolated_points(same), std::vector<bool>(20, false));
}

}  // namespace
}  // namespace pliant::isolated_points_test
