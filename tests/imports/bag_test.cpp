// Bags of ROS 1 and ROS 2, written by rosbags (data/README.md).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "import_tools.hpp"
#include "imports/ros_messages.hpp"

namespace pliant::bag_test {

using namespace test;
using ::testing::HasSubstr;

void expect_bag_camera(const DepthCamera& camera) {
  EXPECT_EQ(camera.camera.width, 24);
  EXPECT_EQ(camera.camera.height, 18);
  EXPECT_EQ(camera.camera.fx, 30.0);
  EXPECT_EQ(camera.camera.fy, 31.0);
  EXPECT_EQ(camera.camera.cx, 11.5);
  EXPECT_EQ(camera.camera.cy, 8.5);
  EXPECT_EQ(camera.camera.lens.coefficients(), (std::vector<double>{0.1, -0.02, 0.001, 0.002, 0.0}));
}

class Bags : public ::testing::TestWithParam<const char*> {};

TEST_P(Bags, BecomeACaptureWithPixelsTimesCameraAndLens) {
  const TemporaryFolder folder;
  const Capture capture = imported(import_data(GetParam()), folder / "out");
  expect_ramp(capture, 4);
  EXPECT_NEAR(capture.scene.timing.times[3], 3.0, 1e-9);
  EXPECT_EQ(capture.depth.front().depth_scale, 1000.0);
  expect_bag_camera(capture.depth.front());
  const std::vector<ObservedFrame> seen = observe(capture);
  ASSERT_EQ(seen.size(), 4u);
  ASSERT_GT(seen[0].points.size(), 10u);
  const int u = seen[0].pixel[9] % 24, v = seen[0].pixel[9] / 24;
  const Vector3 expected = capture.depth.front().camera.unproject(u, v, 1e-3 * ramp(u, v, 0));
  EXPECT_NEAR((seen[0].points[9] - expected).norm(), 0.0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Compressions, Bags,
                         ::testing::Values("plain.bag", "bz2.bag", "lz4.bag", "compressed.bag", "humble",
                                           "humble/humble.db3"));

TEST(Bag, TakesPartsAndFormatsByTheirContent) {
  EXPECT_EQ(import_format("", import_data("plain.bag")).name, "bag");
  EXPECT_EQ(import_format("", import_data("humble")).name, "db3");
  const TemporaryFolder folder;
  CaptureFacts facts;
  facts.first = 1, facts.last = 2;
  const Capture capture = imported(import_data("lz4.bag"), folder / "out", "bag", {}, facts);
  expect_ramp(capture, 2, 1);
  EXPECT_NEAR(capture.scene.timing.times[1], 1.0, 1e-9);
}

TEST(Bag, ReadsMetresAndRectifiedCameras) {
  const TemporaryFolder folder;
  const Capture capture = imported(import_data("metres.bag"), folder / "out");
  expect_ramp(capture, 4, 0, 0, 1.01e-4f);
  EXPECT_EQ(capture.depth.front().depth_scale, units_of_metres);
  const PinholeCamera& camera = capture.depth.front().camera;  // the matrix P, not K
  EXPECT_EQ(camera.fx, 31.0);
  EXPECT_EQ(camera.cx, 13.5);
  EXPECT_EQ(camera.fy, 34.0);
  EXPECT_EQ(camera.cy, 12.5);
  EXPECT_FALSE(camera.lens.bends());
}

TEST(Bag, ReadsTheUnitThatTheViewerStates) {
  const TemporaryFolder folder;
  const Capture capture = imported(import_data("viewer.bag"), folder / "out");
  expect_ramp(capture, 4);
  EXPECT_NEAR(capture.depth.front().depth_scale, 1e4, 1e-2);
  EXPECT_THAT(complaint_of([&] { (void)imported(import_data("no_unit.bag"), folder / "no"); }),
              HasSubstr("--depth-scale"));
  ImportOptions options;
  options.depth_scale = 1000.0;
  options.camera = folder.write("c.json", R"({"width":24,"height":18,"fx":40,"fy":41,"cx":12,"cy":9})");
  const Capture said = imported(import_data("no_unit.bag"), folder / "said", "", options);
  expect_ramp(said, 4);
  EXPECT_EQ(said.depth.front().camera.fy, 41.0);
}

TEST(Bag, RefusesColoursOtherTopicsAndDamage) {
  const TemporaryFolder folder;
  EXPECT_THAT(complaint_of([&] { (void)imported(import_data("colours.bag"), folder / "out"); }),
              HasSubstr("colourised depth: an image of encoding rgb8"));
  ImportOptions options;
  options.topics = {"/camera/none"};
  EXPECT_THAT(complaint_of([&] { (void)imported(import_data("plain.bag"), folder / "out", "", options); }),
              HasSubstr("/camera/none"));
  const std::string whole = read_file(import_data("plain.bag"));
  for (const std::size_t length : {std::size_t(5), std::size_t(100), whole.size() / 3, whole.size() - 7}) {
    folder.write("cut.bag", whole.substr(0, length));
    EXPECT_NE(complaint_of([&] { (void)imported(folder / "cut.bag", folder / "out"); }), "") << length;
  }
  std::string packed = read_file(import_data("lz4.bag"));
  for (std::size_t i = 6000; i < 6400 && i < packed.size(); ++i) packed[i] = char(packed[i] ^ 0x5a);
  folder.write("bad.bag", packed);
  EXPECT_NE(complaint_of([&] { (void)imported(folder / "bad.bag", folder / "out"); }), "");
  folder.write("half.db3", read_file(import_data("humble/humble.db3")).substr(0, 6000));
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "half.db3", folder / "out"); }), HasSubstr("half.db3"));
  folder.write("text.db3", "no database at all, but long enough to look at, and then some more words");
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "text.db3", folder / "out"); }), HasSubstr("SQLite"));
  EXPECT_FALSE(is_file(folder / "out/capture.toml"));
}

}  // namespace pliant::bag_test
