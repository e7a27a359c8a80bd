#include "capture/cloud_kinds.hpp"

#include <algorithm>

#include "capture/observe.hpp"
#include "capture/small_capture.hpp"

namespace pliant::cloud_kinds_test {
namespace {

using test::SmallCapture;
using testing::ElementsAre;

/// The front of the box, a hundred points on each side of the middle.
std::vector<Vector3> front() {
  std::vector<Vector3> points;
  for (int i = 0; i < 20; ++i)
    for (int j = 0; j < 18; ++j) points.emplace_back(0.01 * i - 0.095, 0.01 * j - 0.095, -0.1);
  return points;
}

/// A table on which the box stands, y = 0.1, with points 0.02 apart.
std::vector<Vector3> table(double shift) {
  std::vector<Vector3> points;
  for (int i = -20; i <= 20; ++i)
    for (int j = -20; j <= 20; ++j) points.emplace_back(0.02 * i + shift, 0.1 + 0.001 * ((i + j) % 2), 0.02 * j);
  return points;
}

std::vector<Vector3> both(std::vector<Vector3> points, const std::vector<Vector3>& more) {
  points.insert(points.end(), more.begin(), more.end());
  return points;
}

/// A recording of clouds alone, the same in each of its four frames.
Capture of_clouds(SmallCapture& small, const std::vector<Vector3>& points, const std::string& keys = "") {
  for (int frame = 0; frame < 4; ++frame)
    write_points(small.folder / ("clouds/" + std::to_string(frame) + ".ply"), points);
  small.text.resize(small.text.find("[[depth]]"));
  small.append("[[cloud]]\npoints = \"clouds/%d.ply\"\nnoise = 0.002\n" + keys);
  return small.read();
}

int behind_front(const ObservedFrame& frame) {
  return int(std::ranges::count_if(frame.points, [](const Vector3& p) { return p.z() > -0.09 || p.z() < -0.11; }));
}

TEST(CloudKinds, LeavesOutATableThatNobodyDeclared) {
  SmallCapture small;
  const auto frames = observe(of_clouds(small, both(front(), table(0.0))));
  for (const ObservedFrame& frame : frames) {
    EXPECT_EQ(frame.points.size(), 360u);
    EXPECT_EQ(behind_front(frame), 0);
    EXPECT_EQ(frame.cloud.read, 360 + 41 * 41);
    EXPECT_GT(frame.cloud.on_plane, 500) << "those within reach";
  }
}

TEST(CloudKinds, KeepsAFlatObjectThatLiesOnNothing) {
  SmallCapture small;
  const auto frames = observe(of_clouds(small, front()));
  EXPECT_EQ(frames[0].points.size(), 360u) << "the front of the box is a plane too";
}

TEST(CloudKinds, LeavesOutWhatTheBackgroundShows) {
  SmallCapture small;
  write_points(small.folder / "empty.ply", table(0.007));
  const Capture capture = of_clouds(small, both(front(), table(0.0)), "background = \"empty.ply\"\n");
  const ObservedFrame frame = observe(capture).front();
  EXPECT_EQ(behind_front(frame), 0);
  EXPECT_EQ(frame.points.size(), 360u);
  EXPECT_GT(frame.cloud.background, 500);
  EXPECT_EQ(frame.cloud.on_plane, 0);
}

TEST(CloudKinds, LeavesOutWhatLiesBehindAPlaneOrAlone) {
  SmallCapture small;
  const auto points = both(front(), {{0.0, 0.52, 0.0}, {0.0, -0.2, -0.2}, {0.0, 0.0, 9.0}});
  const CloudCounts counts = observe(of_clouds(small, points)).front().cloud;
  EXPECT_THAT((std::vector{counts.on_plane, counts.isolated, counts.out_of_reach, counts.background}),
              ElementsAre(1, 1, 1, 0));
}

TEST(CloudKinds, FindsAPlaneThatIsRoughlyKnownInTheBackground) {
  SmallCapture small;
  small.edit("normal = [0.0, -2.0, 0.0]", "normal = [0.0, -2.0, 0.0]\nknown = false")
      .edit("[0.0, 0.5, 0.0]", "[0.0, 0.12, 0.0]");
  write_points(small.folder / "empty.ply", table(0.007));
  const Capture capture = of_clouds(small, front(), "background = \"empty.ply\"\n");
  const CloudSorter sorter(capture, &capture.clouds[0], {});
  ASSERT_EQ(sorter.planes().size(), 1u);
  EXPECT_NEAR(sorter.planes()[0].point.y(), 0.1, 1.5e-3);
}

TEST(CloudKinds, RefusesABackgroundThatIsNoCloud) {
  SmallCapture small;
  small.folder.write("empty.ply", "no cloud");
  EXPECT_THROW((void)of_clouds(small, front(), "background = \"empty.ply\"\n"), InputError);
}

}  // namespace
}  // namespace pliant::cloud_kinds_test
