#include "capture/fuse.hpp"

#include "capture/observe.hpp"
#include "capture/small_capture.hpp"
#include "input_errors.hpp"

namespace pliant::fuse_test {
namespace {

using test::complaint_of;
using test::SmallCapture;
using testing::HasSubstr;

TEST(Fuse, WritesWhatWasSeenOfTheObjectAsClouds) {
  SmallCapture small;
  small.append(
      "\n[[load]]\nmass = 0.1\nat = [0, 0.1, 0]\nimages = { front = \"front/000000.png\" }\n"
      "masks = { front = \"front/mask_000000.png\" }\n");
  const Capture capture = small.read();
  const std::filesystem::path out = small.folder / "fused";
  const FusedClouds fused = fuse_clouds(out, capture);
  EXPECT_EQ(fused.every, 1);
  EXPECT_EQ(fused.greatest_delay, 0.0);
  const Capture again = read_capture(out);
  EXPECT_TRUE(again.depth.empty());
  ASSERT_EQ(again.clouds.size(), 1u);
  EXPECT_EQ(again.scene.timing, capture.scene.timing);
  EXPECT_EQ(again.scene.regions, capture.scene.regions);
  EXPECT_EQ(again.scene.object.mass, capture.scene.object.mass);
  ASSERT_TRUE(again.loads[0].cloud);
  EXPECT_TRUE(again.loads[0].images.empty());
  const auto before = observe(capture), after = observe(again);
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t f = 0; f < after.size(); ++f) {
    ASSERT_EQ(after[f].points.size(), before[f].points.size());
    EXPECT_LT((after[f].points[7] - before[f].points[7]).norm(), 1e-6);
  }
}

/// An offset of a frame and a quarter: images belong to the next frame, and a quarter of a frame is left.
TEST(Fuse, TakesImagesToTheFrameThatIsNearest) {
  SmallCapture small;
  small.edit("noise = 0.002", "noise = 0.002\ntime_offset = 0.0208333");
  small.append("\n[[cloud]]\npoints = \"first.ply\"\nevery = 4\n");
  small.edit("points = \"first.ply\"", "points = \"first%d.ply\"");
  write_points(small.folder / "first0.ply", std::vector<Vector3>{{0, 0, -0.1}, {0.01, 0, -0.1}, {0, 0.01, -0.1}});
  const Capture capture = small.read();
  const std::filesystem::path out = small.folder / "fused";
  const FusedClouds fused = fuse_clouds(out, capture);
  EXPECT_NEAR(fused.greatest_delay, 0.0208333 - 1.0 / 60.0, 1e-6);
  const auto before = observe(capture), after = observe(read_capture(out));
  EXPECT_EQ(after[0].points.size(), 3u) << "the cloud alone";
  EXPECT_LT((after[1].points.front() - before[0].points.front()).norm(), 1e-6) << "the image of frame 0";
}

TEST(Fuse, RefusesWhereThereIsNothingToFuse) {
  SmallCapture small;
  small.text.resize(small.text.find("[[depth]]"));
  small.append("[[markers]]\nrest = \"markers_rest.csv\"\ntrack = \"markers.csv\"\n");
  const std::filesystem::path out = small.folder / "fused";
  EXPECT_THAT(complaint_of([&] { (void)fuse_clouds(out, small.read()); }), HasSubstr("something to fuse"));
}

}  // namespace
}  // namespace pliant::fuse_test
