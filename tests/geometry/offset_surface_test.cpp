#include "geometry/offset_surface.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "geometry/primitives.hpp"

namespace pliant::offset_surface_test {
namespace {

TEST(OffsetSurface, OfABoxIsABoxWhoseFacesAllWentOutwardsByOne) {
  const Vector3 edges(0.4, 0.1, 0.05);
  const TriangleMesh box = make_box(edges, 0.025);
  const Vector3 middle = bounding_box(box).min + 0.5 * edges;
  const std::vector<Vector3> directions = offset_directions(box);
  for (std::size_t v = 0; v < directions.size(); ++v)
    for (int axis = 0; axis < 3; ++axis) {
      const double from_middle = box.vertices[v][axis] - middle[axis];
      const bool is_on_face = std::abs(from_middle) > 0.5 * edges[axis] - 1e-12;
      EXPECT_NEAR(directions[v][axis], is_on_face ? std::copysign(1.0, from_middle) : 0.0, 1e-9) << v;
    }
}

TEST(OffsetSurface, OfASphereGoesAlongItsRadii) {
  const TriangleMesh sphere = make_sphere(0.1, 3);
  const std::vector<Vector3> directions = offset_directions(sphere);
  for (std::size_t v = 0; v < directions.size(); ++v)
    EXPECT_LT((directions[v] - sphere.vertices[v].normalized()).norm(), 0.02) << v;
}

TEST(OffsetSurface, StaysWhereNoFaceIs) {
  TriangleMesh sphere = make_sphere(0.1, 1);
  sphere.vertices.emplace_back(1.0, 1.0, 1.0);
  EXPECT_TRUE(offset_directions(sphere).back().isZero(0.0));
}

}  // namespace
}  // namespace pliant::offset_surface_test
