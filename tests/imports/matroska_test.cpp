// Matroska recordings as the Azure Kinect's recorder lays them out: made here by ffmpeg, with a calibration attached.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "import_tools.hpp"

namespace pliant::matroska_test {

using namespace test;
using ::testing::HasSubstr;

constexpr const char* calibration = R"({"CalibrationInformation": {"Cameras": [
  {"Purpose": "CALIBRATION_CameraPurposeColor", "Intrinsics": {"ModelParameters": [0.5]}},
  {"Purpose": "CALIBRATION_CameraPurposeDepth", "SensorWidth": 1024, "SensorHeight": 1024, "Intrinsics": {
    "ModelParameterCount": 14, "ModelType": "CALIBRATION_LensDistortionModelBrownConrady",
    "ModelParameters": [0.501, 0.502, 0.4925, 0.4926, 0.31, 0.05, 0.0125, 0.65, 0.12, 0.0375, 0, 0, 2e-5, 3e-5]}}]}})";

bool has_ffmpeg() { return std::system("command -v ffmpeg >/dev/null 2>&1") == 0; }

void write_raw(const TemporaryFolder& folder) {
  std::string raw;
  for (int frame = 0; frame < 3; ++frame)
    for (const std::uint16_t z : ramp_image(320, 288, frame).pixels) raw += {char(z >> 8), char(z & 255)};
  folder.write("raw", raw);
  folder.write("calibration.json", calibration);
}

int ffmpeg(const TemporaryFolder& folder, const std::string& arguments) {
  return std::system(
      ("cd '" + folder.path().string() + "' && ffmpeg -y -v error " + arguments + " </dev/null").c_str());
}

// The Kinect's recorder calls the track's pixels b16g, 16-bit grey of the greatest byte first, in a bitmap's header of
// positive height; ffmpeg writes no name, and a negative height.
void name_pixels_as_the_kinect(const std::filesystem::path& file) {
  std::string content = read_file(file);
  const std::string before("\x28\0\0\0\x40\x01\0\0\xe0\xfe\xff\xff\x01\0\x10\0\0\0\0\0", 20);  // 320 x -288, 16 bits
  const std::string after(
      "\x28\0\0\0\x40\x01\0\0\x20\x01\0\0\x01\0\x10\0"
      "b16g",
      20);
  const std::size_t at = content.find(before);
  ASSERT_NE(at, std::string::npos);
  write_file(file, content.replace(at, before.size(), after));
}

constexpr const char* depth_in = "-f rawvideo -pix_fmt gray16be -s 320x288 -r 15 -i raw ";
constexpr const char* attached =
    "-attach calibration.json -metadata:s:t mimetype=application/octet-stream -metadata:s:t filename=calibration.json ";

TEST(Matroska, BecomesACaptureWithPixelsTimesAndTheFactorysLens) {
  if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg";
  const TemporaryFolder folder;
  write_raw(folder);
  ASSERT_EQ(ffmpeg(folder, std::string("-f lavfi -i testsrc=s=64x48:r=15:d=0.2 ") + depth_in + attached +
                               "-map 0:v -map 1:v -c:v:0 mjpeg -c:v:1 rawvideo -pix_fmt:v:1 gray16be "
                               "-metadata:s:v:0 title=COLOR -metadata:s:v:1 title=DEPTH -allow_raw_vfw 1 \"it's.mkv\""),
            0);
  name_pixels_as_the_kinect(folder / "it's.mkv");
  const Capture capture = imported(folder / "it's.mkv", folder / "out");
  expect_ramp(capture, 3);
  EXPECT_NEAR(capture.scene.timing.times[2], 2.0 / 15.0, 1.1e-3);
  const PinholeCamera& camera = capture.depth.front().camera;
  EXPECT_NEAR(camera.cx, 0.501 * 512 - 96 - 0.5, 1e-9);
  EXPECT_NEAR(camera.cy, 0.502 * 512 - 90 - 0.5, 1e-9);
  EXPECT_NEAR(camera.fx, 0.4925 * 512, 1e-9);
  EXPECT_NEAR(camera.fy, 0.4926 * 512, 1e-9);
  EXPECT_EQ(camera.lens.coefficients(), (std::vector<double>{0.31, 0.05, 3e-5, 2e-5, 0.0125, 0.65, 0.12, 0.0375}));
}

TEST(Matroska, RefusesColourisedDepthMissingCalibrationAndDamage) {
  if (!has_ffmpeg()) GTEST_SKIP() << "no ffmpeg";
  const TemporaryFolder folder;
  write_raw(folder);
  ASSERT_EQ(ffmpeg(folder, "-f lavfi -i testsrc=s=64x48:r=15:d=0.2 -c:v mjpeg -metadata:s:v:0 title=DEPTH colours.mkv"),
            0);
  EXPECT_THAT(complaint_of([&] { (void)read_matroska(folder / "colours.mkv", {}); }), HasSubstr("colourised depth"));
  ASSERT_EQ(ffmpeg(folder, std::string(depth_in) + "-c:v ffv1 -pix_fmt gray16le bare.mkv"), 0);
  EXPECT_THAT(complaint_of([&] { (void)read_matroska(folder / "bare.mkv", {}); }),
              HasSubstr("no calibration attached"));
  folder.write("text.mkv", "no recording at all");
  EXPECT_THAT(complaint_of([&] { (void)read_matroska(folder / "text.mkv", {}); }), HasSubstr("ffprobe finds no track"));
  ImportOptions options;
  options.camera = folder.write("c.json", R"({"width":320,"height":288,"fx":252,"fy":252,"cx":160,"cy":144})");
  expect_ramp(imported(folder / "bare.mkv", folder / "out", "", options), 3);
}

}  // namespace pliant::matroska_test
