#include "ensemble/quantiles.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace pliant::quantiles_test {
namespace {

using testing::DoubleEq;
using testing::Each;
using testing::ElementsAre;
using testing::IsNan;

constexpr double none = std::numeric_limits<double>::quiet_NaN();

TEST(Quantiles, LieLinearlyBetweenNeighbours) {
  EXPECT_THAT(quantiles({4.0, 1.0, 3.0, 2.0}, {0.0, 0.25, 0.5, 0.9, 1.0}),
              ElementsAre(1.0, DoubleEq(1.75), DoubleEq(2.5), DoubleEq(3.7), 4.0));
  EXPECT_THAT(told_quantiles(std::vector<double>{7.0}), Each(7.0));
  EXPECT_THAT(told_quantiles(std::vector<double>{}), Each(IsNan()));
}

TEST(Quantiles, PassOverWhatIsNoNumber) {
  EXPECT_THAT(quantiles({none, 2.0, 1.0, HUGE_VAL, 3.0}, {0.0, 0.5, 1.0}), ElementsAre(1.0, 2.0, 3.0));
  EXPECT_THAT(told_quantiles(std::vector<double>{none, none}), Each(IsNan()));
}

/// By sorting all, with many equal numbers.
TEST(Quantiles, AreThoseOfTheSortedNumbers) {
  std::mt19937 random(3);
  for (const int count : {2, 3, 7, 100, 1001}) {
    std::vector<float> numbers;
    for (int i = 0; i < count; ++i) numbers.push_back(float(int(random() % 50)) * 0.1F);
    std::vector<float> sorted = numbers;
    std::ranges::sort(sorted);
    const auto found = told_quantiles(numbers.data(), numbers.data() + numbers.size());
    for (std::size_t k = 0; k < told_shares.size(); ++k) {
      const double place = told_shares[k] * (count - 1), part = place - std::floor(place);
      const double low = double(sorted[std::size_t(place)]),
                   high = double(sorted[std::min(std::size_t(place) + 1, sorted.size() - 1)]);
      EXPECT_DOUBLE_EQ(found[k], low + part * (high - low)) << count << ", " << told_shares[k];
    }
  }
}

TEST(RankCorrelation, IsThatOfTheOrderAlone) {
  EXPECT_DOUBLE_EQ(rank_correlation({1, 2, 3, 4}, {1, 10, 100, 1000}), 1.0);
  EXPECT_DOUBLE_EQ(rank_correlation({1, 2, 3, 4}, {9, 8, 7, -5}), -1.0);
  // 1 - 6 sum d^2 / (n (n^2 - 1)) without ties: d = 1, -1, 0, 0.
  EXPECT_DOUBLE_EQ(rank_correlation({1, 2, 3, 4}, {2, 1, 3, 4}), 0.8);
  // With a tie of ranks 0 and 1: covariance 4.5 over sqrt(5 * 4.5).
  EXPECT_DOUBLE_EQ(rank_correlation({1, 2, 3, 4}, {1, 1, 3, 4}), 4.5 / std::sqrt(22.5));
}

TEST(RankCorrelation, NeedsThreeMembersThatDiffer) {
  EXPECT_THAT(rank_correlation({1, 2}, {1, 2}), IsNan());
  EXPECT_THAT(rank_correlation({1, 2, none}, {1, 2, 3}), IsNan());
  EXPECT_THAT(rank_correlation({1, 1, 1}, {1, 2, 3}), IsNan());
}

}  // namespace
}  // namespace pliant::quantiles_test
