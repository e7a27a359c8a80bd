#include "capture/depth_noise.hpp"

namespace pliant::depth_noise_test {
namespace {

DepthCamera camera(std::optional<double> noise) {
  DepthCamera depth;
  depth.camera.fx = depth.camera.fy = 300;
  depth.noise = noise;
  return depth;
}

TEST(DepthNoiseTest, FollowsTheMeasuredCurve) {
  const DepthNoise noise(camera({}), 1.0);
  // 0.0012 + 0.0019 (z - 0.4)^2, and the rounding to millimetres
  EXPECT_NEAR(noise.axial(0.4), std::hypot(0.0012, 0.001 / std::sqrt(12.0)), 1e-9);
  EXPECT_NEAR(noise.axial(1.4), std::hypot(0.0031, 0.001 / std::sqrt(12.0)), 1e-9);
}

TEST(DepthNoiseTest, MeetsAStatedValueAtTheObject) {
  EXPECT_NEAR(DepthNoise(camera(0.01), 1.2).axial(1.2), 0.01, 1e-5);
  EXPECT_GT(DepthNoise(camera(0.01), 1.2).axial(2.0), 0.01);
}

TEST(DepthNoiseTest, GrowsAtGrazingIncidence) {
  const DepthNoise noise(camera({}), 1.0);
  EXPECT_DOUBLE_EQ(noise.along_normal(1.0, 0.0), noise.axial(1.0));
  EXPECT_GT(noise.along_normal(1.0, 1.3), noise.along_normal(1.0, 0.7));
  EXPECT_LT(noise.along_normal(1.0, 1.57), 0.02);
}

}  // namespace
}  // namespace pliant::depth_noise_test
