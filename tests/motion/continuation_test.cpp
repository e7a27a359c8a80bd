#include "motion/continuation.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <vector>

namespace pliant::continuation_test {
namespace {

using Outcome = LoadContinuation::Outcome;

std::vector<double> shares(LoadContinuation& steps,
                           const std::function<Outcome(double share, double carried)>& attempt) {
  std::vector<double> tried;
  while (const auto share = steps.next()) {
    tried.push_back(*share);
    steps.report(attempt(*share, steps.carried()));
    if (tried.size() > 1000) ADD_FAILURE() << "it does not end";
    if (tried.size() > 1000) break;
  }
  return tried;
}

TEST(LoadContinuation, TakesAllAtOnceWhereItIsCarried) {
  LoadContinuation steps({.first = 1.0});
  EXPECT_EQ(shares(steps, [](double, double) { return Outcome::Carried; }), std::vector<double>{1.0});
  EXPECT_TRUE(steps.is_complete());
}

TEST(LoadContinuation, ShortensStepsToWhatIsFollowedAndGrowsThemAgain) {
  LoadContinuation steps({.first = 1.0, .growth = 1.5, .shrink = 0.5, .least = 1e-3});
  const auto tried = shares(steps, [](double share, double carried) {
    return share - carried <= 0.2 ? Outcome::Carried : Outcome::NotFollowed;
  });
  EXPECT_TRUE(steps.is_complete());
  ASSERT_GE(tried.size(), 4u);
  EXPECT_EQ(tried[1], 0.5);
  EXPECT_EQ(tried[2], 0.25);
  EXPECT_EQ(tried[3], 0.125);
  EXPECT_EQ(tried.back(), 1.0);
}

TEST(LoadContinuation, GivesUpWhereNoStepIsFollowed) {
  LoadContinuation steps({.first = 1.0, .least = 0.01});
  const auto tried =
      shares(steps, [](double share, double) { return share < 0.3 ? Outcome::Carried : Outcome::NotFollowed; });
  EXPECT_FALSE(steps.is_complete());
  EXPECT_GT(steps.carried(), 0.3 - 0.02);
  EXPECT_LT(steps.carried(), 0.3);
  EXPECT_LT(tried.size(), 60u);
}

TEST(LoadContinuation, ClosesInOnALoadThatIsTooMuch) {
  LoadContinuation steps({.first = 1.0, .growth = 1.0, .least = 1e-4, .least_relative = 0.025});
  shares(steps, [](double share, double) { return share < 0.62 ? Outcome::Carried : Outcome::TooMuch; });
  EXPECT_FALSE(steps.is_complete());
  EXPECT_LT(steps.carried(), 0.62);
  EXPECT_GT(steps.carried(), 0.62 * (1.0 - 2.5 * 0.025));
}

/// A limit that was too much from afar may be carried from nearby.
TEST(LoadContinuation, TriesTheLimitOnceMoreFromNearby) {
  LoadContinuation steps({.first = 1.0, .growth = 1.0, .least = 1e-4, .least_relative = 0.025});
  shares(steps, [](double share, double carried) {
    return share - carried < 0.06 || share < 0.62 ? Outcome::Carried : Outcome::TooMuch;
  });
  EXPECT_TRUE(steps.is_complete());
}

}  // namespace
}  // namespace pliant::continuation_test
