#include "estimation/optimiser.hpp"

#include "base/error.hpp"
#include "estimation/fit.hpp"
#include "support/recordings.hpp"
#include "support/tolerance.hpp"

namespace pliant::optimiser_test {
namespace {

using test::tolerance;

constexpr double cell_size = 0.05;

ParameterSet estimating(const test::Recording& recording, const std::vector<std::string>& names, const VectorX& start) {
  ParameterSet set = recording.parameters;
  for (const std::string& name : names) set.set_estimated(name, true);
  set.set_reference(start);
  return set;
}

/// The truth with another modulus.
VectorX with_modulus(const test::Recording& recording, double factor) {
  VectorX theta = recording.truth;
  recording.scene.layout.scale_moduli(theta, factor);
  return theta;
}

double modulus(const test::Recording& recording, const VectorX& theta) {
  return theta[recording.scene.layout.youngs_moduli[0]];
}

double fitted_modulus(const test::Recording& recording, double start_factor, const OptimiserOptions& options,
                      OptimiserSummary* out = nullptr) {
  const ParameterSet set = estimating(recording, {"youngs_modulus"}, with_modulus(recording, start_factor));
  Objective objective = recording.objective(set, 0.033);
  const OptimiserSummary summary = minimise(objective, set.to_unconstrained(set.reference()), options);
  EXPECT_TRUE(summary.succeeded) << summary.reason;
  EXPECT_LE(summary.evaluation.cost, summary.start_cost);
  if (out) *out = summary;
  return modulus(recording, set.to_theta(summary.p));
}

/// An inverse crime on purpose: the fitting model made the data, so the truth has to come back.
TEST(LevenbergMarquardt, RecoversTheModulusOfItsOwnModelFromFarOff) {
  const test::Recording recording = test::torus_recording(cell_size, 9, 1, 0.0, 1, 40, 0.0, 1.0, 1e-10);
  const double truth = modulus(recording, recording.truth);
  for (const double start : {0.3, 2.0}) {
    OptimiserSummary summary;
    const double found = fitted_modulus(recording, start, {}, &summary);
    EXPECT_TRUE(summary.converged) << summary.reason;
    EXPECT_LE(summary.iterations, 15);
    // The surface samples lie on the distance's grid only up to its own error, spacing^2 / (4 tube radius).
    EXPECT_NEAR(found / truth, 1.0, tolerance(0.01)) << "from " << start;
  }
}

TEST(LevenbergMarquardt, RecoversTheModulusOfAFinerModel) {
  test::Recording recording = test::torus_recording(0.0245, 10, 1, 0.5e-3, 2, 40, 0.0163, 0.25, 1e-8);
  recording.scene.options.max_dt *= 0.5;  // about the step and the cells that a fit takes by default
  OptimiserSummary summary;
  const double found = fitted_modulus(recording, 0.8, {}, &summary) / modulus(recording, recording.truth);
  RecordProperty("ratio", std::to_string(found));
  EXPECT_NEAR(found, 1.0, tolerance(0.05));
}

TEST(LevenbergMarquardt, RecoversSeveralParametersTogether) {
  const test::Recording recording = test::torus_recording(cell_size, 9, 1, 0.0, 1, 40, 0.0, 1.0, 1e-10);
  VectorX start = with_modulus(recording, 0.8);
  const MotionLayout& layout = recording.scene.layout;
  start[layout.stiffness_damping] *= 1.5;
  start.segment<3>(layout.linear_velocity) += Vector3(0.03, -0.03, 0.03);
  start.segment<3>(layout.planes[0].point) += Vector3(0.0, 2e-3, 0.0);
  const ParameterSet set =
      estimating(recording, {"youngs_modulus", "stiffness_damping", "linear_velocity", "plane"}, start);
  Objective objective = recording.objective(set, 0.033);
  OptimiserOptions options;
  options.cost_tolerance = 1e-9;
  const OptimiserSummary summary = minimise(objective, set.to_unconstrained(start), options);
  ASSERT_TRUE(summary.succeeded);
  const VectorX theta = set.to_theta(summary.p);
  // The samples of the surface are not quite on it: the least cost lies a little off the truth, and below its cost.
  EXPECT_LE(summary.evaluation.cost, objective.evaluate(set.to_unconstrained(recording.truth)).cost);
  EXPECT_NEAR(modulus(recording, theta) / modulus(recording, recording.truth), 1.0, tolerance(0.05));
  EXPECT_LT((theta - recording.truth).segment<3>(layout.linear_velocity).norm(), tolerance(0.015));
  EXPECT_LT(summary.evaluation.cost, 0.05 * summary.start_cost);
}

class BaselineOptimiser : public ::testing::TestWithParam<OptimiserKind> {};

TEST_P(BaselineOptimiser, LowersTheCostAndComesClose) {
  const test::Recording recording = test::torus_recording(cell_size, 9, 1, 0.0, 1, 40, 0.0, 1.0, 1e-10);
  OptimiserOptions options;
  options.kind = GetParam();
  options.max_iterations = 40;
  OptimiserSummary summary;
  const double found = fitted_modulus(recording, 2.0, options, &summary);
  EXPECT_LT(summary.evaluation.cost, 0.1 * summary.start_cost);
  EXPECT_NEAR(found / modulus(recording, recording.truth), 1.0, tolerance(0.03));
  EXPECT_FALSE(summary.reason.empty());
}

std::vector<OptimiserKind> kinds_built() {
  std::vector<OptimiserKind> kinds = {OptimiserKind::Rprop, OptimiserKind::GradientDescent,
                                      OptimiserKind::LevenbergMarquardt, OptimiserKind::Lbfgs};
#ifdef PLIANT_WITH_NLOPT
  kinds.push_back(OptimiserKind::NelderMead);
#endif
  return kinds;
}

INSTANTIATE_TEST_SUITE_P(Kinds, BaselineOptimiser, ::testing::ValuesIn(kinds_built()));

TEST_P(BaselineOptimiser, AStartThatIsNoNumberFailsWithAReason) {
  const test::Recording recording = test::torus_recording(cell_size, 3, 1, 1e-3);
  const ParameterSet set = estimating(recording, {"linear_velocity"}, recording.truth);
  Objective objective = recording.objective(set);
  OptimiserOptions options;
  options.kind = GetParam();
  const OptimiserSummary summary = minimise(objective, VectorX::Constant(3, std::nan("")), options);
  EXPECT_FALSE(summary.succeeded);
  EXPECT_NE(summary.reason, "not run");
  EXPECT_FALSE(summary.reason.empty());
}

/// Stiffer bodies need more iterations of the linear solver than it is allowed: every step that far fails.
TEST_P(BaselineOptimiser, BacksOffFromStepsThatCannotBeSimulated) {
  test::Recording recording = test::torus_recording(cell_size, 6, 0, 0.0, 1, 40, 0.0, 1.0, 1e-10);
  recording.scene.options.max_dt = 1.0;  // a step a frame: the stiffness weighs more
  recording.scene.options.most_halvings = 0;
  const VectorX start = with_modulus(recording, 0.25);
  ParameterSet set = estimating(recording, {"youngs_modulus"}, start);
  const VectorX p = set.to_unconstrained(start);
  int allowed = 5;
  for (;; ++allowed) {
    recording.scene.options.solver.max_iterations = allowed;
    if (recording.objective(set).linearise(p).succeeded && recording.objective(set).gradient(p).succeeded) break;
    ASSERT_LT(allowed, 100);
  }
  Objective objective = recording.objective(set);
  ASSERT_FALSE(objective.evaluate(p + VectorX::Constant(1, 1.4)).succeeded)
      << "the truth can be simulated: nothing fails";
  OptimiserOptions options;
  options.kind = GetParam();
  options.max_iterations = 8;
  int rejected = 0;
  const OptimiserSummary summary = minimise(objective, p, options, [&](const Iteration& i) {
    rejected += !i.accepted;
    EXPECT_TRUE(std::isfinite(i.cost));
    return true;
  });
  EXPECT_TRUE(summary.succeeded);
  EXPECT_TRUE(summary.evaluation.succeeded);
  EXPECT_LE(summary.evaluation.cost, summary.start_cost);
  EXPECT_GT(rejected, 0);
}

TEST_P(BaselineOptimiser, StopsWhenTold) {
  const test::Recording recording = test::torus_recording(cell_size, 6, 1, 0.0, 1, 40, 0.0, 1.0, 1e-8);
  const ParameterSet set = estimating(recording, {"youngs_modulus"}, with_modulus(recording, 3.0));
  Objective objective = recording.objective(set);
  OptimiserOptions options;
  options.kind = GetParam();
  const OptimiserSummary stopped = minimise(objective, set.to_unconstrained(set.reference()), options,
                                            [](const Iteration& i) { return i.number < 2; });
  EXPECT_TRUE(stopped.interrupted);
  EXPECT_FALSE(stopped.converged);
  EXPECT_EQ(stopped.iterations, 2);
  options.max_iterations = 1;
  const OptimiserSummary one = minimise(objective, set.to_unconstrained(set.reference()), options);
  EXPECT_EQ(one.iterations, 1);
  EXPECT_FALSE(one.interrupted);
}

TEST_P(BaselineOptimiser, GoesOnFromAnyIterationAlongTheSamePath) {
  const test::Recording recording = test::torus_recording(cell_size, 6, 1, 0.0, 1, 40, 0.0, 1.0, 1e-8);
  const ParameterSet set = estimating(recording, {"youngs_modulus", "stiffness_damping"}, with_modulus(recording, 3.0));
  OptimiserOptions options;
  options.kind = GetParam();
  options.max_iterations = 6;
  std::vector<OptimiserState> states;
  Objective objective = recording.objective(set);
  const OptimiserSummary whole =
      minimise(objective, set.to_unconstrained(set.reference()), options, [&](const Iteration& i) {
        states.push_back(i.state());
        return true;
      });
  ASSERT_GE(states.size(), 3U);
  for (std::size_t k = 0; k + 1 < states.size(); ++k) {
    Objective anew = recording.objective(set);
    const OptimiserSummary rest = minimise(anew, states[k], options);
    EXPECT_EQ(rest.iterations, whole.iterations) << "from " << k + 1;
    EXPECT_EQ(rest.p, whole.p) << "from " << k + 1;
    EXPECT_EQ(rest.reason, whole.reason);
  }
}

/// x^T H x / 2 - b x of numbers between -1 and 1, or other bounds.
class BoundedQuadratic : public CostFunction {
 public:
  BoundedQuadratic(MatrixX H, VectorX b, double bound = 1.0) : H_(std::move(H)), b_(std::move(b)) {
    ParameterLayout layout;
    std::vector<Parameter> list;
    for (int i = 0; i < b_.size(); ++i) {
      const std::string name(1, char('x' + i));
      list.push_back({name, "1", Transform::Shift, layout.add({name, "1"}), 1.0, -bound, bound, true});
    }
    set_ = ParameterSet(std::move(layout), std::move(list), VectorX::Zero(b_.size()));
  }
  const ParameterSet& parameters() const override { return set_; }
  using CostFunction::evaluate;
  CostEvaluation evaluate(const VectorX& x) override {
    CostEvaluation e;
    e.succeeded = true;
    e.cost = 10.0 + 0.5 * x.dot(H_ * x) - b_.dot(x);
    e.gradient = H_ * x - b_;
    e.gauss_newton = H_;
    return e;
  }
  CostEvaluation linearise(const VectorX& x) override { return evaluate(x); }
  CostEvaluation gradient(const VectorX& x) override { return evaluate(x); }

 private:
  MatrixX H_;
  VectorX b_;
  ParameterSet set_;
};

/// Interrupted in the midst of an evaluation.
class InterruptedQuadratic : public BoundedQuadratic {
 public:
  explicit InterruptedQuadratic(int evaluations)
      : BoundedQuadratic(Eigen::Vector2d(4.0, 1.0).asDiagonal(), Eigen::Vector2d(2.0, 0.1)), left_(evaluations) {}
  using BoundedQuadratic::evaluate;
  CostEvaluation evaluate(const VectorX& x) override {
    if (left_-- == 0) throw Interrupted();
    return BoundedQuadratic::evaluate(x);
  }

 private:
  int left_;
};

TEST_P(BaselineOptimiser, InterruptedInATrialEndsAtTheBestPoint) {
  OptimiserOptions options;
  options.kind = GetParam();
  const Eigen::Vector2d far(-0.4, 0.9);
  InterruptedQuadratic at_once(0);
  EXPECT_THROW((void)minimise(at_once, far, options), Interrupted) << "there is nothing to end at";
  for (const int evaluations : {1, 3}) {
    InterruptedQuadratic cost(evaluations), undisturbed(-1);
    const OptimiserSummary s = minimise(cost, far, options);
    EXPECT_TRUE(s.interrupted);
    EXPECT_TRUE(s.succeeded);
    EXPECT_FALSE(s.converged);
    EXPECT_EQ(s.reason, "interrupted");
    EXPECT_EQ(s.evaluation.cost, undisturbed.evaluate(s.p).cost);
    EXPECT_LE(s.evaluation.cost, s.start_cost);
    if (evaluations > 1) {
      EXPECT_LT(s.evaluation.cost, s.start_cost);
    }
  }
}

TEST(CostFunction, EvaluatesSeveralVectorsOneAfterTheOther) {
  BoundedQuadratic cost(MatrixX::Identity(2, 2), Eigen::Vector2d(1.0, 0.5));
  const std::vector<VectorX> points = {Eigen::Vector2d(0.0, 0.0), Eigen::Vector2d(1.0, 0.5),
                                       Eigen::Vector2d(-1.0, 1.0)};
  std::vector<std::size_t> order;
  const std::vector<CostEvaluation> all = cost.evaluate(points, [&](std::size_t i, const CostEvaluation&) {
    order.push_back(i);
    return i < 1;
  });
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1}));
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(all[i].cost, cost.evaluate(points[i]).cost);
  EXPECT_FALSE(all[2].succeeded);
  EXPECT_EQ(all[2].failure, "left out");
}

TEST(LevenbergMarquardt, EndsWithinAFractionOfAStandardDeviationWhereThatIsEnough) {
  const MatrixX H = Eigen::Vector2d(4.0, 1.0).asDiagonal();
  const Eigen::Vector2d minimum(0.5, 0.1), far(-0.4, 0.9);
  BoundedQuadratic cost(H, H * minimum);
  const double least = cost.evaluate(minimum).cost;
  OptimiserOptions options = {.step_tolerance = 1e-12, .cost_tolerance = 1e-15, .promise_tolerance = 0.005};
  const OptimiserSummary near = minimise(cost, far, options);
  EXPECT_TRUE(near.converged);
  EXPECT_GT(near.iterations, 0);
  EXPECT_LT(near.evaluation.cost - least, options.promise_tolerance);
  options.promise_tolerance = 3.0;  // more than there is to gain
  int told = 0;
  const OptimiserSummary at_once = minimise(cost, far, options, [&](const Iteration&) { return ++told > 0; });
  EXPECT_TRUE(at_once.converged);
  EXPECT_EQ(at_once.iterations, 1) << "which is told, and moves nothing";
  EXPECT_EQ(told, 1);
  EXPECT_EQ(at_once.p, VectorX(far));
}

TEST(LevenbergMarquardt, ANumberAtItsBoundDoesNotHoldUpTheOthers) {
  // The first wants to go to 1000; the second's minimum with the first at 1 is 0.5.
  const MatrixX H = (MatrixX(2, 2) << 1e-3, 0.0, 0.0, 1.0).finished();
  BoundedQuadratic cost(H, Eigen::Vector2d(1.0, 0.5));
  const OptimiserSummary s = minimise(cost, Eigen::Vector2d(1.0, -1.0), {});
  EXPECT_EQ(s.p[0], 1.0);
  EXPECT_NEAR(s.p[1], 0.5, 1e-3);
  EXPECT_LE(s.iterations, 10);
}

TEST(LevenbergMarquardt, WhatOnlyAnotherNumberPushesOutwardsIsLetIn) {
  const MatrixX H = (MatrixX(2, 2) << 1.0, -0.9, -0.9, 1.0).finished();
  const Eigen::Vector2d at(1.0, 1.0), pull(0.55, -0.4);
  BoundedQuadratic cost(H, H * at + pull);
  const OptimiserSummary s = minimise(cost, at, {});
  EXPECT_EQ(s.p[0], 1.0);
  EXPECT_NEAR(s.p[1], 0.6, 1e-3);
}

TEST(LevenbergMarquardt, ANumberCloseToItsBoundDoesNotHoldUpTheOthers) {
  // The first would go far beyond its bound, and take the second along; with the first at 1 the second's minimum is
  // 0.5.
  const MatrixX H = (MatrixX(2, 2) << 1.0, 0.999, 0.999, 1.0).finished();
  const Eigen::Vector2d minimum(200.0, 0.5 - 0.999 * 199.0);
  for (const double below : {1e-5, 1e-3, 0.1}) {
    BoundedQuadratic cost(H, H * minimum);
    OptimiserOptions options;
    options.promise_tolerance = 1e-6;
    const OptimiserSummary s = minimise(cost, Eigen::Vector2d(1.0 - below, -0.5), options);
    EXPECT_NEAR(s.p[0], 1.0, 1e-6) << below;
    EXPECT_NEAR(s.p[1], 0.5, 1e-2) << below << ": " << s.reason;
  }
}

TEST(LevenbergMarquardt, DampingOfLongStepsLetsWhatIsKnownArrive) {
  // Of two numbers the sum is known, 0.4; their difference hardly is, and asks for a step of a hundred.
  const MatrixX H = (MatrixX(2, 2) << 1.0, 1.0 - 1e-6, 1.0 - 1e-6, 1.0).finished();
  BoundedQuadratic cost(H, H * Eigen::Vector2d(50.2, -49.8), 1e3);
  OptimiserOptions options;
  options.max_iterations = 1;
  options.max_step = 0.5;
  const auto sum_after = [&](bool damps) {
    options.damps_long_steps = damps;
    return minimise(cost, {0, VectorX::Zero(2), VectorX::Constant(1, 1e-8)}, options).p.sum();
  };
  EXPECT_LT(sum_after(false), 0.01);
  EXPECT_NEAR(sum_after(true), 0.4, 0.02);
}

/// A body and the contact that it stands on, springs in series: their common compliance is measured to a
/// ten-thousandth, that of the contact, less than a tenth of it, to an eighth. The cost is a narrow valley, nearly
/// straight by the contact's compliance and bent by its logarithm.
class SpringsInSeries : public CostFunction {
 public:
  explicit SpringsInSeries(bool contact_acts_by_inverse) {
    ParameterLayout layout;
    std::vector<Parameter> list;
    for (const char* name : {"body", "contact"})
      list.push_back({name, "N/m", Transform::Logarithm, layout.add({name, "N/m"}), 1.0, 1e-3, 1e3, true});
    list[1].acts_by_inverse = contact_acts_by_inverse;
    set_ = ParameterSet(std::move(layout), std::move(list), Eigen::Vector2d(1.0, 50.0));
  }
  const ParameterSet& parameters() const override { return set_; }
  using CostFunction::evaluate;
  CostEvaluation evaluate(const VectorX& p) override { return linearise(p); }
  CostEvaluation gradient(const VectorX& p) override { return linearise(p); }
  CostEvaluation linearise(const VectorX& p) override {
    ++linearisations;
    const double body = std::exp(-p[0]), contact = std::exp(-p[1]);  // compliances
    const Eigen::Vector2d r((body + contact - 1.03) / 1e-4, (contact - 0.08) / 0.01);
    const Eigen::Matrix2d J{{-body / 1e-4, -contact / 1e-4}, {0.0, -contact / 0.01}};
    CostEvaluation e;
    e.succeeded = true;
    e.cost = 0.5 * r.squaredNorm();
    e.gradient = J.transpose() * r;
    e.gauss_newton = J.transpose() * J;
    return e;
  }
  int linearisations = 0;

 private:
  ParameterSet set_;
};

TEST(LevenbergMarquardt, ACompliancesValleyIsFollowedAtOnce) {
  SpringsInSeries by_inverse(true), by_logarithm(false);
  const OptimiserOptions options{.max_iterations = 200, .step_tolerance = 1e-9, .cost_tolerance = 1e-12};
  for (SpringsInSeries* cost : {&by_inverse, &by_logarithm}) {
    const ParameterSet& set = cost->parameters();
    const OptimiserSummary s = minimise(*cost, set.to_unconstrained(set.reference()), options);
    EXPECT_NEAR(std::exp(-s.p[0]), 0.95, 1e-5) << s.reason;
    EXPECT_NEAR(std::exp(-s.p[1]), 0.08, 1e-5) << s.reason;
  }
  EXPECT_LT(4 * by_inverse.linearisations, by_logarithm.linearisations) << by_inverse.linearisations;
}

OptimiserOptions precise(OptimiserKind kind) {
  OptimiserOptions options;
  options.kind = kind;
  options.max_iterations = 200;
  options.step_tolerance = 1e-7, options.cost_tolerance = 1e-12;
  return options;
}

TEST(LevenbergMarquardt, StepsThatKeepWhatTheyPromiseGrow) {
  const Eigen::Vector2d minimum(20.0, -0.1);
  BoundedQuadratic cost(MatrixX::Identity(2, 2), minimum, 1e3);
  OptimiserOptions options = precise(OptimiserKind::LevenbergMarquardt);
  options.max_step = 0.5;
  std::vector<OptimiserState> states;
  const auto keep = [&](const Iteration& i) {
    states.push_back(i.state());
    return true;
  };
  const OptimiserSummary limited = minimise(cost, Eigen::Vector2d(0.0, 0.0), options);
  options.damps_long_steps = true;
  EXPECT_GE(minimise(cost, Eigen::Vector2d(0.0, 0.0), options).iterations, 40) << "nobody lets them grow";
  options.growth_of_max_step = 8.0;
  const OptimiserSummary trusted = minimise(cost, Eigen::Vector2d(0.0, 0.0), options, keep);
  for (const OptimiserSummary* s : {&limited, &trusted}) EXPECT_LT((s->p - minimum).norm(), 1e-3) << s->reason;
  EXPECT_GE(limited.iterations, 40) << "half a unit each";
  EXPECT_LT(trusted.iterations, 15);
  ASSERT_GT(states.size(), 3U);
  EXPECT_LT(states[0].p.cwiseAbs().maxCoeff(), 0.51) << "the first is as long as was said";
  for (std::size_t i = 1; i < states.size(); ++i)
    EXPECT_LT((states[i].p - states[i - 1].p).cwiseAbs().maxCoeff(), 8.1 * options.max_step) << i;
  EXPECT_EQ(minimise(cost, states[2], options).p, trusted.p) << "the region is part of the state";
}

TEST(LevenbergMarquardt, EndsWhereTheCostThatIsAskedForIsOutOfReach) {
  BoundedQuadratic cost(MatrixX::Identity(1, 1), VectorX::Constant(1, 20.0), 1e3);  // 10 - 200 at its minimum
  OptimiserOptions options;
  options.max_step = 0.01;
  options.cost_tolerance = 1e-6;
  const auto with = [&](double reach) {
    options.cost_to_reach = reach;
    return minimise(cost, VectorX::Zero(1), options);
  };
  const OptimiserSummary hopeless = with(-600.0), hopeful = with(-189.0);
  EXPECT_TRUE(hopeless.is_out_of_reach && hopeless.succeeded && !hopeless.converged);
  EXPECT_EQ(hopeless.iterations, 2);
  EXPECT_FALSE(hopeful.is_out_of_reach);
  EXPECT_EQ(hopeful.iterations, options.max_iterations);
}

/// Its curvature is fifty times what its Gauss-Newton matrix says: steps are far too long until they are damped.
class Overshooting : public BoundedQuadratic {
 public:
  Overshooting() : BoundedQuadratic(MatrixX::Identity(2, 2), Eigen::Vector2d(0.3, -0.2)) {}
  CostEvaluation linearise(const VectorX& x) override {
    ++linearisations;
    CostEvaluation e = evaluate(x);
    e.gauss_newton /= 50.0;
    return e;
  }
  int linearisations = 0;
};

TEST(LevenbergMarquardt, TriesSeveralDampingsAfterARejection) {
  OptimiserOptions options = precise(OptimiserKind::LevenbergMarquardt);
  Overshooting one, several;
  const OptimiserSummary by_one = minimise(one, Eigen::Vector2d(0.0, 0.0), options);
  options.trials_after_rejection = 3;
  std::vector<OptimiserState> states;
  const OptimiserSummary by_several = minimise(several, Eigen::Vector2d(0.0, 0.0), options, [&](const Iteration& i) {
    states.push_back(i.state());
    return true;
  });
  for (const OptimiserSummary* s : {&by_one, &by_several}) {
    EXPECT_NEAR(s->p[0], 0.3, 1e-4);
    EXPECT_NEAR(s->p[1], -0.2, 1e-4);
  }
  EXPECT_LT(several.linearisations, one.linearisations);
  EXPECT_LT(by_several.iterations, by_one.iterations);
  EXPECT_GT(by_several.evaluations, several.linearisations) << "the costs alone count as well";
  states.pop_back();  // its end
  for (const OptimiserState& state : states) {
    Overshooting anew;
    EXPECT_EQ(minimise(anew, state, options).p, by_several.p) << "from " << state.iterations;
  }
}

TEST(LevenbergMarquardt, DoesNotTryAStepAgainThatWasJustRefused) {
  OptimiserOptions options = precise(OptimiserKind::LevenbergMarquardt);
  Overshooting cost;
  std::vector<Iteration> iterations;
  (void)minimise(cost, Eigen::Vector2d(0.0, 0.0), options, [&](const Iteration& i) {
    iterations.push_back(i);
    return true;
  });
  int pairs = 0;
  for (std::size_t i = 1; i < iterations.size(); ++i) {
    if (iterations[i - 1].accepted || !iterations[i].accepted) continue;
    ++pairs;
    EXPECT_GE(iterations[i].damping, iterations[i - 1].damping) << "of the step after next";
  }
  EXPECT_GT(pairs, 0);
}

/// Eigenvalues over three decades, in directions that mix all numbers.
BoundedQuadratic long_valley(const VectorX& minimum) {
  const Eigen::Index n = minimum.size();
  MatrixX mixing(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) mixing(i, j) = std::cos(double(1 + i * (2 * j + 1)));
  const MatrixX Q = mixing.householderQr().householderQ();
  const VectorX eigenvalues = VectorX::LinSpaced(n, 0.0, 3.0).unaryExpr([](double e) { return std::pow(10.0, e); });
  const MatrixX H = Q * eigenvalues.asDiagonal() * Q.transpose();
  return {H, H * minimum};
}

TEST(Lbfgs, FollowsALongValleyWhereGradientDescentDoesNotArrive) {
  VectorX minimum(20);
  for (Eigen::Index i = 0; i < minimum.size(); ++i) minimum[i] = 0.5 * std::sin(double(i));
  BoundedQuadratic cost = long_valley(minimum);
  const VectorX start = VectorX::Zero(minimum.size());
  const OptimiserSummary s = minimise(cost, start, precise(OptimiserKind::Lbfgs));
  EXPECT_TRUE(s.converged) << s.reason;
  EXPECT_LT((s.p - minimum).cwiseAbs().maxCoeff(), tolerance(1e-4));
  const OptimiserSummary other = minimise(cost, start, precise(OptimiserKind::GradientDescent));
  EXPECT_GT((other.p - minimum).cwiseAbs().maxCoeff(), 1e-2);
}

TEST(Lbfgs, ANumberAtItsBoundDoesNotHoldUpTheOthers) {
  VectorX minimum = VectorX::Constant(6, 0.5);
  minimum[2] = 3.0;  // beyond its bound
  BoundedQuadratic cost = long_valley(minimum);
  const OptimiserSummary s = minimise(cost, VectorX::Zero(6), precise(OptimiserKind::Lbfgs));
  // At a minimum within bounds the slope is zero but for numbers at a bound that it pushes outwards.
  const VectorX gradient = cost.evaluate(s.p).gradient;
  int held = 0;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const bool is_held = std::abs(s.p[i]) == 1.0;
    held += is_held;
    if (is_held)
      EXPECT_LT(gradient[i] * s.p[i], 0.0) << i;
    else
      EXPECT_NEAR(gradient[i], 0.0, tolerance(1e-3)) << i;
  }
  EXPECT_GT(held, 0);
}

/// The cost of another function wherever x lies beyond a wall: there nothing can be evaluated, or the cost is no
/// number.
class Walled : public BoundedQuadratic {
 public:
  Walled(MatrixX H, VectorX b, double wall, bool says_so)
      : BoundedQuadratic(std::move(H), std::move(b)), wall_(wall), says_so_(says_so) {}
  CostEvaluation gradient(const VectorX& x) override {
    CostEvaluation e = BoundedQuadratic::gradient(x);
    if (x[0] < wall_) return e;
    ++failures;
    e.succeeded = !says_so_;
    e.cost = says_so_ ? 0.0 : std::nan("");
    e.gradient.setConstant(std::nan(""));
    return e;
  }
  int failures = 0;

 private:
  double wall_;
  bool says_so_;
};

TEST(Lbfgs, BacksOffFromCostsThatAreNoNumbers) {
  const MatrixX H = (MatrixX(2, 2) << 1.0, 0.0, 0.0, 9.0).finished();
  for (const bool says_so : {true, false}) {
    Walled cost(H, H * Eigen::Vector2d(0.6, 0.5), 0.4, says_so);
    const OptimiserSummary s = minimise(cost, Eigen::Vector2d(-0.9, -0.9), precise(OptimiserKind::Lbfgs));
    EXPECT_TRUE(s.succeeded);
    EXPECT_GT(cost.failures, 0);
    EXPECT_LT(s.p[0], 0.4);
    EXPECT_TRUE(std::isfinite(s.evaluation.cost));
    EXPECT_LT(s.evaluation.cost, s.start_cost);
    EXPECT_TRUE(s.evaluation.gradient.allFinite());
  }
}

TEST(Lbfgs, TakesAStateWithMoreChangesThanItKeepsOn) {
  VectorX minimum(12);
  for (Eigen::Index i = 0; i < minimum.size(); ++i) minimum[i] = 0.5 * std::cos(double(i));
  BoundedQuadratic cost = long_valley(minimum);
  std::vector<OptimiserState> states;
  OptimiserOptions options = precise(OptimiserKind::Lbfgs);
  options.max_iterations = 40;
  const OptimiserSummary whole = minimise(cost, VectorX::Zero(12), options, [&](const Iteration& i) {
    states.push_back(i.state());
    return true;
  });
  ASSERT_GE(states.size(), 30U);
  EXPECT_EQ(states.back().memory.size(), states[25].memory.size()) << "the memory is limited";
  const OptimiserSummary rest = minimise(cost, states[25], options);
  EXPECT_EQ(rest.p, whole.p);
  EXPECT_EQ(rest.iterations, whole.iterations);
}

#ifdef PLIANT_WITH_NLOPT

TEST(NelderMead, FindsTheMinimumThatLevenbergAndMarquardtFind) {
  const test::Recording recording = test::torus_recording(cell_size, 6, 1, 1e-3, 1, 40, 0.0, 1.0, 1e-10);
  const ParameterSet set = estimating(recording, {"youngs_modulus", "stiffness_damping"}, with_modulus(recording, 1.8));
  OptimiserOptions options;
  options.max_iterations = 200;
  options.cost_tolerance = 1e-10;
  VectorX found[2];
  long long evaluations[2];
  for (const OptimiserKind kind : {OptimiserKind::LevenbergMarquardt, OptimiserKind::NelderMead}) {
    options.kind = kind;
    Objective objective = recording.objective(set, 0.033);
    const OptimiserSummary summary = minimise(objective, set.to_unconstrained(set.reference()), options);
    ASSERT_TRUE(summary.converged) << summary.reason;
    EXPECT_EQ(summary.evaluation.cost, objective.evaluate(summary.p).cost);
    const int i = kind == OptimiserKind::NelderMead ? 1 : 0;
    found[i] = summary.p, evaluations[i] = summary.evaluations;
  }
  EXPECT_LT((found[1] - found[0]).cwiseAbs().maxCoeff(), tolerance(5.0 * options.step_tolerance));
  EXPECT_GT(evaluations[1], evaluations[0]) << "costs alone";
}

TEST(NelderMead, LetsAnExceptionThrough) {
  const test::Recording recording = test::torus_recording(cell_size, 3, 1, 1e-3);
  const ParameterSet set = estimating(recording, {"youngs_modulus"}, recording.truth);
  Objective objective = recording.objective(set);
  OptimiserOptions options;
  options.kind = OptimiserKind::NelderMead;
  EXPECT_THROW((void)minimise(objective, set.to_unconstrained(set.reference()), options,
                              [](const Iteration&) -> bool { throw std::out_of_range("the log is full"); }),
               std::out_of_range);
}

#endif

TEST(Minimise, NothingToEstimateIsDoneAtOnce) {
  const test::Recording recording = test::torus_recording(cell_size, 3, 1, 1e-3);
  Objective objective = recording.objective(recording.parameters);
  const OptimiserSummary summary = minimise(objective, VectorX(0), {});
  EXPECT_TRUE(summary.succeeded);
  EXPECT_EQ(summary.iterations, 0);
}

/// Frames that each measure a line's slope and offset with independent noise: the truth is the least-squares
/// covariance.
TEST(ParameterCovariance, OfALinearModel) {
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  const int frames = 400, points = 5;
  CostEvaluation e;
  e.gauss_newton = MatrixX::Zero(2, 2);
  MatrixX total = MatrixX::Zero(2, 2);
  for (int f = 0; f < frames; ++f) {
    FrameFit fit;
    fit.gradient = VectorX::Zero(2);
    fit.gauss_newton = MatrixX::Zero(2, 2);
    for (int i = 0; i < points; ++i) {
      VectorX row(2);
      row << 1.0, double(i) - 1.0;
      fit.gradient += row * normal(random);
      fit.gauss_newton += row * row.transpose();
    }
    total += fit.gauss_newton;
    e.frames.push_back(fit);
  }
  e.gauss_newton = total;
  const MatrixX least_squares = total.inverse(), covariance = noise_covariance(e);
  EXPECT_LT((covariance - covariance.transpose()).norm(), tolerance(1e-12) * covariance.norm());
  for (int i = 0; i < 2; ++i) {
    const double ratio = covariance(i, i) / least_squares(i, i);
    EXPECT_GE(ratio, 1.0) << "never surer than the curvature";
    EXPECT_LT(ratio, 3.0);
  }
  // Errors that a frame's points share count as the few that they are.
  for (FrameFit& fit : e.frames) fit.gradient *= 3.0;
  const MatrixX shared = noise_covariance(e);
  EXPECT_GT(shared(0, 0), 5.0 * least_squares(0, 0));
}

TEST(ParameterCovariance, StaysFiniteWithoutFrames) {
  CostEvaluation e;
  e.gauss_newton = 4.0 * MatrixX::Identity(3, 3);
  EXPECT_LT((noise_covariance(e) - 0.25 * MatrixX::Identity(3, 3)).norm(), tolerance(1e-14));
}

}  // namespace
}  // namespace pliant::optimiser_test
