// Objectives and fits that several processes carry out together have what one alone has, to the last bit. Threads stand
// in for processes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "base/error.hpp"
#include "estimation/cost_bytes.hpp"
#include "estimation/fit.hpp"
#include "support/interruption.hpp"
#include "support/recordings.hpp"
#include "support/sagging_bar.hpp"
#include "support/thread_ranks.hpp"

namespace pliant::together_test {
namespace {

using testing::HasSubstr;

std::string bytes_of(const CostEvaluation& evaluation) {
  ByteWriter writer;
  write(evaluation, writer);
  return writer.take();
}

void expect_none_failed(const std::vector<std::exception_ptr>& thrown) {
  for (const std::exception_ptr& failure : thrown) EXPECT_EQ(test::what_of(failure), "");
}

/// Three flights of one torus, of unlike lengths, seen from other parameters than those that made them.
struct Flights {
  Flights() {
    for (const int frames : {3, 6, 4})
      recordings.push_back(test::torus_recording(0.05, frames, 0, 1e-3, unsigned(frames)));
    const MotionLayout& layout = recordings.front().scene.layout;
    VectorX theta = recordings.front().truth;
    layout.scale_moduli(theta, 1.4);
    std::vector<Parameter> list = test::torus_parameters(layout, theta).parameters();
    for (Parameter& q : list) q.estimated = true;
    parameters = ParameterSet(layout.layout(), list, theta);
    p = parameters.to_unconstrained(theta);
  }
  Objective objective(std::shared_ptr<ProcessGroup> processes = nullptr) const {
    std::vector<std::unique_ptr<Trial>> trials;
    for (const test::Recording& r : recordings) {
      ObjectiveOptions options;
      options.outlier_scale = 0.03, options.last_frame = int(r.scene.options.times.size()) - 1;
      trials.push_back(std::make_unique<MotionTrial>(
          ObservedMotion{{r.constraints, nullptr}, r.scene.body, r.scene.options, r.observations, options},
          int(trials.size())));
    }
    return {std::move(trials), parameters, std::move(processes)};
  }
  std::vector<test::Recording> recordings;
  ParameterSet parameters;
  VectorX p;
};

/// All that an objective can be asked, one after the other.
std::vector<std::string> answers(Objective objective, const VectorX& p) {
  const VectorX q = p.array() + 0.02;
  std::vector<std::string> all = {bytes_of(objective.evaluate(p)), bytes_of(objective.linearise(q)),
                                  bytes_of(objective.gradient(p))};
  std::vector<std::size_t> told;
  const std::vector<VectorX> points = {p, q, p.array() - 0.01};
  const auto several = objective.evaluate(points, [&](std::size_t i, const CostEvaluation&) {
    told.push_back(i);
    return true;
  });
  EXPECT_EQ(told.size(), points.size());
  for (const CostEvaluation& e : several) all.push_back(bytes_of(e));
  EXPECT_TRUE(objective.hold_shapes(p));
  all.push_back(bytes_of(objective.linearise(p)));
  return all;
}

TEST(EvaluatedTogether, AnEvaluationIsThatOfOneProcessToTheLastBit) {
  const Flights flights;
  const std::vector<std::string> alone = answers(flights.objective(), flights.p);
  const auto of_one = std::make_shared<ProcessGroup>();
  EXPECT_EQ(answers(flights.objective(of_one), flights.p), alone);
  for (const int ranks : {2, 3, 4})  // of four one has nothing to do
    expect_none_failed(test::run_ranks(ranks, [&](const auto& communicator) {
      EXPECT_EQ(answers(flights.objective(std::make_shared<ProcessGroup>(communicator)), flights.p), alone)
          << communicator->rank() << " of " << ranks;
    }));
}

TEST(EvaluatedTogether, AFailureOfOneTrialIsTheFailureOfAll) {
  const Flights flights;
  VectorX theta = flights.parameters.to_theta(flights.p);
  theta[flights.recordings.front().scene.layout.density] = not_a_number;
  ParameterSet bad = flights.parameters;
  bad.set_reference(theta);
  const std::string alone = [&] {
    Objective objective = flights.objective();
    objective.set_parameters(ParameterSet(bad.layout(), {}, theta));
    return bytes_of(objective.evaluate(VectorX(0)));
  }();
  expect_none_failed(test::run_ranks(2, [&](const auto& communicator) {
    Objective objective = flights.objective(std::make_shared<ProcessGroup>(communicator));
    objective.set_parameters(ParameterSet(bad.layout(), {}, theta));
    const CostEvaluation e = objective.evaluate(VectorX(0));
    EXPECT_FALSE(e.succeeded);
    EXPECT_EQ(bytes_of(e), alone);
  }));
}

/// Throws where it is run.
class ThrowingTrial : public Trial {
 public:
  [[nodiscard]] CostEvaluation run(const VectorX&, const MatrixX&) override {
    throw InputError({{"frame.png"}, "cut short", "a whole image", ""});
  }
  [[nodiscard]] CostEvaluation gradient(const VectorX& theta, VectorX&) override { return run(theta, {}); }
};

TEST(EvaluatedTogether, WhatATrialThrowsIsThrownInAll) {
  const Flights flights;
  const auto thrown = test::run_ranks(2, [&](const auto& communicator) {
    std::vector<std::unique_ptr<Trial>> trials;
    trials.push_back(std::make_unique<ThrowingTrial>());
    trials.push_back(std::make_unique<ThrowingTrial>());
    Objective objective(std::move(trials), flights.parameters, std::make_shared<ProcessGroup>(communicator));
    (void)objective.linearise(flights.p);
  });
  for (const std::exception_ptr& failure : thrown)
    EXPECT_EQ(test::what_of(failure), "frame.png: cut short; expected a whole image");
}

TEST(EvaluatedTogether, OtherNumbersAreFoundOut) {
  const Flights flights;
  const auto thrown = test::run_ranks(2, [&](const auto& communicator) {
    Objective objective = flights.objective(std::make_shared<ProcessGroup>(communicator));
    VectorX p = flights.p;
    if (communicator->rank() == 1) p[0] = std::nextafter(p[0], 1.0);
    (void)objective.evaluate(p);
  });
  for (const std::exception_ptr& failure : thrown)
    EXPECT_THAT(test::what_of(failure), HasSubstr("the processes have come apart"));
}

// Fits ----------------------------------------------------------------------------------------------------------------

std::vector<RecordedCapture> two_bars() {
  return {test::sagging_bar(test::stiffness_of_bar), test::sagging_bar(test::stiffness_of_bar, {0.0, -6.0, 7.0}, 8)};
}

void expect_same(const FitOutcome& a, const FitOutcome& b) {
  EXPECT_EQ(a.theta, b.theta);
  EXPECT_EQ(a.covariance, b.covariance);
  EXPECT_EQ(a.std, b.std);
  EXPECT_EQ(a.final_cost, b.final_cost);
  EXPECT_EQ(a.notes, b.notes);
  EXPECT_EQ(a.forward_steps, b.forward_steps);
  EXPECT_EQ(bytes_of(a.evaluation), bytes_of(b.evaluation));
  ASSERT_EQ(a.history.size(), b.history.size());
  for (std::size_t i = 0; i < a.history.size(); ++i) {
    EXPECT_EQ(a.history[i].stage, b.history[i].stage);
    EXPECT_EQ(a.history[i].cost, b.history[i].cost);
  }
}

TEST(FittedTogether, AFitIsThatOfOneProcessToTheLastBit) {
  const FitOutcome alone = fit(two_bars(), test::quick_fit_of_bar());
  ASSERT_TRUE(alone.converged) << alone.reason;
  ASSERT_GT(alone.std.size(), 0);
  expect_none_failed(test::run_ranks(2, [&](const auto& communicator) {
    FitMonitor monitor;
    monitor.processes = std::make_shared<ProcessGroup>(communicator);
    expect_same(fit(two_bars(), test::quick_fit_of_bar(), monitor), alone);
  }));
}

TEST(FittedTogether, AStopThatOneIsAskedForStopsAllAndLeadsToTheSameEnd) {
  FitOptions options = test::quick_fit_of_bar();
  options.alternatives = false, options.cells = options.coarse_cells = 5.0;
  const FitOutcome undisturbed = fit(two_bars(), options);
  test::Interruption never;
  expect_none_failed(test::run_ranks(2, [&](const auto& communicator) {  // questions put to the second one
    FitMonitor monitor = communicator->rank() == 1 ? never.monitor() : FitMonitor();
    monitor.processes = std::make_shared<ProcessGroup>(communicator, monitor.interrupted);
    (void)fit(two_bars(), options, monitor);
  }));
  const int all = never.asked();
  ASSERT_GT(all, 10);
  for (const double part : {0.3, 0.8}) {
    test::Interruption of_second(int(part * all)), of_first;
    std::vector<FitOutcome> outcomes(2);
    expect_none_failed(test::run_ranks(2, [&](const auto& communicator) {
      const bool is_first = communicator->rank() == 0;
      FitMonitor monitor = (is_first ? of_first : of_second).monitor();
      monitor.processes = std::make_shared<ProcessGroup>(communicator, monitor.interrupted);
      outcomes[std::size_t(communicator->rank())] = fit(two_bars(), options, monitor);
    }));
    ASSERT_TRUE(of_second.came()) << part;
    for (const FitOutcome& outcome : outcomes) {
      EXPECT_TRUE(outcome.interrupted) << part;
      EXPECT_EQ(outcome.theta, outcomes.front().theta) << part;
    }
    const FitOutcome resumed = fit(two_bars(), options, {}, of_first.left());
    EXPECT_EQ(resumed.theta, undisturbed.theta) << part << ": resumed by one process alone";
  }
}

}  // namespace
}  // namespace pliant::together_test
