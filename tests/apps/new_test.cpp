// A capture.toml for what lies in a folder.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "apps/program.hpp"
#include "base/files.hpp"
#include "capture/capture.hpp"
#include "capture/folder_survey.hpp"
#include "capture/image_io.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::new_test {
namespace {

using testing::HasSubstr;
using testing::Not;

namespace fs = std::filesystem;

constexpr int bad_input = 2;
constexpr int width = 160, height = 120;
constexpr double fx = 150.0, tilt = 0.4, camera_height = 0.8;  // [pixels], [rad], [m]

/// What a tilted camera sees of a floor and a box on it, in millimetres.
Image<std::uint16_t> view(double shift) {
  Image<std::uint16_t> image(width, height, 0);
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const double x = (u - 79.5) / fx, y = (v - 59.5) / fx;
      const double down = y * std::cos(tilt) + std::sin(tilt);  // of the ray of depth 1
      double depth = down > 0.05 ? camera_height / down : 0.0;
      if (std::abs(x - shift) < 0.12 && std::abs(y - 0.05) < 0.12) depth = 1.2;
      if (depth > 0.0 && depth < 6.0) image(u, v) = std::uint16_t(std::lround(1000.0 * depth));
    }
  return image;
}

class New : public testing::Test {
 protected:
  void record(const std::string& pattern, int first, int count) {
    for (int k = 0; k < count; ++k) {
      const fs::path path = folder.path() / FramePattern{pattern}(first + k);
      make_folder(path.parent_path());
      write_png(path, view(0.01 * k));
    }
  }
  std::vector<std::string> words(std::vector<std::string> more = {}) const {
    std::vector<std::string> all = {"new", folder.path().string(), "--mass", "0.25", "--rate", "30", "--fx",
                                    "150", "--depth-scale",        "1000"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  TemporaryFolder folder;
};

TEST_F(New, WritesACaptureWithTheFloorThatItSees) {
  record("depth/frame_%04d.png", 0, 6);
  const ProgramRun run = run_pliant(words());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("6 images depth/frame_%04d.png of 160 x 120 pixels"));
  const Capture capture = read_capture(folder.path());
  EXPECT_EQ(capture.frame_count(), 6);
  EXPECT_EQ(capture.scene.object.mass, 0.25);
  ASSERT_EQ(capture.depth.size(), 1u);
  EXPECT_EQ(capture.depth[0].camera.fy, 150.0);
  EXPECT_EQ(capture.depth[0].camera.cx, 79.5);
  // The floor is y = 0, the camera as high above it as it was, and tilted down.
  ASSERT_EQ(capture.scene.planes.size(), 1u);
  EXPECT_NEAR(capture.scene.planes[0].normal.y(), 1.0, 1e-9);
  const RigidMotion& pose = capture.depth[0].camera.camera_to_world;
  EXPECT_NEAR(pose.translation.y(), camera_height, 0.01);
  EXPECT_NEAR(std::asin(-pose.rotation.col(2).y()), tilt, 0.01);
  EXPECT_NEAR(capture.scene.world.gravity->y(), -9.81, 1e-9);
  const ProgramRun check = run_pliant({"check", folder.path().string()});
  EXPECT_EQ(check.exit_code, 0) << check.err;
}

TEST_F(New, NumbersFilesFromZeroWhereTheyBeginElsewhereOrHaveGaps) {
  record("depth_%d.png", 98, 5);  // 98 .. 102: no zeros in front
  remove_file(folder.path() / "depth_100.png");
  const ProgramRun run = run_pliant(words());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("numbered from 98: they are copied"));
  EXPECT_THAT(run.out, HasSubstr("1 of 5 frames are missing"));
  const Capture capture = read_capture(folder.path());
  ASSERT_EQ(capture.frame_count(), 4);
  const std::vector<double>& times = capture.scene.timing.times;
  EXPECT_NEAR((times[2] - times[1]) / (times[1] - times[0]), 2.0, 1e-6) << "time passes where a frame is missing";
  EXPECT_EQ(read_depth_image(folder.path() / capture.depth[0].images(2)).pixels, view(0.03).pixels);
}

TEST_F(New, NamesAllThatItMustBeToldAtOnce) {
  record("%06d.png", 0, 3);
  const ProgramRun run = run_pliant({"new", folder.path().string()});
  EXPECT_EQ(run.exit_code, bad_input);
  for (const char* option : {"--mass", "--rate", "--fx", "--depth-scale"}) EXPECT_THAT(run.err, HasSubstr(option));
  EXPECT_FALSE(fs::exists(folder.path() / "capture.toml"));
}

TEST_F(New, TakesTheCameraFromItsFile) {
  record("%06d.png", 0, 3);
  folder.write(
      "camera.json",
      R"({"width": 160, "height": 120, "fx": 151, "fy": 152, "cx": 80, "cy": 60, "fps": 15, "depth_scale": 1000})");
  const ProgramRun run = run_pliant({"new", folder.path().string(), "--mass", "0.3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Capture capture = read_capture(folder.path());
  EXPECT_EQ(capture.depth[0].camera.fx, 151.0);
  EXPECT_EQ(capture.depth[0].camera.cy, 60.0);
  EXPECT_EQ(capture.scene.timing.frame_rate, 15.0);
}

TEST_F(New, TakesTheSurfaceAndMasks) {
  record("depth/%03d.png", 0, 3);
  Image<std::uint8_t> mask(width, height);
  for (int v = height / 4; v < height / 2; ++v)
    for (int u = width / 4; u < width / 2; ++u) mask(u, v) = 255;
  make_folder(folder.path() / "mask");
  for (int k = 0; k < 3; ++k) write_png(folder.path() / FramePattern{"mask/mask_%03d.png"}(k), mask);
  std::ofstream(folder.path() / "bear.obj")
      << "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  const ProgramRun run = run_pliant(words());
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Capture capture = read_capture(folder.path());
  EXPECT_TRUE(capture.depth[0].masks.has_value());
  EXPECT_EQ(capture.scene.object.surface->vertices.size(), 4u);
  EXPECT_FALSE(capture.scene.object.pose_is_known) << "masks show where the object is";
}

TEST_F(New, TakesClouds) {
  for (int k = 1; k <= 3; ++k)
    std::ofstream(folder.path() / FramePattern{"cloud_%02d.ply"}(k))
        << "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
        << "0 0 " << k << "\n1 0 0\n";
  const ProgramRun run = run_pliant({"new", folder.path().string(), "--mass", "1", "--rate", "30"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Capture capture = read_capture(folder.path());
  EXPECT_EQ(capture.frame_count(), 3);
  EXPECT_EQ(capture.scene.world.up, Vector3(0, 1, 0));
}

TEST_F(New, RefusesPaintedDepthByName) {
  make_folder(folder.path() / "depth");
  for (int k = 0; k < 2; ++k)
    write_png(folder.path() / FramePattern{"depth/%06d.png"}(k), Image<Rgb>(8, 8, Rgb{255, 0, 0}));
  const ProgramRun run = run_pliant(words());
  EXPECT_EQ(run.exit_code, bad_input);
  EXPECT_THAT(run.err, HasSubstr("colourised depth"));
}

TEST_F(New, LeavesACaptureAlone) {
  record("%06d.png", 0, 2);
  std::ofstream(folder.path() / "capture.toml") << "format = \"capture/1\"\n";
  const ProgramRun run = run_pliant(words());
  EXPECT_EQ(run.exit_code, bad_input);
  EXPECT_THAT(run.err, HasSubstr("there already"));
  EXPECT_EQ(read_file(folder.path() / "capture.toml"), "format = \"capture/1\"\n");
}

TEST_F(New, IsOfferedByCheckWhereThereIsSomethingToDescribe) {
  folder.write("notes.txt", "nothing recorded");
  EXPECT_THAT(run_pliant({"check", folder.path().string()}).err, Not(HasSubstr("pliant new")));
  record("%06d.png", 0, 2);
  EXPECT_THAT(run_pliant({"check", folder.path().string()}).err, HasSubstr("`pliant new " + folder.path().string()));
}

TEST_F(New, AnEmptyFolderIsNamedWithWhatIsWanted) {
  const ProgramRun run = run_pliant({"new", folder.path().string()});
  EXPECT_EQ(run.exit_code, bad_input);
  EXPECT_THAT(run.err, HasSubstr("neither depth images nor clouds"));
}

}  // namespace
}  // namespace pliant::test::new_test
