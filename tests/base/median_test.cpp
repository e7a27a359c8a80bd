#include "base/median.hpp"

#include <gtest/gtest.h>

namespace pliant::median_test {
namespace {

TEST(Median, IsTheMiddleOneAndOfAnEvenNumberTheUpperOfTheTwo) {
  EXPECT_EQ(median<double>({7.0}), 7.0);
  EXPECT_EQ(median<double>({9.0, -1.0, 4.0}), 4.0);
  EXPECT_EQ(median<int>({4, 1, 3, 2}), 3);
  EXPECT_EQ(median<float>({2.0f, 2.0f, 1.0f, 2.0f, 8.0f}), 2.0f);
}

TEST(Median, OfNoneIsZeroAndTheValuesAreLeftAsTheyWere) {
  EXPECT_EQ(median(std::vector<double>()), 0.0);
  const std::vector<double> values = {3.0, 1.0, 2.0};
  median(values);
  EXPECT_EQ(values, (std::vector<double>{3.0, 1.0, 2.0}));
}

}  // namespace
}  // namespace pliant::median_test
