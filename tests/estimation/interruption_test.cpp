// A fit that is interrupted anywhere tells what it has, and goes on from there to where it would have come.
#include "support/interruption.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "estimation/fit.hpp"
#include "support/sagging_bar.hpp"

namespace pliant::interruption_test {
namespace {

TEST(Interruption, AnywhereLeavesWhatLeadsToTheSameEnd) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  test::Interruption never;
  const FitOutcome undisturbed = fit({bar}, test::quick_fit_of_bar(), never.monitor());
  ASSERT_FALSE(undisturbed.interrupted);
  const int all = never.asked();
  ASSERT_GT(all, 20);
  for (const double part : {0.05, 0.3, 0.5, 0.7, 0.9}) {
    test::Interruption interruption(int(part * all));
    const FitOutcome interrupted = fit({bar}, test::quick_fit_of_bar(), interruption.monitor());
    EXPECT_TRUE(interrupted.interrupted) << part;
    EXPECT_EQ(interrupted.reason, "interrupted") << part;
    EXPECT_LE(interruption.asked(), int(part * all) + 4) << part << ": it goes on with nothing";
    const FitOutcome resumed = fit({bar}, test::quick_fit_of_bar(), {}, interruption.left());
    EXPECT_EQ(resumed.theta, undisturbed.theta) << part;
    EXPECT_TRUE(resumed.converged) << part;
    ASSERT_EQ(resumed.uncertainty.std.size(), undisturbed.uncertainty.std.size()) << part;
    EXPECT_NEAR(resumed.uncertainty.std[0], undisturbed.uncertainty.std[0], 1e-6 * undisturbed.uncertainty.std[0]);
  }
}

TEST(Interruption, BeforeAnEstimateTellsWhatFitsBestSoFar) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  test::Interruption at_full_grid("fine");
  const FitOutcome interrupted = fit({bar}, test::quick_fit_of_bar(), at_full_grid.monitor());
  ASSERT_TRUE(at_full_grid.came());
  EXPECT_TRUE(interrupted.interrupted);
  ASSERT_TRUE(interrupted.evaluation.succeeded);
  EXPECT_TRUE(std::isfinite(interrupted.final_cost));
  EXPECT_FALSE(interrupted.converged);
}

/// In the last stage, whose derivatives at the best point are there: deviations are stated.
TEST(Interruption, WithinTheLastStageTellsTheBestPointAndItsDeviations) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  test::Interruption in_the_last([](const FitState& state) {
    return state.pass.under_way && state.pass.under_way->id == StageId{StageKind::Fine, 0, 1};
  });
  const FitOutcome interrupted = fit({bar}, test::quick_fit_of_bar(), in_the_last.monitor());
  ASSERT_TRUE(in_the_last.came());
  EXPECT_TRUE(interrupted.interrupted);
  ASSERT_TRUE(interrupted.evaluation.succeeded);
  EXPECT_GT(interrupted.uncertainty.std.size(), 0);
}

}  // namespace
}  // namespace pliant::interruption_test
