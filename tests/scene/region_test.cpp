#include "scene/region.hpp"

#include "geometry/meshes.hpp"

namespace pliant::region_test {
namespace {

const TriangleMesh box = test::box_mesh(Vector3::Zero(), Vector3::Ones());

TEST(RegionTest, ContainsItsBorder) {
  EXPECT_TRUE(contains(RegionBox{Vector3::Zero(), Vector3::Ones()}, {1, 1, 1}));
  EXPECT_FALSE(contains(RegionBox{Vector3::Zero(), Vector3::Ones()}, {1, 1, 1.1}));
  EXPECT_TRUE(contains(RegionSphere{Vector3::Zero(), 1}, {0, 1, 0}));
  EXPECT_TRUE(contains(RegionHalfSpace{{0, 1, 0}, {0, 1, 0}}, {9, 1, 9}));
  EXPECT_FALSE(contains(RegionHalfSpace{{0, 1, 0}, {0, 1, 0}}, {9, 0.9, 9}));
  EXPECT_FALSE(contains(RegionVertices{{0, 1}}, {0, 0, 0}));
}

TEST(RegionTest, ListsContainVerticesByIndex) {
  EXPECT_TRUE(contains_vertex(RegionVertices{{3}}, box, 3));
  EXPECT_FALSE(contains_vertex(RegionVertices{{3}}, box, 2));
}

TEST(RegionTest, TouchesTheInsideOfASolid) {
  EXPECT_TRUE(touches_solid(RegionSphere{{0.5, 0.5, 0.5}, 0.05}, box));
  EXPECT_FALSE(touches_solid(RegionSphere{{1.5, 0.5, 0.5}, 0.4}, box));
  EXPECT_TRUE(touches_solid(RegionBox{{-1, 0.4, 0.4}, {0.1, 0.5, 0.5}}, box));
  EXPECT_FALSE(touches_solid(RegionVertices{{}}, box));
}

}  // namespace
}  // namespace pliant::region_test
