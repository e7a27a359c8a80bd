#include "geometry/random_field.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace pliant::random_field_test {
namespace {

TEST(RandomField, HasItsDeviationAndCovariance) {
  constexpr double deviation = 0.3, length = 0.02;
  const Vector3 here(0.1, -0.2, 0.05);
  for (const double off : {0.0, 0.5, 1.0, 2.0}) {
    double product = 0.0, sum = 0.0;
    constexpr int fields = 4000;
    for (int seed = 0; seed < fields; ++seed) {
      const RandomField field(deviation, length, std::uint64_t(seed));
      product += field(here) * field(here + off * length * Vector3(0.6, 0.0, 0.8)) / fields;
      sum += field(here) / fields;
    }
    const double expected = deviation * deviation * std::exp(-0.5 * off * off);
    // Four standard deviations of the means of so many products of two Gaussians, and of so many values.
    EXPECT_NEAR(product, expected, 4.0 * deviation * deviation * std::sqrt(2.0 / fields)) << off;
    EXPECT_NEAR(sum, 0.0, 4.0 * deviation / std::sqrt(fields));
  }
}

TEST(RandomField, IsTheSameForTheSameSeedAndScalesWithItsDeviation) {
  const Vector3 p(0.3, 0.1, -0.7);
  const RandomField one(1.0, 0.1, 5), again(1.0, 0.1, 5), twice(2.0, 0.1, 5), other(1.0, 0.1, 6);
  EXPECT_EQ(one(p), again(p));
  EXPECT_DOUBLE_EQ(twice(p), 2.0 * one(p));
  EXPECT_NE(one(p), other(p));
}

}  // namespace
}  // namespace pliant::random_field_test
