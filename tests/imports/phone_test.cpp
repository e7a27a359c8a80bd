// Recordings of phones: Record3D's .r3d with data that Apple's LZFSE compressed, and Stray Scanner's folders, written
// here by their documented layout.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "base/sha256.hpp"
#include "import_tools.hpp"
#include "imports/lzfse.hpp"
#include "imports/zip_archive.hpp"

namespace pliant::phone_test {

using namespace test;
using ::testing::HasSubstr;

TEST(Lzfse, DecompressesWhatAppleCompressed) {
  std::istringstream sums(read_file(import_data("lzfse_sha256.txt")));
  int count = 0;
  for (std::string name, sum; sums >> name >> sum; ++count) {
    const std::string packed = read_file(import_data(name + ".lzfse"));
    EXPECT_EQ(sha256({lzfse_decompressed(packed, 200000, name)}), sum) << name;
  }
  EXPECT_EQ(count, 3);
}

TEST(Lzfse, RefusesWhatIsCutShortDamagedOrTooLong) {
  for (const char* name : {"stored", "lzvn", "mixed"}) {
    const std::string packed = read_file(import_data(std::string(name) + ".lzfse"));
    for (std::size_t length = 0; length < packed.size(); length += 1 + length / 8)
      EXPECT_NE(complaint_of([&] { (void)lzfse_decompressed(packed.substr(0, length), 200000, name); }), "") << length;
    EXPECT_THAT(complaint_of([&] { (void)lzfse_decompressed(packed, 1000, name); }), HasSubstr("at most 1000"));
    for (std::size_t at = 0; at < packed.size(); at += 7) {
      std::string damaged = packed;
      damaged[at] = char(damaged[at] ^ 0x11);
      try {  // another content or a complaint, never anything else
        EXPECT_LE(lzfse_decompressed(damaged, 200000, name).size(), 200000u);
      } catch (const InputError&) {
      }
    }
  }
}

TEST(Zip, RefusesCutArchivesAndOtherFiles) {
  const TemporaryFolder folder;
  const std::string whole = read_file(import_data("phone.r3d"));
  for (const std::size_t length : {std::size_t(0), std::size_t(40), whole.size() / 2, whole.size() - 30}) {
    folder.write("cut.r3d", whole.substr(0, length));
    EXPECT_THAT(complaint_of([&] { (void)ZipArchive(folder / "cut.r3d"); }), HasSubstr("cut.r3d")) << length;
  }
  std::string damaged = whole;
  for (std::size_t i = 900; i < 1000; ++i) damaged[i] = char(~damaged[i]);
  folder.write("bad.r3d", damaged);
  const ZipArchive archive(folder / "bad.r3d");
  EXPECT_THAT(complaint_of([&] { (void)archive.read("rgbd/0.depth"); }), HasSubstr("check sum"));
  EXPECT_THAT(complaint_of([&] { (void)archive.read("rgbd/9.depth"); }), HasSubstr("rgbd/9.depth"));
}

TEST(Record3d, BecomesACaptureWithPixelsTimesAndPoses) {
  const TemporaryFolder folder;
  EXPECT_EQ(import_format("", import_data("phone.r3d")).name, "r3d");
  const Capture capture = imported(import_data("phone.r3d"), folder / "out");
  ASSERT_EQ(capture.frame_count(), 3);
  EXPECT_NEAR(capture.scene.timing.times[2], 0.25, 1e-9);
  EXPECT_EQ(*capture.scene.world.gravity, Vector3(0, -9.81, 0));
  const DepthCamera& camera = capture.depth.front();
  EXPECT_EQ(camera.camera.width, 96);
  EXPECT_NEAR(camera.camera.fx, 100.0, 1e-9);
  EXPECT_NEAR(camera.camera.fy, 101.0, 1e-9);
  EXPECT_NEAR(camera.camera.cx, 47.5, 1e-9);  // (191.5 + 0.5) / 4 - 0.5
  EXPECT_NEAR(camera.camera.cy, 35.5, 1e-9);
  for (int frame = 0; frame < 3; ++frame) {
    const DepthImage depth = read_depth(capture, camera, frame);
    for (int v = 0; v < 72; ++v)
      for (int u = 0; u < 96; ++u) {
        const bool is_missing = (u == 0 && v == 0) || (u == 7 && v == 5);  // no number, low confidence
        ASSERT_NEAR(depth(u, v), is_missing ? 0.0 : 1e-3 * (600 + u + 2 * v + u * v / 6 + 100 * frame), 1.01e-4)
            << u << " " << v;
      }
    const PinholeCamera seen = camera.at(frame);
    EXPECT_NEAR(seen.camera_to_world.translation.x(), 0.1 * frame, 1e-9);
    EXPECT_NEAR(seen.camera_to_world.rotation(2, 2), -1.0, 1e-12);  // ARKit's cameras look along -z
    EXPECT_NEAR(seen.camera_to_world.rotation(1, 1), -1.0, 1e-12);
  }
}

std::string matrix_rows() { return "1600.0, 0.0, 959.5\n0.0, 1610.0, 719.5\n0.0, 0.0, 1.0\n"; }

TEST(StrayScanner, BecomesACaptureWithConfidencePosesAndTimes) {
  const TemporaryFolder folder;
  std::string odometry = "timestamp, frame, x, y, z, qx, qy, qz, qw\n";
  for (int i = 0; i < 3; ++i) {
    char name[32];
    std::snprintf(name, sizeof name, "%06d.png", i);
    write_png(folder / (std::string("in/depth/") + name), ramp_image(24, 18, i));
    Image<std::uint8_t> sure(24, 18, 2);
    sure(3, 4) = 0;
    write_png(folder / (std::string("in/confidence/") + name), sure);
    odometry += std::to_string(50.0 + 0.1 * i) + ", " + std::to_string(i) + ", " + std::to_string(0.05 * i) +
                ", 1.5, 0.25, 0, 0, 0.7071067811865476, 0.7071067811865476\n";
  }
  folder.write("in/odometry.csv", odometry);
  folder.write("in/camera_matrix.csv", matrix_rows());
  EXPECT_EQ(import_format("", folder / "in").name, "stray");
  const Capture capture = imported(folder / "in", folder / "out");
  ASSERT_EQ(capture.frame_count(), 3);
  const DepthCamera& camera = capture.depth.front();
  EXPECT_NEAR(camera.camera.fx, 20.0, 1e-9);
  EXPECT_NEAR(camera.camera.cx, 11.5, 1e-9);
  EXPECT_NEAR(camera.camera.fy, 1610.0 / 80.0, 1e-9);
  EXPECT_NEAR(capture.scene.timing.times[2], 0.2, 1e-6);
  EXPECT_EQ(read_depth(capture, camera, 1)(3, 4), 0.0f);
  EXPECT_NEAR(read_depth(capture, camera, 1)(4, 3), 1e-3 * ramp(4, 3, 1), 1e-6);
  EXPECT_NEAR((camera.at(2).camera_to_world.translation - Vector3(0.1, 1.5, 0.25)).norm(), 0.0, 1e-9);
  EXPECT_NEAR(camera.at(2).camera_to_world.rotation(1, 0), 1.0, 1e-9);
  folder.write("in/odometry.csv", odometry.substr(0, odometry.size() / 2));
  EXPECT_NE(complaint_of([&] { (void)read_stray_scanner(folder / "in", {}); }), "");
  folder.write("in/odometry.csv", odometry);
  folder.write("in/camera_matrix.csv", "20, 0, 11.5\n0, 20, 8.5\n0, 0, 1\n");
  EXPECT_THAT(complaint_of([&] { (void)read_stray_scanner(folder / "in", {}); }), HasSubstr("1920 pixels wide"));
}

}  // namespace pliant::phone_test
