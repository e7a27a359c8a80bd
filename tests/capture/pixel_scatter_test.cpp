#include "capture/pixel_scatter.hpp"

#include <random>

namespace pliant::pixel_scatter_test {
namespace {

constexpr double stated = 0.002, depth_scale = 4000.0;

/// A ball of 0.1 m radius a metre away, as a camera that states a noise of 2 mm sees it.
struct Ball {
  DepthCamera camera;
  DepthImage depth{160, 120};
  Image<PixelKind> kinds{160, 120, PixelKind::Elsewhere};

  /// @param error  of a reading [m] at a pixel
  template <class Error>
  explicit Ball(const Error& error) {
    camera.camera.fx = camera.camera.fy = 400.0;
    camera.camera.cx = 80.0, camera.camera.cy = 60.0;
    camera.depth_scale = depth_scale;
    camera.noise = stated;
    for (int v = 0; v < depth.height; ++v)
      for (int u = 0; u < depth.width; ++u) {
        const double x = (u - 80.0) / 400.0, y = (v - 60.0) / 400.0, inside = 0.01 - x * x - y * y;
        if (inside <= 0.0) continue;
        depth(u, v) = float(std::round((1.1 - std::sqrt(inside) + error(u, v)) * depth_scale) / depth_scale);
        kinds(u, v) = PixelKind::Object;
      }
  }
  double scatter() const { return pixel_scatter(depth, kinds, camera.camera, DepthNoise(camera, 1.0)); }
};

TEST(PixelScatter, IsOneWhereEachPixelErrsOnItsOwnAsStated) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, stated);
  EXPECT_NEAR(Ball([&](int, int) { return noise(random); }).scatter(), 1.0, 0.05);
}

TEST(PixelScatter, GrowsWithTheNoise) {
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 2.5 * stated);
  EXPECT_NEAR(Ball([&](int, int) { return noise(random); }).scatter(), 2.5, 0.15);
}

TEST(PixelScatter, IsSmallWhereNeighboursErrTogether) {
  const auto smooth = [](int u, int v) { return stated * std::sin(0.05 * u) * std::cos(0.04 * v); };
  EXPECT_LT(Ball(smooth).scatter(), 0.1) << "rounding to 0.25 mm and the ball's own curvature are left";
}

TEST(PixelScatter, IsNotMovedByAFewWildReadings) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, stated);
  std::bernoulli_distribution is_wild(0.03);
  EXPECT_NEAR(Ball([&](int, int) { return is_wild(random) ? 0.2 : noise(random); }).scatter(), 1.0, 0.1);
}

TEST(PixelScatter, IsNotToldByAFewPixels) {
  Ball ball([](int, int) { return 0.0; });
  for (int v = 0; v < ball.kinds.height; ++v)
    for (int u = 0; u < ball.kinds.width; ++u)
      if (u > 83 || u < 77 || v < 57 || v > 61) ball.kinds(u, v) = PixelKind::Elsewhere;
  EXPECT_EQ(ball.scatter(), 0.0);
}

TEST(PixelScatter, OfARecordingIsTheMedianOfItsFrames) {
  std::vector<ObservedFrame> frames(5);
  frames[0].scatter = {1.0}, frames[1].scatter = {0.0, 2.0}, frames[2].scatter = {1.2, 3.0},
  frames[3].scatter = {9.0, 4.0};
  const std::vector<double> scatter = median_scatter(frames, 3);
  EXPECT_EQ(scatter, (std::vector<double>{1.2, 3.0, 0.0}));
}

}  // namespace
}  // namespace pliant::pixel_scatter_test
