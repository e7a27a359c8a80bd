#include "estimation/marker_noise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace pliant::marker_noise_test {

struct Seen {
  std::vector<double> residuals, weights, displacements;
};

/// Normal residuals of this noise, of markers that move by up to 20 mm, most of them little; every outlier-th is
/// thirty times as large.
Seen seen(const MarkerNoise& noise, unsigned seed, int count = 3000, int outlier = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Seen s;
  for (int i = 0; i < count; ++i) {
    s.weights.push_back(i % 3 == 2 ? 2.0 : 1.0);
    s.displacements.push_back(0.02 * std::pow(uniform(random), 3));
    double r = noise.deviation(s.weights.back(), s.displacements.back()) * normal(random);
    if (outlier > 0 && i % outlier == 0) r *= 30.0;
    s.residuals.push_back(r);
  }
  return s;
}

MarkerNoise found(const Seen& s) { return robust_noise(s.residuals, s.weights, s.displacements, 1e-9); }

TEST(MarkerNoise, IsTheWeighedPartAtRestAndTheGrowingOneInQuadrature) {
  const MarkerNoise noise(3e-4, 0.1);
  EXPECT_DOUBLE_EQ(noise.deviation(2.0, 0.01), std::sqrt(36e-8 + 1e-6));
}

TEST(MarkerNoise, ConstantNoiseIsFoundAndDoesNotGrow) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const MarkerNoise noise = found(seen({2e-4, 0.0}, seed));
    EXPECT_NEAR(noise.at_rest, 2e-4, 0.06 * 2e-4) << seed;  // of the median of 3,000: 2.1 %
    EXPECT_LT(noise.growth * 0.02, 0.4 * 2e-4) << seed;
  }
}

TEST(MarkerNoise, GrowthIsFoundBesideNoiseAtRestAndAlone) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const MarkerNoise both = found(seen({2e-4, 0.1}, seed));
    EXPECT_NEAR(both.at_rest, 2e-4, 0.25 * 2e-4) << seed;
    EXPECT_NEAR(both.growth, 0.1, 0.012) << seed;
    const MarkerNoise alone = found(seen({0.0, 0.06}, seed));
    EXPECT_LT(alone.at_rest, 1e-5) << seed;
    EXPECT_NEAR(alone.growth, 0.06, 0.005) << seed;
  }
}

TEST(MarkerNoise, OneResidualInTwentyThatIsThirtyTimesAsLargeChangesLittle) {
  const MarkerNoise noise = found(seen({2e-4, 0.1}, 7, 3000, 20));
  EXPECT_NEAR(noise.at_rest, 2e-4, 0.4 * 2e-4);
  EXPECT_NEAR(noise.growth, 0.1, 0.03);
}

TEST(MarkerNoise, IsTheLeastWhereThereAreNoResidualsOrNone) {
  EXPECT_EQ(robust_noise({}, {}, {}, 1e-6), MarkerNoise(1e-6));
  const std::vector<double> nothing(30, 0.0), weights(30, 1.0), moved(30, 0.01);
  EXPECT_EQ(robust_noise(nothing, weights, moved, 1e-6).at_rest, 1e-6);
}

}  // namespace pliant::marker_noise_test
