#include <filesystem>

#include "capture/find_plane.hpp"
#include "capture/observe.hpp"
#include "capture/point_cloud.hpp"
#include "capture/segment.hpp"
#include "input_errors.hpp"
#include "temporary_folder.hpp"

namespace pliant::shared_captures_test {
namespace {

namespace fs = std::filesystem;
using test::complaint_of;
using test::shared_data;

class SharedCapture : public ::testing::TestWithParam<const char*> {};

TEST_P(SharedCapture, IsAccepted) {
  const fs::path path = shared_data() / GetParam();
  if (!fs::exists(path)) GTEST_SKIP() << "no shared recording " << path;
  EXPECT_EQ(complaint_of([&] { (void)read_capture(path); }), "");
}

INSTANTIATE_TEST_SUITE_P(Oracle, SharedCapture,
                         ::testing::Values("oracle-bounce-a", "oracle-bounce-b", "oracle-ramp", "oracle-release",
                                           "oracle-release-zones", "oracle-sag", "oracle-load", "oracle-press",
                                           "silicone-h_e_c", "silicone-h_e_s", "silicone-t_em_c"),
                         [](const auto& capture) {
                           std::string name = capture.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(SharedClouds, AreRead) {
  const fs::path folder = shared_data() / "sensor-reader-samples";
  if (!fs::exists(folder)) GTEST_SKIP() << "no shared recording " << folder;
  EXPECT_EQ(read_points(folder / "object_scan_sr300_binary.pcd").size(), 38592u);
  EXPECT_EQ(read_points(folder / "lamb_leg_sr300.ply").size(), 18059u);
  EXPECT_EQ(read_points(folder / "shoe_sr300.ply").size(), 32408u);
  EXPECT_EQ(read_points(folder / "realsense_ascii.ply").size(), 6905u);
}

TEST(SharedDepth, TableIsFoundWithinItsStatedScatter) {
  const fs::path path = shared_data() / "plush-press-rgbd/depth/000000.png";
  if (!fs::exists(path)) GTEST_SKIP() << "no shared recording " << path;
  DepthCamera camera;
  camera.camera = {320, 240, 275.0, 275.0, 160.0, 120.0, {}};
  const Segmentation scene = segment(to_metres(read_depth_image(path), 1000.0), camera.camera, DepthNoise(camera, 1.0));
  ASSERT_FALSE(scene.planes.empty());
  EXPECT_LT(scene.planes[0].rms, 0.002) << "1.7 mm, says the recording's README";
}

}  // namespace
}  // namespace pliant::shared_captures_test
