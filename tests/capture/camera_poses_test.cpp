// A camera that moves while it records: `poses` of a [[depth]] block.
#include "capture/camera_poses.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "capture/observe.hpp"
#include "input_errors.hpp"
#include "small_capture.hpp"

namespace pliant::camera_poses_test {

using namespace test;
using ::testing::HasSubstr;

constexpr const char* standing = "camera_to_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]]";

RigidMotion pose_of(int frame) {
  return {Eigen::AngleAxisd(0.05 * frame, Vector3(1, 2, 3).normalized()).toRotationMatrix(),
          Vector3(0.02 * frame, -0.01 * frame, -1.0)};
}

std::vector<RigidMotion> four_poses() { return {pose_of(0), pose_of(1), pose_of(2), pose_of(3)}; }

TEST(CameraPoses, AreReadAsTheyWereWritten) {
  const TemporaryFolder folder;
  write_camera_poses(folder / "p.csv", four_poses());
  const std::vector<RigidMotion> read = read_camera_poses(folder / "p.csv", 4, 1);
  ASSERT_EQ(read.size(), 4u);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR((read[std::size_t(i)].rotation - pose_of(i).rotation).norm(), 0.0, 1e-10);
    EXPECT_NEAR((read[std::size_t(i)].translation - pose_of(i).translation).norm(), 0.0, 1e-9);
  }
}

TEST(CameraPoses, OfMissingFramesAreRefusedWhereThereIsAnImage) {
  const TemporaryFolder folder;
  const auto text = std::string("frame,x,y,z,qx,qy,qz,qw\n");
  folder.write("p.csv", text + "0,0,0,0,0,0,0,2\n2,1,0,0,0,0,1,1\n");
  EXPECT_THAT(complaint_of([&] { (void)read_camera_poses(folder / "p.csv", 3, 1); }), HasSubstr("no pose of frame 1"));
  const std::vector<RigidMotion> read = read_camera_poses(folder / "p.csv", 3, 2);
  EXPECT_EQ(read[1], read[0]);
  EXPECT_NEAR(read[2].rotation(1, 0), 1.0, 1e-12);
  folder.write("p.csv", text + "0,0,0,0,0,0,0,0\n");
  EXPECT_THAT(complaint_of([&] { (void)read_camera_poses(folder / "p.csv", 1, 1); }), HasSubstr("quaternion of zero"));
  folder.write("p.csv", text + "5,0,0,0,0,0,0,1\n");
  EXPECT_THAT(complaint_of([&] { (void)read_camera_poses(folder / "p.csv", 2, 1); }), HasSubstr("frame 5"));
  folder.write("p.csv", text + "0,0,0,0,0,0,0,1\n0,0,0,0,0,0,0,1\n");
  EXPECT_THAT(complaint_of([&] { (void)read_camera_poses(folder / "p.csv", 1, 1); }), HasSubstr("second pose"));
  folder.write("p.csv", "frame,x,y,z\n0,0,0,0\n");
  EXPECT_NE(complaint_of([&] { (void)read_camera_poses(folder / "p.csv", 1, 1); }), "");
}

TEST(MovingCamera, PutsEachFramesPointsWhereItStood) {
  SmallCapture small;
  const std::vector<ObservedFrame> before = observe(small.read());
  write_camera_poses(small.folder / "front/poses.csv", four_poses());
  small.edit(standing, "poses = \"front/poses.csv\"");
  const Capture capture = small.read();
  EXPECT_TRUE(has_moving_cameras(capture));
  const std::vector<ObservedFrame> after = observe(capture);
  ASSERT_EQ(after.size(), before.size());
  int compared = 0;
  for (std::size_t f = 0; f < after.size(); ++f)
    for (std::size_t i = 0; i < after[f].points.size(); ++i)
      for (std::size_t k = 0; k < before[f].points.size(); ++k) {
        if (before[f].pixel[k] != after[f].pixel[i]) continue;
        const Vector3 in_camera = before[f].points[k] - Vector3(0, 0, -1);
        ASSERT_NEAR((after[f].points[i] - pose_of(after[f].frame)(in_camera)).norm(), 0.0, 1e-8);
        ASSERT_NEAR((after[f].view[i] - pose_of(after[f].frame).rotation * before[f].view[k]).norm(), 0.0, 1e-8);
        ++compared;
      }
  EXPECT_GT(compared, 400);
}

TEST(MovingCamera, IsWrittenAndReadBack) {
  SmallCapture small;
  write_camera_poses(small.folder / "front/poses.csv", four_poses());
  small.edit(standing, "poses = \"front/poses.csv\"");
  const Capture capture = small.read();
  write_capture(small.folder.path(), capture);
  const Capture again = read_capture(small.folder.path());
  EXPECT_EQ(again.depth, capture.depth);
  EXPECT_EQ(again.depth.front().at(2).camera_to_world, capture.depth.front().moved[2]);
}

TEST(MovingCamera, IsRefusedWithWhatNeedsOneThatStands) {
  SmallCapture small;
  write_camera_poses(small.folder / "front/poses.csv", four_poses());
  small.edit(standing, std::string(standing) + "\nposes = \"front/poses.csv\"");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("both `poses` and `camera_to_world`"));
  small.edit(standing, "").edit("masks = \"front/mask_%06d.png\"", "background = \"front/background.png\"");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("a `background` of a camera that moves"));
  small.edit("background = \"front/background.png\"", "");
  const Capture capture = small.read();
  EXPECT_THAT(complaint_of([&] { require_standing_cameras(capture, "a scan"); }), HasSubstr("for a scan"));
  small.folder.write("front/poses.csv", "frame,x,y,z,qx,qy,qz,qw\n0,0,0,-1,0,0,0,1\n");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("no pose of frame 1"));
}

}  // namespace pliant::camera_poses_test
