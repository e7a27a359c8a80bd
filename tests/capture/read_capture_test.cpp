#include <filesystem>

#include "base/sha256.hpp"
#include "capture/small_capture.hpp"
#include "input_errors.hpp"

namespace pliant::read_capture_test {
namespace {

using test::complaint_of;
using test::SmallCapture;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(ReadCapture, GivesWhatIsWritten) {
  SmallCapture small;
  const Capture capture = small.read();
  EXPECT_EQ(capture.name, "box");
  EXPECT_TRUE(capture.folder.is_absolute());
  EXPECT_EQ(capture.scene.object.mass, 0.8);
  EXPECT_EQ(capture.scene.object.density, std::nullopt);
  EXPECT_EQ(capture.scene.world.up, Vector3(0, -1, 0));
  EXPECT_EQ(capture.frame_count(), 4);
  EXPECT_DOUBLE_EQ(capture.scene.timing.times[3], 3 / 60.0);
  EXPECT_EQ(capture.scene.timing.start_frame, 1);
  ASSERT_EQ(capture.scene.planes.size(), 1u);
  EXPECT_EQ(capture.scene.planes[0].normal, Vector3(0, -1, 0)) << "of unit length";
  ASSERT_EQ(capture.depth.size(), 1u);
  EXPECT_EQ(capture.depth[0].images(3), "front/000003.png");
  EXPECT_EQ(capture.depth[0].camera.camera_to_world.translation, Vector3(0, 0, -1));
  EXPECT_TRUE(std::holds_alternative<RegionHalfSpace>(capture.scene.regions.at(0).region));
}

TEST(ReadCapture, TakesFolderOrFile) {
  SmallCapture small;
  const std::string by_folder = small.read().sha256;
  EXPECT_EQ(by_folder, read_capture(small.folder / "capture.toml").sha256);
}

TEST(ReadCapture, HashesTextAndSurface) {
  SmallCapture small;
  const std::string before = small.read().sha256;
  EXPECT_EQ(before.size(), 64u);
  write_mesh(small.folder / "rest.ply", test::box_mesh(Vector3::Constant(-0.1), Vector3::Constant(0.11)));
  EXPECT_NE(small.read().sha256, before);
  // FIPS 180-2, appendix B.1
  EXPECT_EQ(sha256({"a", "bc"}), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(ReadCapture, TakesACaptureWithoutRestScan) {
  SmallCapture small;
  small.edit("surface = \"rest.ply\"\n", "");
  const Capture capture = small.read();
  EXPECT_FALSE(capture.scene.object.surface.has_value());
  EXPECT_EQ(capture.scene.object.total_mass(), 0.8);
}

TEST(ReadCapture, WeighsByDensity) {
  SmallCapture small;
  small.edit("mass = 0.8", "density = 100.0");
  EXPECT_NEAR(small.read().scene.object.total_mass().value(), 0.8, 1e-12);
}

TEST(ReadCapture, TakesPathsAboveItsFolder) {
  SmallCapture small;
  std::filesystem::rename(small.folder / "rest.ply", small.folder / "front/rest.ply");
  small.edit("rest.ply", "front/../front/rest.ply");
  EXPECT_EQ(complaint_of([&] { (void)small.read(); }), "");
}

TEST(ReadCapture, TakesAPlainNameForOneFrame) {
  SmallCapture small;
  small.edit("frame_count = 4", "frame_count = 1").edit("start_frame = 1\n", "");
  small.edit("front/%06d.png", "front/000000.png").edit("front/mask_%06d.png", "front/mask_000000.png");
  EXPECT_EQ(complaint_of([&] { (void)small.read(); }), "");
}

TEST(ReadCapture, SaysThatNothingIsThere) {
  const test::TemporaryFolder folder;
  EXPECT_THAT(complaint_of([&] { (void)read_capture(folder.path()); }),
              HasSubstr("capture.toml: the file is not there"));
  folder.write("capture.toml", "");
  EXPECT_THAT(complaint_of([&] { (void)read_capture(folder.path()); }), HasSubstr("the file is empty"));
}

/// Each file of a recording in turn is a symbolic link that points at itself.
TEST(ReadCapture, LinksThatPointAtThemselvesAreTold) {
  struct Case {
    const char *file, *said;
  };
  constexpr const char* circle = "is a symbolic link that leads in a circle";
  for (const auto& [file, said] : std::initializer_list<Case>{{"rest.ply", circle},
                                                              {"front/background.png", circle},
                                                              {"markers.csv", circle},
                                                              {"markers_rest.csv", circle},
                                                              {"held.txt", circle},
                                                              {"front/000002.png", "no file for 1 of 4 frames: 2"},
                                                              {"front/mask_000000.png", "no file for 1 of 4 frames: 0"},
                                                              {"front", circle}}) {
    SmallCapture small;
    small.edit("noise = 0.002", "noise = 0.002\nbackground = \"front/background.png\"");
    small.append("\n[[markers]]\nrest = \"markers_rest.csv\"\ntrack = \"markers.csv\"\n");
    small.append("\n[[fixed]]\nvertices = \"held.txt\"\n");
    ASSERT_EQ(complaint_of([&] { (void)small.read(); }), "");
    small.folder.link_to_itself(file);
    EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr(said)) << file;
  }
  const test::TemporaryFolder folder;
  const std::filesystem::path loop = folder.link_to_itself("capture.toml");
  for (const auto& path : {folder.path(), loop, loop / "below"})
    EXPECT_THAT(complaint_of([&] { (void)read_capture(path); }), HasSubstr(circle)) << path;
}

TEST(ReadCapture, NamesThePlaceOfASyntaxError) {
  SmallCapture small;
  small.edit("mass = 0.8", "mass = = 0.8");
  EXPECT_THAT(complaint_of([&] { (void)small.read(); }), HasSubstr("capture.toml:6:8"));
}

TEST(FramePatternTest, FillsInTheNumber) {
  EXPECT_EQ(FramePattern{"a/%06d.png"}(12), "a/000012.png");
  EXPECT_EQ(FramePattern{"%d"}(12), "12");
  EXPECT_EQ(FramePattern{"%2d"}(1234567), "1234567");
  EXPECT_FALSE(FramePattern{"a.png"}.is_valid());
  EXPECT_FALSE(FramePattern{"%d%d"}.is_valid());
  EXPECT_FALSE(FramePattern{"%n"}.is_valid());
  EXPECT_FALSE(FramePattern{"%999d"}.is_valid());
  EXPECT_FALSE(FramePattern{"%"}.is_valid());
}

}  // namespace
}  // namespace pliant::read_capture_test
