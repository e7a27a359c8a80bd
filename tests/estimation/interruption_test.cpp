// A fit that is interrupted anywhere tells what it has, and goes on from there to where it would have come.
#include "support/interruption.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "estimation/fit.hpp"
#include "support/sagging_bar.hpp"

namespace pliant::interruption_test {
namespace {

FitOptions quick() {
  FitOptions options;
  options.budget = 0.0;
  options.cells = options.coarse_cells = 8.0;
  options.parameters["poissons_ratio"].estimated = false;
  options.starts = 1;
  return options;
}

/// A fit that is asked to end from the given question on, and what it leaves to go on from.
struct Asked {
  explicit Asked(int at_most) : most(at_most) {}
  FitMonitor monitor() {
    FitMonitor m = watch.monitor();
    m.interrupted = [this] { return asked++ >= most; };
    return m;
  }
  int most;
  std::atomic<int> asked = 0;
  test::Interruption watch;
};

TEST(Interruption, AnywhereLeavesWhatLeadsToTheSameEnd) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  Asked never(1 << 20);
  const FitOutcome undisturbed = fit({bar}, quick(), never.monitor());
  ASSERT_FALSE(undisturbed.interrupted);
  const int all = never.asked;
  ASSERT_GT(all, 20);
  for (const double part : {0.05, 0.3, 0.5, 0.7, 0.9}) {
    Asked asked(int(part * all));
    const FitOutcome interrupted = fit({bar}, quick(), asked.monitor());
    EXPECT_TRUE(interrupted.interrupted) << part;
    EXPECT_EQ(interrupted.reason, "interrupted") << part;
    EXPECT_LE(asked.asked, asked.most + 4) << part << ": it goes on with nothing";
    const FitOutcome resumed = fit({bar}, quick(), {}, asked.watch.left());
    EXPECT_EQ(resumed.theta, undisturbed.theta) << part;
    EXPECT_TRUE(resumed.converged) << part;
    ASSERT_EQ(resumed.uncertainty.std.size(), undisturbed.uncertainty.std.size()) << part;
    EXPECT_NEAR(resumed.uncertainty.std[0], undisturbed.uncertainty.std[0], 1e-6 * undisturbed.uncertainty.std[0]);
  }
}

TEST(Interruption, BeforeAnEstimateTellsWhatFitsBestSoFar) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  test::Interruption at_full_grid("fine");
  const FitOutcome interrupted = fit({bar}, quick(), at_full_grid.monitor());
  ASSERT_TRUE(at_full_grid.came());
  EXPECT_TRUE(interrupted.interrupted);
  ASSERT_TRUE(interrupted.evaluation.succeeded);
  EXPECT_TRUE(std::isfinite(interrupted.final_cost));
  EXPECT_FALSE(interrupted.converged);
}

}  // namespace
}  // namespace pliant::interruption_test
