// Plain videos, made here by ffmpeg of painted pictures: masks, times, and what cannot be told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "geometry/mesh_io.hpp"
#include "geometry/meshes.hpp"
#include "import_tools.hpp"
#include "imports/ffmpeg.hpp"
#include "picture_tools.hpp"

namespace pliant::video_test {

using namespace test;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr int width = 192, height = 144, frames = 20;
constexpr double least_overlap = 0.97;  // a shift of the outline by half a pixel

void ffmpeg(const TemporaryFolder& folder, const std::string& arguments) {
  ASSERT_EQ(
      std::system(("cd '" + folder.path().string() + "' && ffmpeg -y -v error " + arguments + " </dev/null").c_str()),
      0);
}

Image<std::uint8_t> truth(int frame) { return ring_mask(width, height, 60.0 + 3.0 * frame, 40.0 + 3.0 * frame, 26.0); }

// A ring that crosses a wall which is lit from one side.
void write_pictures(const TemporaryFolder& folder, double wall = 205.0, const Rgb& object = {110, 105, 100}) {
  for (int frame = 0; frame < frames; ++frame) {
    const Image<std::uint8_t> mask = truth(frame);
    char name[32];
    std::snprintf(name, sizeof name, "%04d.png", frame);
    const auto colour = [&](int u, int v) {
      const auto level = std::uint8_t(wall - 0.1 * u);
      return mask(u, v) != 0 ? object : Rgb{level, level, level};
    };
    write_png(folder / name, painted(width, height, colour, 3.0, unsigned(frame + 1)));
  }
}

constexpr const char* h264 = "-framerate 50 -i %04d.png -c:v libx264 -crf 20 -pix_fmt yuv420p ";

ImportOptions with_view(double degrees) {
  ImportOptions options;
  options.field_of_view_deg = degrees;
  return options;
}

// What makes silhouettes alone a whole capture.
CaptureFacts whole_facts(const TemporaryFolder& folder) {
  CaptureFacts facts;
  write_mesh(folder / "scan.ply", box_mesh({-0.2, -0.2, 0.8}, {0.2, 0.2, 1.2}));
  facts.surface = folder / "scan.ply";
  facts.mass = 5.0;
  facts.up = -Vector3::UnitY();
  return facts;
}

void expect_truth(const Capture& capture, const std::function<Image<std::uint8_t>(int)>& expected) {
  for (int frame = 0; frame < capture.frame_count(); ++frame)
    EXPECT_GT(intersection_over_union(read_object_mask(capture, capture.silhouettes.front(), frame), expected(frame)),
              least_overlap)
        << "frame " << frame;
}

class Video : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed: no video is made";
  }
  const TemporaryFolder folder_;
};

TEST_F(Video, BecomesMasksWithTheCameraTheRateAndAnOverview) {
  write_pictures(folder_);
  ffmpeg(folder_, std::string(h264) + "\"it's.mp4\"");
  const auto source = folder_ / "it's.mp4";
  const ImportedCapture written =
      write_recording(folder_ / "out", import_format("", source).read(source, with_view(60.0)), whole_facts(folder_));
  EXPECT_THAT(written.notes, Contains(HasSubstr("background: plain")));
  const Capture capture = read_capture(folder_ / "out");
  ASSERT_EQ(capture.silhouettes.size(), 1u);
  ASSERT_EQ(capture.frame_count(), frames);
  EXPECT_EQ(capture.scene.timing.frame_rate, 50.0);
  const PinholeCamera& camera = capture.silhouettes.front().camera;
  EXPECT_EQ(camera.width, width);
  EXPECT_NEAR(camera.fx, 0.5 * width / std::tan(30.0 / 180.0 * 3.14159265358979), 1e-6);
  EXPECT_EQ(camera.cx, 0.5 * (width - 1));
  expect_truth(capture, truth);
  const ImageHeader overview = read_image_header(folder_ / "out/masks_overview.png");
  EXPECT_GE(overview.width, 4 * width);
  EXPECT_EQ(overview.channels, 3);
  EXPECT_THAT(read_file(folder_ / "out/capture.toml"), HasSubstr("# Still to say: `camera_to_world`"));
}

TEST_F(Video, TakesLightObjectsRangesAndFx) {
  write_pictures(folder_, 60.0, {210, 200, 190});
  ffmpeg(folder_, std::string(h264) + "film.mov");
  ImportOptions options;
  options.fx = 300.0;
  CaptureFacts facts = whole_facts(folder_);
  facts.first = 4, facts.last = 16, facts.every = 3;
  const Capture capture = imported(folder_ / "film.mov", folder_ / "out", "", options, facts);
  EXPECT_EQ(capture.frame_count(), 5);
  EXPECT_NEAR(capture.scene.timing.times[1], 0.06, 1e-9);
  EXPECT_EQ(capture.silhouettes.front().camera.fx, 300.0);
  expect_truth(capture, [](int frame) { return truth(4 + 3 * frame); });
}

TEST_F(Video, KeepsTheTimesOfImagesThatAreNotEven) {
  write_pictures(folder_);
  ffmpeg(folder_, std::string(h264) +
                      "-vf \"settb=1/90000,setpts='(N+0.3*mod(N,3))/50/TB'\" -fps_mode vfr -enc_time_base 1/90000 "
                      "-video_track_timescale 90000 uneven.mp4");
  const Capture capture = imported(folder_ / "uneven.mp4", folder_ / "out", "", with_view(60.0), whole_facts(folder_));
  ASSERT_EQ(capture.frame_count(), frames);
  EXPECT_EQ(capture.scene.timing.frame_rate, 0.0);
  for (int i = 0; i < frames; ++i)
    EXPECT_NEAR(capture.scene.timing.times[std::size_t(i)], (i + 0.3 * (i % 3)) / 50.0, 2e-4);
  expect_truth(capture, truth);
}

TEST_F(Video, IsTurnedAsItsPlayerTurnsIt) {
  write_pictures(folder_);
  ffmpeg(folder_, std::string(h264) + "lying.mp4");
  ffmpeg(folder_, "-i lying.mp4 -c copy -metadata:s:v:0 rotate=90 upright.mp4");
  if (output_of("ffprobe -v quiet -show_streams " + ffmpeg_argument(folder_ / "upright.mp4")).find("rotation=90") ==
      std::string::npos)
    GTEST_SKIP() << "this ffmpeg writes no rotation";
  const Capture capture = imported(folder_ / "upright.mp4", folder_ / "out", "", with_view(60.0), whole_facts(folder_));
  EXPECT_EQ(capture.silhouettes.front().camera.width, height);
  EXPECT_EQ(capture.silhouettes.front().camera.height, width);
  expect_truth(capture, [](int frame) {
    const Image<std::uint8_t> stored = truth(frame);
    Image<std::uint8_t> upright(height, width);  // against the clock by a quarter
    for (int v = 0; v < height; ++v)
      for (int u = 0; u < width; ++u) upright(v, width - 1 - u) = stored(u, v);
    return upright;
  });
}

TEST_F(Video, OfMatroskaWithoutDepthIsNoKinects) {
  write_pictures(folder_);
  ffmpeg(folder_, std::string(h264) + "film.mkv");
  const Capture capture = imported(folder_ / "film.mkv", folder_ / "out", "", with_view(60.0), whole_facts(folder_));
  EXPECT_EQ(capture.scene.timing.frame_rate, 50.0);
  EXPECT_EQ(capture.silhouettes.size(), 1u);
}

TEST_F(Video, SaysWhenItIsSlowMotion) {
  write_pictures(folder_);
  ffmpeg(folder_, std::string(h264) + "-movflags use_metadata_tags -metadata com.android.capture.fps=240 slow.mp4");
  EXPECT_THAT(read_video(folder_ / "slow.mp4", with_view(60.0)).notes, Contains(HasSubstr("slow motion: 240 images")));
}

TEST_F(Video, AsksForTheFocalLengthAndTheRightCamera) {
  write_pictures(folder_);
  ffmpeg(folder_, std::string(h264) + "film.mp4");
  EXPECT_THAT(complaint_of([&] { (void)read_video(folder_ / "film.mp4", {}); }), HasSubstr("unknown focal length"));
  ImportOptions options;
  options.camera = folder_.write("c.json", R"({"width":320,"height":240,"fx":252,"fy":252,"cx":160,"cy":120})");
  EXPECT_THAT(complaint_of([&] { (void)read_video(folder_ / "film.mp4", options); }),
              HasSubstr("a camera of 320 x 240"));
  options = with_view(60.0);
  options.background = (folder_ / "gone.png").string();
  EXPECT_THAT(complaint_of([&] { (void)read_video(folder_ / "film.mp4", options); }), HasSubstr("no picture"));
}

TEST_F(Video, TakesAPictureOfTheEmptyScene) {
  write_pictures(folder_);
  ffmpeg(folder_, std::string(h264) + "film.mp4");
  write_png(folder_ / "empty.png", painted(width, height, [](int u, int) {
              const auto level = std::uint8_t(205.0 - 0.1 * u);
              return Rgb{level, level, level};
            }));
  ImportOptions options = with_view(60.0);
  options.background = (folder_ / "empty.png").string();
  expect_truth(imported(folder_ / "film.mp4", folder_ / "out", "", options, whole_facts(folder_)), truth);
}

TEST_F(Video, RefusesWhatIsNoneAndObjectsThatAreNotTold) {
  folder_.write("text.mp4", "no video at all");
  EXPECT_THAT(complaint_of([&] { (void)read_video(folder_ / "text.mp4", with_view(60.0)); }),
              HasSubstr("ffprobe finds no pictures"));
  write_pictures(folder_, 205.0, {196, 196, 196});
  ffmpeg(folder_, std::string(h264) + "faint.mp4");
  EXPECT_THAT(complaint_of([&] { (void)read_video(folder_ / "faint.mp4", with_view(60.0)); }),
              HasSubstr("the object is not told from the background"));
  // The ring is gone from image 12 on.
  write_pictures(folder_);
  for (int frame = 12; frame < frames; ++frame)
    write_png(folder_ / ("00" + std::to_string(frame) + ".png"), painted(width, height, [](int u, int) {
                const auto level = std::uint8_t(205.0 - 0.1 * u);
                return Rgb{level, level, level};
              }));
  ffmpeg(folder_, std::string(h264) + "gone.mp4");
  const ImportedRecording recording = read_video(folder_ / "gone.mp4", with_view(60.0));
  const std::string complaint = complaint_of([&] { (void)write_recording(folder_ / "out", recording, {}); });
  EXPECT_THAT(complaint, HasSubstr("image 12: only"));
  EXPECT_THAT(complaint, HasSubstr("--last"));
}

TEST(VideoWithoutFfmpeg, NamesThePackage) {
  const TemporaryFolder folder;
  folder.write("film.mp4", "whatever it holds");
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", folder.path().c_str(), 1);
  const std::string complaint =
      complaint_of([&] { (void)import_format("", folder / "film.mp4").read(folder / "film.mp4", with_view(60.0)); });
  ::setenv("PATH", path.c_str(), 1);
  EXPECT_THAT(complaint, HasSubstr("install the package ffmpeg"));
  EXPECT_THAT(complaint, HasSubstr("film.mp4"));
}

}  // namespace pliant::video_test
