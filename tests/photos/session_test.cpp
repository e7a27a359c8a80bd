#include "photos/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "capture/capture.hpp"
#include "capture/markers.hpp"
#include "capture/observe.hpp"
#include "capture/survey.hpp"
#include "input_errors.hpp"
#include "photos/measure.hpp"
#include "photos/paint.hpp"
#include "temporary_folder.hpp"

namespace pliant::test::session_test {
namespace {

using testing::HasSubstr;

PhotoExample small_example() {
  PhotoExampleOptions options;
  options.dots = 30;
  options.width = 720;
  options.height = 480;
  options.dot_diameter = 0.007;
  options.depths = {0.015};
  return PhotoExample(options);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// From files to files: what is written is a capture that the reader takes, and holds what was measured.
TEST(PhotoSession, BecomesACapture) {
  const TemporaryFolder folder;
  const PhotoExample example = small_example();
  example.write(folder / "session");
  const PhotoSession session = read_photo_session(folder / "session");
  EXPECT_EQ(session.cameras.size(), 3u);
  EXPECT_EQ(session.presses.size(), 2u);
  const MarkerMeasurement measured = measure_markers(session, photographs_of(session));
  write_marker_capture(folder / "capture", session, measured);
  const Capture capture = read_capture(folder / "capture");
  ASSERT_EQ(capture.presses.size(), 2u);
  EXPECT_EQ(capture.scene.fixed.size(), 1u);
  EXPECT_EQ(*capture.scene.object.density, 60.0);
  for (int k = 0; k < 2; ++k) {
    const Press& press = capture.presses[std::size_t(k)];
    const PaintedScene truth = example.scene(k + 1);
    EXPECT_LT((press.force - example.force(k + 1) * truth.probe->pose.direction).norm(), 0.05) << "20 mN of noise";
    EXPECT_LT((press.contact_centre - example.contact(k + 1)).norm(), 1e-3);
    EXPECT_LT((press.probe->point - truth.probe->pose.tip).norm(), 1e-3);
    const MarkerSet markers = read_marker_pair(press.markers_rest, press.markers);
    EXPECT_GE(markers.marker_count(), 28);
    EXPECT_LE(markers.marker_count(), 30);
  }
  const Survey seen = survey(capture, observe(capture, {}));  // as `pliant check` does
  ASSERT_TRUE(seen.loaded_markers);
  EXPECT_EQ(seen.loaded_markers->frames, 2);
  EXPECT_GT(seen.loaded_markers->travel, 0.005);
  EXPECT_THAT(read_file(folder / "capture/markers_rest_std.csv"), testing::StartsWith("id,sx,sy,sz\n000,"));
  EXPECT_THAT(read_file(folder / "capture/markers.json"), HasSubstr("\"noise_factor\""));
}

class BrokenSession : public testing::Test {
 protected:
  void SetUp() override {
    small_example().write(folder_.path());
    text_ = read_file(folder_ / "markers.toml");
  }
  std::string complaint_with(const std::string& from, const std::string& to) const {
    folder_.write("markers.toml", replaced(text_, from, to));
    return complaint_of([&] { read_photo_session(folder_.path()); });
  }
  TemporaryFolder folder_;
  std::string text_;
};

TEST_F(BrokenSession, IsToldWithItsPlace) {
  EXPECT_THAT(complaint_with("colour = \"dark\"", "colour = \"drak\""),
              HasSubstr("markers.toml:15:1: the colour \"drak\""));
  EXPECT_THAT(complaint_with("dots_apart", "dots_appart"), HasSubstr("did you mean `dots_apart`"));
  EXPECT_THAT(complaint_with("\"red\"", "\"dark\""), HasSubstr("the probe's dots have the markers' colour"));
  EXPECT_THAT(complaint_with("diameter = 0.007", "diameter = 7.0"), HasSubstr("`diameter` is 7"));
  EXPECT_THAT(complaint_with("number = 2", "number = 1"), HasSubstr("photograph 1 a second time"));
  EXPECT_THAT(complaint_with("number = 2", "number = 5"), HasSubstr("photograph 5 has no time"));
  EXPECT_THAT(complaint_with("number = 2", "number = 2\ntime = 3.0"), HasSubstr("both `time` and a row"));
  EXPECT_THAT(complaint_with("times = \"times.csv\"", "").substr(0, 400), HasSubstr("photograph 1 has no time"));
  EXPECT_THAT(complaint_with("left.yml", "lift.yml"), HasSubstr("the file \"lift.yml\" is not there"));
  EXPECT_THAT(complaint_with("left/%03d.png", "left/%02d.png"), HasSubstr("the file \"left/00.png\" is not there"));
  EXPECT_THAT(complaint_with("left/%03d.png", "left/a.png"), HasSubstr("one %03d where"));
  EXPECT_THAT(complaint_with("density = 60", "mass = 1\ndensity = 60"), HasSubstr("both `mass` and `density`"));
  EXPECT_THAT(complaint_with("[rest]\nnumber = 0", "[rest]\nnumber = 9"), HasSubstr("left/009.png"));
  folder_.write("markers.toml", text_);
  const std::string log = read_file(folder_ / "force.csv");
  folder_.write("force.csv", "time,force\n0,0\n1.9,1\n2.1,1\n");
  EXPECT_THAT(complaint_of([&] { read_photo_session(folder_.path()); }), HasSubstr("no force at 4 s"));
  folder_.write("force.csv", log);
  const PhotoSession session = read_photo_session(folder_.path());
  write_png(folder_ / "right/000.png", Image<Rgb>(640, 480));
  EXPECT_THAT(complaint_of([&] { (void)measure_markers(session, photographs_of(session)); }),
              HasSubstr("right/000.png: 640 x 480 pixels; expected 720 x 480"));
}

TEST(PhotoSession, CamerasThatDoNotFitTogetherAreNoticed) {
  const PhotoExample example = small_example();
  PhotoSession session = example.session();
  const auto photographs = [&](int camera, int number) { return example.photograph(camera, number); };
  session.cameras[0].world_to_camera.translation += Vector3(0.02, -0.01, 0.0);
  EXPECT_THAT(complaint_of([&] { (void)measure_markers(session, photographs); }), HasSubstr("markers at rest"));
}

/// Where one of the probe's dots is hidden the press is left out, and says so.
TEST(PhotoSession, LeavesOutAPressWithoutProbe) {
  const PhotoExample example = small_example();
  const TemporaryFolder folder;
  const auto photographs = [&](int camera, int number) {
    if (number != 1) return example.photograph(camera, number);
    PaintedScene scene = example.scene(number);
    scene.probe->bead_radius = 0.001;  // inside the shaft
    return take_photograph(scene, example.session().cameras[std::size_t(camera)]);
  };
  const MarkerMeasurement measured = measure_markers(example.session(), photographs);
  EXPECT_THAT(measured.presses[0].failure, HasSubstr("of the probe's two dots is seen"));
  EXPECT_EQ(measured.presses[1].failure, "");
}

}  // namespace
}  // namespace pliant::test::session_test
