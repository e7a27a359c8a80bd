#include "geometry/lens.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "geometry/camera.hpp"

namespace pliant::lens_test {
namespace {

// Lenses of each length that OpenCV writes; the last on a tilted sensor.
const std::vector<LensDistortion>& lenses() {
  static const std::vector<LensDistortion> all = {
      LensDistortion({-0.25, 0.1, 8e-4, -5e-4}), LensDistortion({0.12, -0.24, 1e-4, -4e-4, 0.08}),
      LensDistortion({0.6, -2.7, 6e-4, -2e-4, 1.5, 0.5, -2.5, 1.4}),
      LensDistortion({-0.2, 0.05, 1e-3, -2e-3, 0.01, 0.02, -0.01, 0.005, 1e-3, -2e-3, 5e-4, 1e-3}),
      LensDistortion({-0.2, 0.05, 1e-3, -2e-3, 0.01, 0.02, -0.01, 0.005, 1e-3, -2e-3, 5e-4, 1e-3, 0.03, -0.02})};
  return all;
}

/// The formula of OpenCV's manual, worked out by hand: r^2 = 0.25, 1 + k1 r^2 + k2 r^4 + k3 r^6 = 0.95, ...
TEST(Lens, BendsAsTheFormulaSays) {
  const LensDistortion lens({-0.2, 0.0, 0.01, -0.02});
  const Vector2 seen = lens.distorted({0.3, -0.4});
  EXPECT_NEAR(seen.x(), 0.95 * 0.3 + 2 * 0.01 * 0.3 * -0.4 - 0.02 * (0.25 + 2 * 0.09), 1e-15);
  EXPECT_NEAR(seen.y(), 0.95 * -0.4 + 0.01 * (0.25 + 2 * 0.16) - 2 * 0.02 * 0.3 * -0.4, 1e-15);
  const LensDistortion rational({0.4, 0, 0, 0, 0, 0.8, 0, 0});
  EXPECT_NEAR(rational.distorted({0.3, -0.4}).x(), 0.3 * 1.1 / 1.2, 1e-15);
}

TEST(Lens, ComesBackFromWhereItBendsTo) {
  for (const LensDistortion& lens : lenses())
    for (double x = -0.6; x <= 0.6; x += 0.2)
      for (double y = -0.45; y <= 0.45; y += 0.15) {
        const Vector2 seen = lens.distorted({x, y});
        EXPECT_LT((lens.straight(seen) - Vector2(x, y)).norm(), 1e-11) << x << " " << y;
      }
  EXPECT_GT((lenses()[0].distorted({0.6, 0.45}) - Vector2(0.6, 0.45)).norm(), 0.05) << "the lens must matter here";
}

TEST(Lens, DerivativeAgreesWithDifferences) {
  constexpr double h = 1e-6;
  for (const LensDistortion& lens : lenses())
    for (const Vector2& p : {Vector2(0.3, -0.2), Vector2(-0.5, 0.4), Vector2(0.01, 0.35)}) {
      Eigen::Matrix2d J;
      (void)lens.distorted(p, &J);
      for (int k = 0; k < 2; ++k) {
        const Vector2 step = h * Vector2::Unit(k);
        EXPECT_LT(((lens.distorted(p + step) - lens.distorted(p - step)) / (2 * h) - J.col(k)).norm(), 1e-8);
      }
    }
}

/// x (1 - 0.25 x^2) is greatest, and folds back, where 0.75 x^2 = 1.
TEST(Lens, DoesNotFoldBackBeyondItsReach) {
  const LensDistortion lens({-0.25, 0, 0, 0});
  EXPECT_NEAR(lens.reach(), std::sqrt(1.0 / 0.75), 0.01);
  double before = 0.0;
  for (double x = 0.0; x < 20.0; x += 0.1) {
    EXPECT_GE(lens.distorted({x, 0.0}).x(), before);
    before = lens.distorted({x, 0.0}).x();
  }
  EXPECT_FALSE(lens.straight({0.9, 0.0}).allFinite());  // farther out than any ray
  EXPECT_TRUE(lens.straight({0.75, 0.0}).allFinite());
}

TEST(Lens, RefusesAnotherNumberOfCoefficients) {
  EXPECT_THROW(LensDistortion({0.1}), std::invalid_argument);
  EXPECT_THROW(LensDistortion({0.1, std::nan(""), 0, 0}), std::invalid_argument);
  EXPECT_FALSE(LensDistortion({0, 0, 0, 0}).bends());
}

TEST(Lens, CameraProjectsAndUnprojectsThroughIt) {
  PinholeCamera camera{320, 240, 280, 281, 160, 119, {}};
  camera.camera_to_world.translation = {0.1, -0.2, 0.3};
  const PinholeCamera straight = camera;
  for (const LensDistortion& lens : lenses()) {
    camera.lens = lens;
    for (const auto& [u, v] : {std::pair(3.0, 7.0), std::pair(160.0, 119.0), std::pair(310.0, 200.0)}) {
      const Vector3 point = camera.unproject(u, v, 0.8), seen = camera.project(point);
      EXPECT_NEAR(seen.x(), u, 1e-8);
      EXPECT_NEAR(seen.y(), v, 1e-8);
      EXPECT_NEAR(seen.z(), 0.8, 1e-12);
    }
    EXPECT_GT((camera.unproject(3, 7, 0.8) - straight.unproject(3, 7, 0.8)).norm(), 1e-4);
  }
}

}  // namespace
}  // namespace pliant::lens_test
