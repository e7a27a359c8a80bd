// Several sensors, their clocks, cameras that move a little or much, and what is left out.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"
#include "import_tools.hpp"

namespace pliant::write_recording_test {

using namespace test;
using ::testing::Contains;
using ::testing::HasSubstr;

DepthStream stream(const std::string& name, std::vector<double> times) {
  DepthStream result;
  result.name = name;
  result.camera.width = 24, result.camera.height = 18;
  result.camera.fx = result.camera.fy = 30.0, result.camera.cx = 11.5, result.camera.cy = 8.5;
  result.depth_scale = 1000.0;
  result.image_count = int(times.size());
  result.times = std::move(times);
  result.read = [](int i) { return ramp_image(24, 18, i); };
  return result;
}

ImportedRecording recording_of(std::vector<DepthStream> streams) {
  ImportedRecording recording;
  recording.name = "made here";
  recording.depth = std::move(streams);
  return recording;
}

TEST(WriteRecording, GivesEachSensorsNearestImageAndItsOffset) {
  const TemporaryFolder folder;
  // The second sensor began two images earlier, and is 4 ms late.
  const ImportedRecording recording = recording_of(
      {stream("left", {10.0, 10.1, 10.2, 10.3}), stream("right/up", {9.804, 9.904, 10.004, 10.104, 10.204, 10.304})});
  const ImportedCapture written = write_recording(folder / "out", recording, {});
  EXPECT_EQ(written.notes.size(), 1u);  // up
  EXPECT_EQ(written.capture.scene.world.up, -Vector3::UnitY());
  const Capture capture = read_capture(folder / "out");
  expect_ramp(capture, 4, 0, 0);
  expect_ramp(capture, 4, 2, 1);
  EXPECT_EQ(capture.depth[0].time_offset, 0.0);
  EXPECT_NEAR(capture.depth[1].time_offset, 0.004, 1e-9);
  EXPECT_EQ(capture.depth[1].name, "right_up");
}

TEST(WriteRecording, LeavesOutImagesThatTimeDoesNotOrder) {
  const TemporaryFolder folder;
  const ImportedCapture written =
      write_recording(folder / "out", recording_of({stream("a", {5.0, 5.1, 5.1, 5.05, 5.3})}), {});
  EXPECT_THAT(written.notes, Contains(HasSubstr("2 images are left out")));
  const Capture capture = read_capture(folder / "out");
  ASSERT_EQ(capture.frame_count(), 3);
  EXPECT_NEAR(capture.scene.timing.times[2], 0.3, 1e-9);
  EXPECT_NEAR(read_depth(capture, capture.depth[0], 2)(3, 3), 1e-3 * ramp(3, 3, 4), 5e-6);
}

TEST(WriteRecording, TellsCamerasThatMoveFromThoseThatTremble) {
  for (const double step : {0.0009, 0.0011}) {
    const TemporaryFolder folder;
    DepthStream moving = stream("a", {0.0, 0.1, 0.2});
    for (int i = 0; i < 3; ++i) moving.poses.push_back({Matrix3::Identity(), Vector3(step * i, 0.2, 0.0)});
    (void)write_recording(folder / "out", recording_of({moving}), {});
    const Capture capture = read_capture(folder / "out");
    EXPECT_EQ(has_moving_cameras(capture), step > 0.001);
    EXPECT_NEAR(capture.depth[0].at(2).camera_to_world.translation.x(), step > 0.001 ? 2 * step : 0.0, 1e-12);
    EXPECT_NEAR(capture.depth[0].at(2).camera_to_world.translation.y(), 0.2, 1e-12);
  }
  const TemporaryFolder folder;
  DepthStream turning = stream("a", {0.0, 0.1});
  turning.poses.push_back({});
  turning.poses.push_back(
      {Eigen::AngleAxisd(0.3 * std::numbers::pi / 180, Vector3::UnitY()).toRotationMatrix(), Vector3::Zero()});
  (void)write_recording(folder / "out", recording_of({turning}), {});
  EXPECT_TRUE(has_moving_cameras(read_capture(folder / "out")));
}

TEST(WriteRecording, TakesTheScanAlongAndRefusesContradictions) {
  const TemporaryFolder folder;
  write_mesh(folder / "scan.ply", box_mesh({-0.2, -0.2, 0.5}, {0.2, 0.2, 0.9}));
  CaptureFacts facts;
  facts.surface = folder / "scan.ply", facts.mass = 0.5, facts.density = 100.0;
  const ImportedRecording recording = recording_of({stream("a", {0.0, 0.1})});
  EXPECT_THAT(complaint_of([&] { (void)write_recording(folder / "out", recording, facts); }), HasSubstr("both a mass"));
  facts.mass.reset(), facts.last = 2;
  EXPECT_THAT(complaint_of([&] { (void)write_recording(folder / "out", recording, facts); }), HasSubstr("0 to 1"));
  EXPECT_FALSE(is_file(folder / "out/capture.toml"));
  facts.last.reset();
  (void)write_recording(folder / "out", recording, facts);
  remove_file(folder / "scan.ply");
  const Capture capture = read_capture(folder / "out");
  EXPECT_EQ(capture.scene.object.surface->vertices.size(), 8u);
  EXPECT_EQ(capture.scene.object.density, 100.0);
}

}  // namespace pliant::write_recording_test
