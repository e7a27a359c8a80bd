// How many control points a field of moduli needs: the evidence, and the choice by it.
#include "estimation/field_choice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "base/dense.hpp"
#include "elasticity/element_moduli.hpp"
#include "estimation/bounded_step.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/fit_pass.hpp"
#include "estimation/fit_run.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "support/bodies.hpp"
#include "support/interruption.hpp"
#include "support/sagging_bar.hpp"
#include "support/tolerance.hpp"
#include "temporary_folder.hpp"

namespace pliant::field_choice_test {
namespace {

using test::tolerance;

constexpr double deviation = 1.5;

/// Covariance of ln E less that at the first point.
MatrixX ratio_covariance(const std::vector<Vector3>& points, double length) {
  const MatrixX precision = field_precision(points, length, deviation);
  const Eigen::Index n = precision.rows() - 1;
  return inverse(precision.bottomRightCorner(n, n));
}

TEST(FieldPrior, RatiosVaryWithDistanceWhateverOtherPointsThereAre) {
  const std::vector<Vector3> points = {{0, 0, 0}, {0.3, 0.1, 0}, {-0.2, 0.4, 0.1}, {0.1, 0.1, 0.5}};
  const MatrixX precision = field_precision(points, 2.0, deviation);
  EXPECT_LT((precision * VectorX::Ones(4)).norm(), tolerance(1e-12) * precision.norm()) << "a common factor is free";
  const MatrixX covariance = ratio_covariance(points, 2.0);
  const MatrixX fewer = ratio_covariance({points[0], points[1], points[2]}, 2.0);
  EXPECT_LT((covariance.topLeftCorner(2, 2) - fewer).norm(), tolerance(1e-12) * fewer.norm());
  const double between = covariance(0, 0) + covariance(1, 1) - 2.0 * covariance(0, 1);
  EXPECT_NEAR(between, deviation * deviation * (points[1] - points[2]).norm() / 2.0, tolerance(1e-12));
}

TEST(FieldPrior, AlongALineNeighboursAloneAreTied) {
  std::vector<Vector3> points;
  for (const double x : {0.0, 0.1, 0.4, 0.6}) points.emplace_back(x, 0.2, 0.0);
  const MatrixX precision = field_precision(points, 0.6, deviation);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j)
      if (std::abs(i - j) > 1) {
        EXPECT_NEAR(precision(i, j), 0.0, tolerance(1e-10) * precision.norm());
      }
  EXPECT_NEAR(precision(0, 1), -0.6 / (deviation * deviation * 0.1), tolerance(1e-9));
}

/// Observations that are linear in ln E at two points, with unit noise: all of the evidence is Gaussian.
struct LinearModel {
  LinearModel() : parameters(both()) {
    parameters.set_joint_prior({"youngs_modulus@1", "youngs_modulus@2"},
                               field_precision({{0, 0, 0}, {1, 0, 0}}, 1.0, deviation));
    design.resize(3, 2);
    design << 2.0, 0.3, 0.5, 1.5, 1.0, 1.0;
    seen.resize(3);
    seen << 1.9, 0.2, 1.4;
  }
  static ParameterSet both() {
    const MotionLayout layout({.moduli = 2});
    std::vector<Parameter> list;
    for (const ParameterHandle& modulus : layout.youngs_moduli) {
      list.push_back({"youngs_modulus@" + std::to_string(list.size() + 1), "Pa", Transform::Logarithm, modulus});
      list.back().estimated = true;
    }
    return {layout.layout(), list, VectorX::Ones(layout.size())};
  }
  double cost(const VectorX& p) const { return 0.5 * (design * p - seen).squaredNorm(); }
  /// In one frame, of so many observations that the residuals are noise.
  CostEvaluation at(const VectorX& p) const {
    CostEvaluation e;
    VectorX gradient;
    MatrixX curvature;
    e.cost = parameters.prior(p, &gradient, &curvature) + cost(p);
    e.gradient = gradient + design.transpose() * (design * p - seen);
    e.gauss_newton = curvature + design.transpose() * design;
    FrameFit frame;
    frame.gradient = e.gradient - gradient;
    frame.independent = 1e6;
    e.frames = {frame};
    return e;
  }
  double log_factor(const CostEvaluation& e, const VectorX& p) const {
    return log_bayes_factor(e, parameters, p, MatrixX::Ones(2, 1));
  }
  ParameterSet parameters;
  MatrixX design;
  VectorX seen;
};

/// Against integrals over the parameters by the midpoint rule, the prior of the ratio being normal and that of the
/// first modulus flat in both models.
TEST(Evidence, IsTheIntegralOfLikelihoodTimesPrior) {
  const LinearModel model;
  constexpr double h = 0.02, range = 12.0;
  double homogeneous = 0.0, field = 0.0;
  for (double a = -range + 0.5 * h; a < range; a += h) {
    homogeneous += h * std::exp(-model.cost(Eigen::Vector2d(a, a)));
    for (double b = -range + 0.5 * h; b < range; b += h)
      field += h * h * std::exp(-model.cost(Eigen::Vector2d(a, b)) - 0.5 * std::pow((b - a) / deviation, 2)) /
               (deviation * std::sqrt(2.0 * M_PI));
  }
  // Far from the maximum: the Gauss-Newton step that leads there is exact for a linear model.
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(-2.0, 1.0), Eigen::Vector2d(0.9, 0.9)})
    EXPECT_NEAR(model.log_factor(model.at(p), p), std::log(field / homogeneous), tolerance(1e-3));
}

TEST(Evidence, ResidualsLargerThanTheNoiseCountLess) {
  LinearModel model;
  const VectorX p = model.design.colPivHouseholderQr().solve(model.seen);
  CostEvaluation e = model.at(p);
  e.cost = 2.0 * e.frames[0].independent;  // four times that of noise
  const double large = model.log_factor(e, p);
  model.design /= 2.0, model.seen /= 2.0;
  EXPECT_NEAR(large, model.log_factor(model.at(p), p), tolerance(1e-3));
}

/// What other models say counts as noise does, but for what they change of all moduli in common.
TEST(Evidence, CountsTheWholeUncertainty) {
  LinearModel model;
  const VectorX p = model.design.colPivHouseholderQr().solve(model.seen);
  Uncertainty u;
  const auto evidence = [&] {
    u.std = u.covariance.diagonal().cwiseSqrt();
    return log_bayes_factor(u, model.parameters, p, MatrixX::Ones(2, 1));
  };
  u.covariance = inverse(MatrixX(model.design.transpose() * model.design));
  u.high = normal_90 * u.covariance.diagonal().cwiseSqrt();
  const double of_noise = evidence();
  EXPECT_NEAR(of_noise, model.log_factor(model.at(p), p), tolerance(1e-3));
  u.high *= 2.0;
  const double of_wide_intervals = evidence();
  u.high *= 0.5;
  const MatrixX noise = u.covariance;
  const auto with_shift = [&](const Eigen::Vector2d& shift) {
    u.covariance = noise + shift * shift.transpose();
    u.high = normal_90 * u.covariance.diagonal().cwiseSqrt();
    return evidence();
  };
  EXPECT_NEAR(with_shift({0.7, 0.7}), of_noise, tolerance(1e-9));
  EXPECT_LT(std::abs(with_shift({3.0, -3.0})), 0.5 * std::abs(of_noise)) << "what is left open speaks for neither";
  model.design /= 2.0, model.seen /= 2.0;
  EXPECT_NEAR(of_wide_intervals, model.log_factor(model.at(p), p), tolerance(1e-3));
}

/// A damping of zero beside the moduli.
struct WithDamping {
  /// @param slope     of the cost over the damping
  /// @param coupling  of the damping and the moduli
  CostEvaluation evaluation(double slope, const Eigen::Vector3d& coupling) const {
    CostEvaluation e = model.at(p.head(2));
    e.gauss_newton.conservativeResizeLike(MatrixX::Zero(3, 3));
    e.gauss_newton.row(2) = coupling, e.gauss_newton.col(2) = coupling;
    for (VectorX* gradient : {&e.gradient, &e.frames[0].gradient}) {
      gradient->conservativeResize(3);
      (*gradient)[2] = slope;
    }
    return e;
  }
  ParameterSet parameters() const {
    const MotionLayout layout({.moduli = 2});
    std::vector<Parameter> list = model.parameters.parameters();
    list.push_back({"mass_damping", "1/s", Transform::Shift, layout.mass_damping, 0.3, 0.0, 1e2, true});
    ParameterSet set(layout.layout(), list, VectorX::Ones(layout.size()));
    set.set_joint_prior({"youngs_modulus@1", "youngs_modulus@2"}, model.parameters.joint_precision());
    return set;
  }
  double log_factor(double slope, const Eigen::Vector3d& coupling) const {
    return log_bayes_factor(evaluation(slope, coupling), parameters(), p, MatrixX::Ones(2, 1));
  }
  LinearModel model;
  VectorX p = Eigen::Vector3d(-0.5, 1.0, 0.0);
};

/// Less of it would make up for what the moduli lack.
TEST(Evidence, WhatABoundHoldsMakesUpForNothing) {
  const WithDamping with;
  const Eigen::Vector3d coupling(-1.0, 1.5, 4.0);
  const double alone = with.model.log_factor(with.model.at(with.p.head(2)), with.p.head(2));
  EXPECT_NEAR(with.log_factor(20.0, coupling), alone, tolerance(1e-9));
  EXPECT_GT(std::abs(with.log_factor(-2.0, coupling) - alone), 0.05) << "nothing holds it where it grows";
}

/// By itself it would shrink beyond its bound; with the moduli that the field is free to have it grows.
TEST(Evidence, WhatLiesOnABoundMayLeaveItWithTheField) {
  const WithDamping with;
  const Eigen::Vector3d coupling(-1.0, 1.5, 4.0);
  constexpr double slope = 0.5;
  const CostEvaluation e = with.evaluation(slope, coupling);
  const BoundedStep bounded = step_within_bounds(with.parameters(), with.p, e.gradient, e.gauss_newton);
  EXPECT_TRUE(bounded.held.empty());
  EXPECT_GT(bounded.step[2], 0.1);
  const VectorX inner = -solve_symmetric(e.gauss_newton, e.gradient);
  EXPECT_LT((bounded.step - inner).norm(), tolerance(1e-12) * inner.norm());
  const double alone = with.model.log_factor(with.model.at(with.p.head(2)), with.p.head(2));
  EXPECT_GT(std::abs(with.log_factor(slope, coupling) - alone), 0.05);
}

/// Against the least of all points on a grid.
TEST(BoundedStep, IsTheLeastWithinTheBounds) {
  const WithDamping with;
  const ParameterSet parameters = with.parameters();
  for (const double slope : {-3.0, 0.5, 6.0, 20.0}) {
    const CostEvaluation e = with.evaluation(slope, {-1.0, 1.5, 4.0});
    const auto model = [&](const VectorX& s) { return e.gradient.dot(s) + 0.5 * s.dot(e.gauss_newton * s); };
    const BoundedStep bounded = step_within_bounds(parameters, with.p, e.gradient, e.gauss_newton);
    EXPECT_EQ(parameters.clamp(with.p + bounded.step), with.p + bounded.step);
    const double least = model(bounded.step);
    constexpr double h = 0.05;
    for (double a = -3.0; a <= 3.0; a += h)
      for (double b = -3.0; b <= 3.0; b += h)
        for (double c = 0.0; c <= 3.0; c += h) ASSERT_GE(model(Eigen::Vector3d(a, b, c)), least - 1e-12) << slope;
  }
}

/// Two hundred frames share the curvature; their gradients scatter as it says, but in runs of ten that err together.
TEST(Evidence, FramesThatErrTogetherCountLess) {
  const LinearModel model;
  const VectorX p = Eigen::Vector2d(0.9, -0.9);
  const MatrixX root = (model.design.transpose() * model.design).llt().matrixL();
  const auto factor = [&](int together) {
    constexpr int frames = 200;
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    CostEvaluation e = model.at(p);
    model.parameters.prior(p, &e.gradient);  // at the maximum of the likelihood
    e.frames.clear();
    VectorX gradient;
    for (int f = 0; f < frames; ++f) {
      if (f % together == 0) gradient = root * Eigen::Vector2d(normal(random), normal(random)) / std::sqrt(frames);
      FrameFit frame;
      frame.gradient = gradient;
      frame.independent = 1e6;
      e.frames.push_back(frame);
    }
    return model.log_factor(e, p);
  };
  CostEvaluation claimed = model.at(p);
  model.parameters.prior(p, &claimed.gradient);
  const double without = model.log_factor(claimed, p), apart = factor(1), together = factor(10);
  EXPECT_LT(apart, without) << "curvature and scatter add up";
  EXPECT_LT(together, 0.5 * apart);
}

TEST(CarriedOver, AFieldThatTheOtherCanHoldIsUnchanged) {
  const auto body = test::box_body({0.4, 0.08, 0.08}, 0.02);
  const Vector3 axis = Vector3::UnitX();
  const auto field = [&](int count) { return linear_field(*body, axis, count).field; };
  const VectorX logs = Eigen::Vector3d(8.0, 9.0, 8.5);
  const MatrixX finer = carried_over(*body, field(3), field(5));
  EXPECT_LT((field(5).weights * (finer * logs) - field(3).weights * logs).norm(), tolerance(1e-9));
  EXPECT_LT((carried_over(*body, field(1), field(4)) - MatrixX::Ones(4, 1)).norm(), tolerance(1e-9));
  const MatrixX coarser = carried_over(*body, field(3), field(1));
  EXPECT_NEAR((coarser * logs)[0], 0.25 * 8.0 + 0.5 * 9.0 + 0.25 * 8.5, tolerance(1e-6)) << "the mean over the volume";
}

constexpr double stiff = test::stiffness_of_bar, soft = 4e4;
using test::sagging_bar;

FitOptions quick() {
  FitOptions options;
  options.budget = 0.0;
  options.cells = options.coarse_cells = 8.0;
  options.control_points = FitOptions::automatic;
  options.parameters["poissons_ratio"].estimated = false;
  options.starts = 1;
  return options;
}

double modulus(const RecordingOutcome& recording, int k) {
  return recording.theta[recording.discretisation.simulation.blocks.youngs_moduli[std::size_t(k)]];
}
double modulus(const FitOutcome& outcome, int k) { return modulus(outcome.recordings.front(), k); }
int controls(const FitOutcome& outcome) { return outcome.recordings.front().discretisation.body->modulus.controls; }

/// exp of the mean of ln E over the elements on one side of the middle.
double mean_beyond(const FitOutcome& outcome, double side) {
  const RecordingOutcome& r = outcome.recordings.front();
  const ModulusStatistics statistics =
      modulus_statistics(r.discretisation.body, r.discretisation.simulation.blocks, r.theta, MatrixX());
  double sum = 0.0, volume = 0.0;
  for (int e = 0; e < r.discretisation.body->element_count(); ++e) {
    if (side * element_centre(*r.discretisation.body, e).x() < 0.0) continue;
    const double v = r.discretisation.body->element_volume[std::size_t(e)];
    sum += v * std::log(statistics.value[e]), volume += v;
  }
  return std::exp(sum / volume);
}

TEST(FieldChoice, AHomogeneousBarNeedsOneControlPoint) {
  const FitOutcome outcome = fit({sagging_bar(stiff)}, quick());
  ASSERT_TRUE(outcome.converged) << outcome.reason;
  EXPECT_EQ(controls(outcome), 1);
  ASSERT_EQ(outcome.fields.size(), 3u) << "two numbers that are not worth it end the search";
  for (std::size_t i = 1; i < 3; ++i) EXPECT_LT(outcome.fields[i].log_bayes_factor, judgement.strong_evidence);
  EXPECT_THAT(outcome.notes.front(), ::testing::HasSubstr("was given 1 control point,"));
  EXPECT_NEAR(modulus(outcome, 0) / stiff, 1.0, 0.05);
}

TEST(FieldChoice, ABarOfTwoZonesNeedsMore) {
  const FitOutcome outcome = fit({sagging_bar(soft)}, quick());
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  const int count = controls(outcome);
  ASSERT_GT(count, 1);
  EXPECT_GT(outcome.fields[1].log_bayes_factor, judgement.strong_evidence);
  EXPECT_LT(outcome.final_cost, 0.5 * outcome.fields[0].cost);
  // Moduli that vary evenly in the logarithm cannot step, and nothing bends at the free end: zones in the mean.
  EXPECT_NEAR(std::log(mean_beyond(outcome, -1.0) / stiff), 0.0, std::log(1.6));
  EXPECT_NEAR(std::log(mean_beyond(outcome, 1.0) / soft), 0.0, std::log(1.6));
  EXPECT_GT(modulus(outcome, 0), 2.0 * modulus(outcome, count - 1));
  for (const FitEvent& event : outcome.history) EXPECT_EQ(event.theta.size(), outcome.theta.size()) << event.stage;
  // The same field for one who asks for that many: the path there is another, the valley the same.
  FitOptions told = quick();
  told.control_points = count;
  const FitOutcome same = fit({sagging_bar(soft)}, told);
  for (int k = 0; k < count; ++k)
    EXPECT_NEAR(std::log(modulus(outcome, k) / modulus(same, k)), 0.0, 3e-2) << "within the optimiser's tolerance";
}

/// Of an object that is held and swings, seen by its surface, without being asked to; not of followed points, nor where
/// a plane is met, nor where one modulus is named.
TEST(FieldChoice, IsTheDefaultWhereAHeldObjectSwings) {
  FitOptions options = quick();
  options.control_points = FitOptions::unsaid;
  const auto looks = [](RecordedCapture recording, const FitOptions& o) {
    return dynamic_cast<FieldChoice*>(planner_of_points({std::move(recording)}, o, {}).get()) != nullptr;
  };
  RecordedCapture bar = sagging_bar(soft);
  EXPECT_FALSE(looks(bar, options)) << "it hangs at rest";
  bar.capture.scene.timing.is_static = false;
  bar.capture.scene.timing.times = {0.0, 0.1};
  EXPECT_TRUE(looks(bar, options));
  bar.capture.scene.object.shape_is = ShapeIs::Static;
  EXPECT_TRUE(looks(bar, options)) << "whether it sags in its scan or not";
  FitOptions named = options;
  named.parameters["youngs_modulus"].start = VectorX::Constant(1, stiff);
  EXPECT_FALSE(looks(bar, named));
  FitOptions one = options;
  one.control_points = 1;
  EXPECT_FALSE(looks(bar, one));
  RecordedCapture other = bar;
  other.capture.scene.planes.emplace_back();
  EXPECT_FALSE(looks(other, options));
  other = bar;
  other.followed.emplace();
  EXPECT_FALSE(looks(other, options));
  other = bar;
  other.capture.scene.fixed.clear();
  EXPECT_FALSE(looks(other, options));
}

/// A second modulus must take a tenth off the cost; where there are two, further ones less.
TEST(FieldChoice, KeepsNoFieldThatTakesLittleOffTheCost) {
  const TriedField one{1, true, 1000.0, 0.0}, little{2, true, 950.0, 20.0}, much{2, true, 800.0, 20.0};
  const auto chosen = [](const std::vector<TriedField>& tried) { return explained(tried); };
  EXPECT_THAT(chosen({one, little}), ::testing::HasSubstr("was given 1 control point,"));
  EXPECT_THAT(chosen({one, much}), ::testing::HasSubstr("was given 2 control points,"));
  EXPECT_THAT(chosen({one, {2, true, 800.0, 2.0}}), ::testing::HasSubstr("was given 1 control point,"));
  EXPECT_THAT(chosen({one, much, {4, true, 760.0, 9.0}}), ::testing::HasSubstr("was given 4 control points,"));
  EXPECT_THAT(chosen({one, much, {4, true, 790.0, 9.0}}), ::testing::HasSubstr("was given 2 control points,"));
}

/// Beside one modulus a step must promise strong evidence and 3 % off the cost; beside a field any evidence and 0.9 %.
TEST(FieldChoice, FitsWhatOneStepPromises) {
  const TriedField one{1, true, 1000.0, 0.0}, two{2, true, 1000.0, 20.0};
  EXPECT_TRUE(is_worth_a_fit({2, false, 960.0, 4.0}, one));
  EXPECT_FALSE(is_worth_a_fit({2, false, 960.0, 2.9}, one));
  EXPECT_FALSE(is_worth_a_fit({2, false, 980.0, 4.0}, one));
  EXPECT_TRUE(is_worth_a_fit({3, false, 980.0, 0.1}, two));
  EXPECT_FALSE(is_worth_a_fit({3, false, 980.0, -0.1}, two));
  EXPECT_FALSE(is_worth_a_fit({3, false, 995.0, 4.0}, two));
}

/// A field that does not gain enough in the wide band has no estimate, but a cost: it was not impossible to simulate.
TEST(FieldChoice, AFitEndsInTheWideBandWhereItGainsTooLittle) {
  FitOptions options = quick();
  options.control_points = 1;
  options.cells = 12.0;  // finer than the starts: stages in the wide band come first
  const FitOutcome outcome = FitRun({sagging_bar(soft)}, options, {}, {}, {.wide_band_cost = 1e-9}).run();
  EXPECT_FALSE(outcome.evaluation.succeeded);
  EXPECT_FALSE(outcome.converged);
  EXPECT_TRUE(std::isfinite(outcome.final_cost));
  EXPECT_THAT(outcome.reason, ::testing::HasSubstr("too little"));
}

TEST(FieldChoice, KeepsNoFieldThatOtherModelsLeaveOpen) {
  FieldChoice choice({sagging_bar(soft)}, quick(), {});
  std::vector<int> last;  // control points of passes that are judged by other models
  while (std::optional<Pass> pass = choice.next()) {
    PassState reached = pass->begin;
    FitMonitor monitor;
    monitor.on_state = [&](const FitState& state) { reached = state.pass; };
    FitOutcome outcome = FitRun(pass->recordings, pass->options, monitor, pass->begin, pass->limits).run();
    EXPECT_EQ(pass->limits.looks_at_scan_errors, pass->options.control_points == 1);
    if (pass->options.alternatives) last.push_back(pass->options.control_points), outcome.uncertainty.high *= 50.0;
    (void)choice.take(std::move(outcome), std::move(reached));
  }
  EXPECT_THAT(last, ::testing::ElementsAre(::testing::Gt(1), 1));
  const FitOutcome outcome = choice.outcome();
  EXPECT_EQ(controls(outcome), 1);
  EXPECT_EQ(outcome.final_cost, outcome.fields.front().cost);
  EXPECT_THAT(outcome.notes.front(), ::testing::HasSubstr("was given 1 control point,"));
  EXPECT_THAT(outcome.notes.front(), ::testing::HasSubstr("what other models and parts of the motion leave open"));
}

TEST(FieldChoice, RecordingsOfOneObjectShareTheField) {
  const Vector3 aside(0.0, 0.0, -9.81);
  const FitOutcome outcome = fit({sagging_bar(soft), sagging_bar(soft, aside, 8)}, quick());
  ASSERT_EQ(outcome.recordings.size(), 2u);
  const int count = controls(outcome);
  ASSERT_GT(count, 1);
  for (int k = 0; k < count; ++k) EXPECT_EQ(modulus(outcome, k), modulus(outcome.recordings[1], k));
}

/// Interrupted in every kind of fit on the way, written to a file and read back.
TEST(FieldChoice, AnInterruptedChoiceGoesOnToTheSameEnd) {
  const FitOutcome undisturbed = fit({sagging_bar(soft)}, quick());
  for (const char* stage : {"fine", "2 control points"}) {
    test::Interruption interruption(stage);
    const FitOutcome interrupted = fit({sagging_bar(soft)}, quick(), interruption.monitor());
    EXPECT_TRUE(interrupted.interrupted) << stage;
    const FitOutcome resumed = fit({sagging_bar(soft)}, quick(), {}, interruption.left());
    EXPECT_EQ(controls(resumed), controls(undisturbed)) << stage;
    EXPECT_EQ(resumed.notes, undisturbed.notes) << stage;
    ASSERT_EQ(resumed.theta.size(), undisturbed.theta.size()) << stage;
    EXPECT_LT((resumed.theta - undisturbed.theta).cwiseAbs().maxCoeff(), 1e-6 * undisturbed.theta.maxCoeff()) << stage;
  }
}

TEST(FieldChoice, RegionsLeaveNothingToChoose) {
  RecordedCapture bar = sagging_bar(soft);
  bar.capture.scene.regions = {{"beyond", RegionHalfSpace{Vector3::Zero(), Vector3::UnitX()}}};
  const FitOutcome outcome = fit({bar}, quick());
  EXPECT_EQ(controls(outcome), 2);
  EXPECT_TRUE(outcome.fields.empty());
}

TEST(FieldChoice, ControlPointsOfTheCaptureAreTheField) {
  RecordedCapture bar = sagging_bar(soft);
  const Box box = bounding_box(*bar.capture.scene.object.surface);
  const Vector3 middle = 0.5 * (box.min + box.max);
  bar.capture.scene.controls = {{"root", {box.min.x(), middle.y(), middle.z()}},
                                {"tip", {box.max.x(), middle.y(), middle.z()}}};
  const FitOutcome outcome = fit({bar}, quick());
  EXPECT_EQ(controls(outcome), 2);
  EXPECT_TRUE(outcome.fields.empty());
  ASSERT_EQ(outcome.recordings.front().discretisation.control_points.size(), 2u);
  const ParameterLayout& layout = outcome.parameters.layout();
  const double root = outcome.theta[layout.at("youngs_modulus@root")],
               tip = outcome.theta[layout.at("youngs_modulus@tip")];
  EXPECT_GT(root / tip, 1.5) << "the far half of the bar is softer";
}

TEST(FieldChoice, IsAKeyOfAFit) {
  FitOptions options;
  set_fit_option(options, "control_points=auto");
  EXPECT_EQ(options.control_points, FitOptions::automatic);
  EXPECT_EQ(options.validate(), "");
  EXPECT_THAT(to_toml(options), ::testing::HasSubstr("control_points = \"auto\""));
  const test::TemporaryFolder folder;
  FitOptions read;
  read_fit_options(folder.write("fit.toml", to_toml(options)), read);
  EXPECT_EQ(read.control_points, FitOptions::automatic);
  for (const char* wrong : {"control_points=0", "control_points=many", "control_points=2.5"})
    EXPECT_THAT(test::complaint_of([&] { set_fit_option(options, wrong); }), ::testing::HasSubstr("or auto")) << wrong;
  set_fit_option(options, "youngs_modulus.estimate=false");
  EXPECT_THAT(options.validate(), ::testing::HasSubstr("control_points = auto"));
}

}  // namespace
}  // namespace pliant::field_choice_test
