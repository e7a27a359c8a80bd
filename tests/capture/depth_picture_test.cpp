#include "capture/depth_picture.hpp"

#include <algorithm>
#include <vector>

namespace pliant::depth_picture_test {
namespace {

TEST(DepthPicture, GivesEachKindAColourOfItsOwn) {
  const DepthImage depth(5, 1, 1.0f);
  Image<PixelKind> kinds(5, 1);
  for (int u = 0; u < 5; ++u) kinds(u, 0) = PixelKind(u);
  auto colours = picture(depth, kinds).pixels;
  std::ranges::sort(colours);
  EXPECT_EQ(std::unique(colours.begin(), colours.end()), colours.end());
}

TEST(DepthPicture, ShowsEveryPointOfACloud) {
  // A flat cross: seen along its thin direction, longer side across the picture.
  std::vector<Vector3> points;
  for (int i = -50; i <= 50; ++i) points.insert(points.end(), {{0.01 * i, 0, 0}, {0, 0.005 * i, 1e-4 * i}});
  const Image<Rgb> image = picture(points, 120);
  EXPECT_EQ(image.width, 120);
  EXPECT_NEAR(image.height, 70, 3);
  EXPECT_GT(std::ranges::count_if(image.pixels, [](const Rgb& p) { return p != Rgb{0, 0, 0}; }), 250);
}

TEST(DepthPicture, SurvivesNoPointsAndOnePoint) {
  EXPECT_EQ(picture(std::vector<Vector3>{}).width, 480);
  EXPECT_EQ(picture(std::vector<Vector3>{{1, 2, 3}}).width, 480);
}

}  // namespace
}  // namespace pliant::depth_picture_test
