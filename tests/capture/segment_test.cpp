#include "capture/segment.hpp"

#include <cmath>

#include "capture/small_capture.hpp"

namespace pliant::segment_test {
namespace {

using test::SmallCapture;

TEST(Segment, SplitsTheSceneIntoPlanesAndTheBox) {
  SmallCapture small;
  const Capture capture = small.read();
  const DepthCamera& camera = capture.depth[0];
  SegmentOptions options;
  options.least_pixels = 50;
  const Segmentation scene = segment(read_depth(capture, camera, 0), camera.camera, DepthNoise(camera, 0.9), options);
  ASSERT_GE(scene.planes.size(), 2u) << "the wall and the floor";
  EXPECT_GT(std::abs(scene.planes[0].normal.z()), 0.999);
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.objects[0].pixels, 18 * 18 - 4) << "its corners have too few neighbours";
  EXPECT_NEAR(scene.objects[0].extent[0], 0.19, 0.01);
  EXPECT_LT((scene.objects[0].centroid - Vector3(0, 0, -0.1)).norm(), 1e-3);
  EXPECT_EQ(scene.label(40, 30), 0);
}

TEST(Segment, SurvivesAnImageWithoutReadings) {
  SmallCapture small;
  const DepthCamera camera = small.read().depth[0];
  const Segmentation scene = segment(DepthImage(80, 60), camera.camera, DepthNoise(camera, 1.0));
  EXPECT_TRUE(scene.planes.empty());
  EXPECT_TRUE(scene.objects.empty());
}

}  // namespace
}  // namespace pliant::segment_test
