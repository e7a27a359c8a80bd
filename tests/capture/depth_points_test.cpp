#include "capture/depth_points.hpp"

#include <cmath>

namespace pliant::depth_points_test {
namespace {

PinholeCamera camera() {
  PinholeCamera lens;
  lens.width = 20;
  lens.height = 20;
  lens.fx = lens.fy = 100;
  lens.cx = lens.cy = 9.5;
  return lens;
}

// A near wall left of column 10, a far one from there on.
DepthImage step_image() {
  DepthImage depth(20, 20, 2.0f);
  for (int v = 0; v < 20; ++v)
    for (int u = 0; u < 10; ++u) depth(u, v) = 1.0f;
  return depth;
}

TEST(IsSupported, DropsAPixelThatFliesBetweenTwoSurfaces) {
  DepthImage depth = step_image();
  for (int v = 0; v < 20; v += 2) depth(10, v) = 1.5f;
  EXPECT_FALSE(is_supported(depth, 10, 10, 0.02));
  EXPECT_TRUE(is_supported(depth, 9, 10, 0.02)) << "the near wall's last column";
  EXPECT_TRUE(is_supported(depth, 5, 5, 0.02));
}

TEST(IsSupported, DropsAPixelWithoutNeighbours) {
  DepthImage depth(20, 20, 0.0f);
  depth(5, 5) = 1.0f;
  EXPECT_FALSE(is_supported(depth, 5, 5, 0.02));
}

TEST(IsAtDiscontinuity, MarksBothSidesOfAStep) {
  const DepthImage depth = step_image();
  EXPECT_TRUE(is_at_discontinuity(depth, 9, 3, 0.02));
  EXPECT_TRUE(is_at_discontinuity(depth, 10, 3, 0.02));
  EXPECT_FALSE(is_at_discontinuity(depth, 8, 3, 0.02));
  EXPECT_FALSE(is_at_discontinuity(depth, 0, 0, 0.02)) << "the border of the image is no step";
}

TEST(SurfaceNormal, OfATiltedPlane) {
  const PinholeCamera lens = camera();
  // The plane z = 1 + 0.5 x along each ray: depth d with d = 1 + 0.5 d (u - cx) / fx.
  DepthImage depth(20, 20);
  for (int v = 0; v < 20; ++v)
    for (int u = 0; u < 20; ++u) depth(u, v) = float(1.0 / (1.0 - 0.5 * (u - lens.cx) / lens.fx));
  const Vector3 expected = Vector3(0.5, 0, -1).normalized();
  for (const int u : {0, 9, 19}) EXPECT_LT((surface_normal(depth, lens, u, 9, 0.05) - expected).norm(), 1e-4) << u;
}

TEST(SurfaceNormal, IsZeroWithoutNeighbours) {
  DepthImage depth(20, 20, 0.0f);
  depth(5, 5) = 1.0f;
  EXPECT_EQ(surface_normal(depth, camera(), 5, 5, 0.05), Vector3(Vector3::Zero()));
}

}  // namespace
}  // namespace pliant::depth_points_test
