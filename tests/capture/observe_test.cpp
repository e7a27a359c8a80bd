#include "capture/observe.hpp"

#include <cmath>

#include "base/parallel.hpp"
#include "capture/small_capture.hpp"

namespace pliant::observe_test {
namespace {

using test::SmallCapture;
using ::testing::Each;
using ::testing::SizeIs;

// The seen face of the box lies at z = -0.1; depth is rounded to millimetres.
void expect_on_near_face(const ObservedFrame& frame) {
  for (const Vector3& point : frame.points) EXPECT_NEAR(point.z(), -0.1, 0.6e-3);
}

TEST(Observe, FindsTheFaceThatTheMaskShows) {
  SmallCapture small;
  const auto frames = observe(small.read());
  ASSERT_THAT(frames, SizeIs(4));
  for (const ObservedFrame& frame : frames) {
    expect_on_near_face(frame);
    // 18 x 18 pixels of the face; those at its border go, for they lie at a step in depth.
    EXPECT_EQ(frame.points.size(), 16u * 16u) << frame.frame;
    EXPECT_THAT(frame.camera, Each(0));
    EXPECT_THAT(frame.noise, SizeIs(frame.points.size()));
    EXPECT_NEAR(frame.noise[0], 0.002, 2e-4);
    EXPECT_NEAR(frame.view[0].norm(), 1.0, 1e-12);
  }
}

TEST(Observe, FindsItByTheBackground) {
  SmallCapture small;
  small.edit("masks = \"front/mask_%06d.png\"", "background = \"front/background.png\"");
  for (const ObservedFrame& frame : observe(small.read())) {
    expect_on_near_face(frame);
    EXPECT_GE(frame.points.size(), 16u * 16u);
  }
}

TEST(Observe, FindsItByWhereItMayBe) {
  SmallCapture small;
  small.edit("masks = \"front/mask_%06d.png\"\n", "");
  for (const ObservedFrame& frame : observe(small.read())) {
    expect_on_near_face(frame);
    EXPECT_GE(frame.points.size(), 16u * 16u);
  }
}

TEST(Observe, DropsPixelsNearAPlane) {
  SmallCapture small;
  small.edit("point = [0.0, 0.5, 0.0]", "point = [0.0, 0.09, 0.0]");
  ObserveOptions options;
  options.plane_margin = 0.04;
  const auto frames = observe(small.read(), options);
  ASSERT_FALSE(frames[0].points.empty());
  for (const Vector3& point : frames[0].points) EXPECT_LE(point.y(), 0.05);
}

TEST(Observe, KeepsAnEvenSubset) {
  SmallCapture small;
  ObserveOptions options;
  options.max_points_per_frame = 50;
  const Capture capture = small.read();
  const auto all = observe(capture), few = observe(capture, options);
  ASSERT_THAT(few[1].points, SizeIs(50));
  EXPECT_EQ(few[1].points[0], all[1].points[0]);
  EXPECT_GT(few[1].pixel.back(), all[1].pixel[all[1].pixel.size() * 9 / 10]) << "spread over the whole face";
}

TEST(Observe, IsTheSameWithOneThread) {
  SmallCapture small;
  const Capture capture = small.read();
  const auto many = observe(capture);
  const ThreadLimit one(1);
  const auto single = observe(capture);
  for (std::size_t i = 0; i < many.size(); ++i) {
    EXPECT_EQ(many[i].points, single[i].points);
    EXPECT_EQ(many[i].noise, single[i].noise);
  }
}

TEST(Observe, MergesCloudsAndCounts) {
  SmallCapture small;
  small.append("\n[[cloud]]\npoints = \"clouds/%d.ply\"\nevery = 2\nnoise = 0.003\n");
  for (const int frame : {0, 2})
    write_points(small.folder / ("clouds/" + std::to_string(frame) + ".ply"),
                 std::vector<Vector3>{{0, 0, 0.1}, {0, 0, 50}});
  int calls = 0, last = 0;
  const auto frames = observe(small.read(), {}, [&](int done, int total) {
    ++calls;
    last = done;
    EXPECT_EQ(total, 4);
  });
  EXPECT_EQ(calls, 4);
  EXPECT_EQ(last, 4);
  EXPECT_EQ(frames[0].points.size(), 257u) << "the far point is no part of the object";
  EXPECT_EQ(frames[1].points.size(), 256u);
  EXPECT_EQ(frames[0].camera.back(), -1);
  EXPECT_FLOAT_EQ(frames[0].noise.back(), 0.003f);
  EXPECT_EQ(frames[0].view.back(), Vector3(Vector3::Zero()));
}

TEST(Observe, RefusesADamagedImage) {
  SmallCapture small;
  const Capture capture = small.read();
  const auto path = small.folder / "front/000003.png";
  write_file(path, read_file(path).substr(0, 100));
  EXPECT_THROW((void)observe(capture), InputError);
}

TEST(ObserveLoad, ReadsCloudAndImagesAndLeavesOutWhatStandsAlone) {
  SmallCapture small;
  std::vector<Vector3> points;
  for (int i = 0; i < 10; ++i)
    for (int j = 0; j < 10; ++j) points.emplace_back(0.01 * i - 0.05, 0.01 * j - 0.05, -0.1);
  points.emplace_back(0.0, 0.0, -0.2);   // alone
  points.emplace_back(0.0, 0.0, 900.0);  // nowhere near
  write_points(small.folder / "load.ply", points);
  const std::string head = "\n[[load]]\nmass = 0.1\nat = [0, 0.1, 0]\n";
  small.append(head + "cloud = \"load.ply\"\n");
  small.append(head + "images = { front = \"front/000000.png\" }\nmasks = { front = \"front/mask_000000.png\" }\n");
  small.append(head + "markers = \"load.csv\"\nmarkers_rest = \"markers_rest.csv\"\n");
  small.folder.write("load.csv", "id,x,y,z\n0,0,0,-0.1\n");
  const Capture capture = small.read();
  const ObservedLoad cloud = observe_load(capture, capture.loads[0]);
  EXPECT_THAT(cloud.seen.points, SizeIs(100));
  EXPECT_EQ(cloud.outliers, 1);
  EXPECT_THAT(cloud.seen.camera, Each(-1));
  const ObservedLoad images = observe_load(capture, capture.loads[1]);
  EXPECT_THAT(images.seen.points, SizeIs(16u * 16u));
  EXPECT_EQ(images.outliers, 0);
  expect_on_near_face(images.seen);
  EXPECT_THAT(observe_load(capture, capture.loads[2]).seen.points, SizeIs(0));
}

}  // namespace
}  // namespace pliant::observe_test
