// Folders of depth images, Open3D's and Redwood's, and TUM RGB-D, written here by their documented layouts; and the
// images of a real sensor beside the source tree.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "capture/image_io.hpp"
#include "import_tools.hpp"
#include "imports/camera_json.hpp"
#include "imports/image_sequence.hpp"

namespace pliant::image_folder_test {

using namespace test;
using ::testing::HasSubstr;

constexpr const char* plain_camera = R"({"width": 24, "height": 18, "fx": 30.0, "fy": 31.0, "cx": 11.5, "cy": 8.5})";

void write_ramps(const TemporaryFolder& folder, const std::string& pattern, int count) {
  for (int i = 0; i < count; ++i) write_png(folder / FramePattern{pattern}(i).string(), ramp_image(24, 18, i));
}

TEST(ImageFolder, BecomesACaptureWithItsPixelsTimesAndCamera) {
  const TemporaryFolder folder;
  write_ramps(folder, "in/d%d.png", 12);  // d10 comes after d9
  folder.write("in/camera.json", plain_camera);
  ImportOptions options;
  options.depth_scale = 1000.0;
  ImportedRecording recording = import_format("", folder / "in").read(folder / "in", options);
  recording.depth.front().frame_rate = 50.0;
  CaptureFacts facts;
  facts.up = Vector3(0, -2, 0), facts.first = 2, facts.last = 10, facts.every = 4;
  (void)write_recording(folder / "out", recording, facts);
  const Capture capture = read_capture(folder / "out");
  ASSERT_EQ(capture.frame_count(), 3);
  EXPECT_DOUBLE_EQ(capture.scene.timing.frame_rate, 12.5);
  EXPECT_NEAR((*capture.scene.world.gravity - Vector3(0, 9.81, 0)).norm(), 0.0, 1e-12);
  const DepthCamera& camera = capture.depth.front();
  EXPECT_EQ(camera.camera.fx, 30.0);
  EXPECT_EQ(camera.camera.fy, 31.0);
  EXPECT_EQ(camera.camera.cx, 11.5);
  EXPECT_EQ(camera.camera.cy, 8.5);
  for (int frame = 0; frame < 3; ++frame)
    EXPECT_NEAR(read_depth(capture, camera, frame)(5, 7), 1e-3 * ramp(5, 7, 2 + 4 * frame), 1e-6);
  EXPECT_EQ(read_depth(capture, camera, 0)(0, 0), 0.0f);
}

TEST(ImageFolder, AsksForAScaleARateAndACamera) {
  const TemporaryFolder folder;
  write_ramps(folder, "in/%06d.png", 2);
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "in", folder / "out"); }), HasSubstr("--camera FILE"));
  folder.write("in/camera.json", plain_camera);
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "in", folder / "out"); }), HasSubstr("--depth-scale"));
  ImportOptions options;
  options.depth_scale = 1000.0;
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "in", folder / "out", "", options); }), HasSubstr("--rate"));
  EXPECT_FALSE(is_file(folder / "out/capture.toml"));
}

TEST(ImageFolder, RefusesColourisedDepthByName) {
  const TemporaryFolder folder;
  folder.write("in/camera.json", plain_camera);
  ImportOptions options;
  options.depth_scale = 1000.0;
  write_png(folder / "in/0.png", Image<Rgb>(24, 18));
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "in", folder / "out", "", options); }),
              HasSubstr("colourised depth: an image of 8-bit RGB"));
  write_png(folder / "in/0.png", Image<std::uint8_t>(24, 18, 9));
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "in", folder / "out", "", options); }),
              HasSubstr("colourised depth: an image of 8-bit grey"));
}

TEST(ImageFolder, RefusesImagesOfAnotherSizeAndDamagedOnes) {
  const TemporaryFolder folder;
  folder.write("in/camera.json", plain_camera);
  folder.write("in/timestamps.txt", "10.0\n10.5\n");
  ImportOptions options;
  options.depth_scale = 1000.0;
  write_ramps(folder, "in/%d.png", 2);
  const std::string whole = read_file(folder / "in/1.png");
  folder.write("in/1.png", whole.substr(0, whole.size() / 2));
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "in", folder / "out", "", options); }), HasSubstr("1.png"));
  EXPECT_FALSE(is_file(folder / "out/capture.toml"));
  write_png(folder / "in/1.png", ramp_image(20, 18, 1));
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "in", folder / "out", "", options); }),
              HasSubstr("20 x 18 pixels"));
  write_ramps(folder, "in/%d.png", 2);
  expect_ramp(imported(folder / "in", folder / "out", "", options), 2);
  EXPECT_THAT(complaint_of([&] { (void)imported(folder / "in", folder / "out", "", options); }),
              HasSubstr("there already"));
}

TEST(CameraJson, ReadsOpen3dPlainAndMatrixForms) {
  const TemporaryFolder folder;
  const auto read = [&](const char* text) { return read_camera_json(folder.write("c.json", text)); };
  const CameraFile open3d = read(
      R"({"width":640,"height":480,"intrinsic_matrix":[525.0,0,0,0,526.0,0,319.5,239.5,1],"depth_scale":1000.0,"fps":30})");
  EXPECT_EQ(open3d.camera.fy, 526.0);
  EXPECT_EQ(open3d.camera.cx, 319.5);
  EXPECT_EQ(open3d.depth_scale, 1000.0);
  EXPECT_EQ(open3d.frame_rate, 30.0);
  const CameraFile realsense = read(
      R"({"width":848,"height":480,"fx":420,"fy":421,"ppx":423.5,"ppy":240.25,"coeffs":[0.1,0,0,0,0],"depth_scale":0.001})");
  EXPECT_EQ(realsense.camera.cy, 240.25);
  EXPECT_EQ(realsense.camera.lens.coefficients().front(), 0.1);
  EXPECT_NEAR(*realsense.depth_scale, 1000.0, 1e-9);
  const CameraFile rows = read(R"({"width":64,"height":48,"K":[[50,0,31],[0,51,23],[0,0,1]]})");
  EXPECT_EQ(rows.camera.fy, 51.0);
  EXPECT_EQ(rows.camera.cx, 31.0);
  EXPECT_THAT(
      complaint_of([&] { (void)read(R"({"width":64,"height":48,"intrinsic_matrix":[50,0,31,0,51,23,0,0,1]})"); }),
      HasSubstr("column by column"));
  EXPECT_THAT(complaint_of([&] { (void)read(R"({"width":64,"height":48,"fx":50)"); }), HasSubstr("no JSON object"));
  EXPECT_THAT(complaint_of([&] { (void)read(R"({"width":64,"height":48,"fx":50})"); }), HasSubstr("`fy`"));
  EXPECT_THAT(complaint_of([&] { (void)read(R"({"width":-3,"height":48,"fx":50})"); }), HasSubstr("`width`"));
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  EXPECT_THAT(complaint_of([&] { (void)read((R"({"width":64,"height":48,"K":)" + deep + "}").c_str()); }),
              HasSubstr("numbers, or rows of them"));
}

TEST(RedwoodFolder, TakesMillimetresTimesInNamesAndATrajectoryThatStands) {
  const TemporaryFolder folder;
  for (int i = 0; i < 3; ++i)
    write_png(
        folder / ("in/depth/00000" + std::to_string(i + 1) + "-00000003336" + std::to_string(9 * i % 10) + ".png"),
        ramp_image(24, 18, i));
  make_folder(folder / "in/color");
  folder.write("in/camera_intrinsic.json", plain_camera);
  std::string log;
  for (int i = 0; i < 3; ++i)
    log += std::to_string(i) + " " + std::to_string(i) + " 3\n0 -1 0 0.5\n1 0 0 0\n0 0 1 0.001\n0 0 0 1\n";
  folder.write("in/trajectory.log", log);
  EXPECT_EQ(import_format("", folder / "in").name, "redwood");
  ImportedRecording recording = read_redwood_folder(folder / "in", {});
  EXPECT_NEAR(recording.depth.front().times[0], 0.033360, 1e-9);
  recording.depth.front().times = {0.0, 0.1, 0.25};
  (void)write_recording(folder / "out", recording, {});
  const Capture capture = read_capture(folder / "out");
  expect_ramp(capture, 3);
  EXPECT_NEAR(capture.scene.timing.times[2], 0.25, 1e-9);
  const RigidMotion& pose = capture.depth.front().camera.camera_to_world;
  EXPECT_NEAR((pose.translation - Vector3(0.5, 0, 0.001)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(pose.rotation(1, 0), 1.0, 1e-9);
  folder.write("in/trajectory.log", log.substr(0, log.size() / 2));
  EXPECT_THAT(complaint_of([&] { (void)read_redwood_folder(folder / "in", {}); }), HasSubstr("five an image"));
}

TEST(TumFolder, ReadsTimesImagesScaleAndPoses) {
  const TemporaryFolder folder;
  for (int i = 0; i < 3; ++i) {
    Image<std::uint16_t> image = ramp_image(24, 18, i);
    for (std::uint16_t& raw : image.pixels) raw = std::uint16_t(5 * raw);
    write_png(folder / ("in/depth/130.0" + std::to_string(i) + ".png"), image);
  }
  folder.write("in/depth.txt",
               "# depth maps\n# timestamp filename\n130.00 depth/130.00.png\n130.03 depth/130.01.png\n130.07 "
               "depth/130.02.png\n");
  folder.write("in/groundtruth.txt", "# timestamp tx ty tz qx qy qz qw\n129.9 1 2 3 0 0 0 2\n130.2 1 2 3 0 0 0 2\n");
  folder.write("in/camera.json", plain_camera);
  EXPECT_EQ(import_format("", folder / "in").name, "tum");
  const Capture capture = imported(folder / "in", folder / "out");
  expect_ramp(capture, 3);
  EXPECT_EQ(capture.depth.front().depth_scale, 5000.0);
  EXPECT_NEAR(capture.scene.timing.times[1], 0.03, 1e-6);
  EXPECT_NEAR(capture.scene.timing.times[2], 0.07, 1e-6);
  EXPECT_EQ(capture.depth.front().camera.camera_to_world.translation, Vector3(1, 2, 3));
  const std::vector<ObservedFrame> seen = observe(capture);
  ASSERT_EQ(seen.size(), 3u);
  ASSERT_FALSE(seen[0].points.empty());
  const int pixel = seen[0].pixel[0];
  const double z = 1e-3 * ramp(pixel % 24, pixel / 24, 0);
  EXPECT_NEAR((seen[0].points[0] - capture.depth.front().camera.unproject(pixel % 24, pixel / 24, z)).norm(), 0.0,
              1e-6);
  folder.write("in/depth.txt", "130.00 depth/gone.png\n");
  EXPECT_THAT(complaint_of([&] { (void)read_tum_folder(folder / "in", {}); }), HasSubstr("depth.txt:1"));
  folder.write("in/depth.txt", "13x depth/130.00.png\n");
  EXPECT_THAT(complaint_of([&] { (void)read_tum_folder(folder / "in", {}); }), HasSubstr("13x"));
}

TEST(ImageFolder, PicturesBesideDepthAreLeftAlone) {
  const TemporaryFolder folder;
  write_ramps(folder, "depth_%d.png", 3);
  for (int i = 0; i < 3; ++i)
    write_png(folder / FramePattern{"color_%d.png"}(i).string(), Image<Rgb>(24, 18, Rgb{9, 8, 7}));
  folder.write("camera.json", plain_camera);
  ImportOptions options;
  options.depth_scale = 1000.0;
  const ImportedRecording recording = read_image_folder(folder.path(), options);
  ASSERT_EQ(recording.depth.front().image_count, 3);
  EXPECT_EQ(recording.depth.front().read(2).pixels, ramp_image(24, 18, 2).pixels);
}

TEST(ImageFolder, ReadsImagesOfARealSensor) {
  const std::filesystem::path room = shared_data() / "sensor-reader-samples/room_rgbd";
  if (!is_folder(room)) GTEST_SKIP() << "no folder " << room;
  const TemporaryFolder folder;
  for (const char* name : {"depth_1.pgm", "depth_2.pgm"})
    folder.write(std::string("in/depth/") + name, read_file(room / name));
  folder.write("in/camera.json", R"({"width":640,"height":480,"fx":518,"fy":519,"cx":325.5,"cy":253.5})");
  ImportOptions options;
  options.depth_scale = 1000.0;
  ImportedRecording recording = read_image_folder(folder / "in", options);
  recording.depth.front().frame_rate = 30.0;
  (void)write_recording(folder / "out", recording, {});
  const Capture capture = read_capture(folder / "out");
  ASSERT_EQ(capture.frame_count(), 2);
  const Image<std::uint16_t> raw = read_depth_image(room / "depth_2.pgm");
  const DepthImage depth = read_depth(capture, capture.depth.front(), 1);
  for (std::size_t i = 0; i < raw.pixels.size(); ++i) ASSERT_NEAR(depth.pixels[i], 1e-3 * raw.pixels[i], 1e-5);
}

}  // namespace pliant::image_folder_test
