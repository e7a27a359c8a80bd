#include "estimation/gradient_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>

#include "estimation/objective.hpp"

namespace pliant::gradient_check_test {
namespace {

using Verdict = CheckedDerivative::Verdict;

/// Half the squares of three residuals of two parameters, with errors that are put in.
class SmallTrial : public Trial {
 public:
  struct Errors {
    double tangents = 0.0, adjoint = 0.0;  ///< relative, of the second parameter's derivative
    double noise = 0.0;                    ///< of the cost, as a nonlinear solve that is not converged leaves it
  };
  explicit SmallTrial(const Errors& errors) : errors_(errors) {}

  CostEvaluation run(const VectorX& theta, const MatrixX& directions) override {
    CostEvaluation result;
    const Vector3 r = residuals(theta);
    FrameFit fit;
    fit.cost = result.cost = 0.5 * r.squaredNorm() + errors_.noise * normal_(random_);
    if (directions.cols() > 0) {
      MatrixX J = jacobian(theta);
      J.col(1) *= 1.0 + errors_.tangents;
      J = J * directions;
      fit.gradient = J.transpose() * r;
      fit.gauss_newton = J.transpose() * J;
    }
    result.frames.push_back(std::move(fit));
    result.succeeded = true;
    return result;
  }

  CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override {
    theta_bar = jacobian(theta).transpose() * residuals(theta);
    theta_bar[1] *= 1.0 + errors_.adjoint;
    return run(theta, MatrixX(theta.size(), 0));
  }

 private:
  static Vector3 residuals(const VectorX& t) { return {std::exp(0.3 * t[0]) - 2.0, t[0] * t[1] - 1.0, std::sin(t[1])}; }
  static MatrixX jacobian(const VectorX& t) {
    MatrixX J(3, 2);
    J << 0.3 * std::exp(0.3 * t[0]), 0.0, t[1], t[0], 0.0, std::cos(t[1]);
    return J;
  }
  Errors errors_;
  std::mt19937 random_{3};
  std::normal_distribution<double> normal_;
};

GradientCheck check(const SmallTrial::Errors& errors) {
  ParameterLayout layout;
  std::vector<Parameter> list(2);
  list[0] = {.name = "first", .unit = "Pa", .at = layout.add({"first", "Pa", 1, Role::Material}), .estimated = true};
  list[1] = {.name = "second", .unit = "1", .at = layout.add({"second", "1", 1, Role::Damping}), .estimated = true};
  const ParameterSet set(layout, list, (VectorX(2) << 1.5, 0.7).finished());
  std::vector<std::unique_ptr<Trial>> trials;
  trials.push_back(std::make_unique<SmallTrial>(errors));
  Objective objective(std::move(trials), set);
  return check_gradient(objective, set.to_unconstrained(set.reference()));
}

TEST(GradientCheck, RightDerivativesAgree) {
  const GradientCheck right = check({});
  ASSERT_TRUE(right.succeeded) << right.failure;
  EXPECT_TRUE(right.agrees());
  ASSERT_EQ(right.derivatives.size(), 2u);
  for (const CheckedDerivative& d : right.derivatives) {
    EXPECT_EQ(d.verdict, Verdict::Agree) << d.name;
    EXPECT_GT(std::abs(d.by_tangents), 0.1) << d.name;
    EXPECT_NEAR(d.by_difference, d.by_tangents, 1e-7) << d.name;
    EXPECT_LT(d.uncertainty, 1e-6) << d.name;
  }
  EXPECT_EQ(right.derivatives[1].name, "second");
  EXPECT_NE(describe(right).find("agree as far as"), std::string::npos) << describe(right);
}

TEST(GradientCheck, ANumberAtItsBoundIsCheckedBesideIt) {
  ParameterLayout layout;
  std::vector<Parameter> list(2);
  list[0] = {.name = "first", .unit = "Pa", .at = layout.add({"first", "Pa", 1, Role::Material}), .estimated = true};
  list[1] = {.name = "second",
             .unit = "1",
             .transform = Transform::Shift,
             .at = layout.add({"second", "1", 1, Role::Obstacle})};
  list[1].estimated = true, list[1].lower = 0.7, list[1].upper = 5.0;
  const ParameterSet set(layout, list, (VectorX(2) << 1.5, 0.7).finished());
  std::vector<std::unique_ptr<Trial>> trials;
  trials.push_back(std::make_unique<SmallTrial>(SmallTrial::Errors{}));
  Objective objective(std::move(trials), set);
  const GradientCheck check = check_gradient(objective, set.to_unconstrained(set.reference()));
  ASSERT_TRUE(check.succeeded) << check.failure;
  EXPECT_EQ(check.derivatives[1].verdict, Verdict::Agree) << describe(check);
}

TEST(GradientCheck, AWrongDerivativeDisagrees) {
  for (const SmallTrial::Errors& errors : {SmallTrial::Errors{.tangents = 1e-3}, SmallTrial::Errors{.adjoint = 1e-3},
                                           SmallTrial::Errors{.tangents = 1e-3, .adjoint = 1e-3}}) {
    const GradientCheck wrong = check(errors);
    ASSERT_TRUE(wrong.succeeded);
    EXPECT_FALSE(wrong.agrees());
    EXPECT_EQ(wrong.derivatives[0].verdict, Verdict::Agree);
    EXPECT_EQ(wrong.derivatives[1].verdict, Verdict::Disagree);
    EXPECT_NE(describe(wrong).find("DISAGREE"), std::string::npos) << describe(wrong);
  }
}

TEST(GradientCheck, DifferencesAreTrustedOnlyAsFarAsTheyTell) {
  // A tenth of a per cent is hidden by a cost that is known to a thousandth only; a factor of two is not.
  const GradientCheck hidden = check({.tangents = 1e-3, .adjoint = 1e-3, .noise = 1e-3});
  EXPECT_TRUE(hidden.agrees()) << describe(hidden);
  EXPECT_GT(hidden.derivatives[1].uncertainty, 1e-4);
  const GradientCheck seen = check({.tangents = 1.0, .adjoint = 1.0, .noise = 1e-5});
  EXPECT_FALSE(seen.agrees()) << describe(seen);
  const GradientCheck lost = check({.noise = 10.0});
  EXPECT_TRUE(lost.agrees()) << describe(lost);
  EXPECT_EQ(lost.derivatives[1].verdict, Verdict::Undecided) << describe(lost);
}

TEST(GradientCheck, RefusesOptionsWithoutThreeSteps) {
  ParameterSet none;
  Objective objective(std::vector<std::unique_ptr<Trial>>{}, none);
  EXPECT_THROW((void)check_gradient(objective, VectorX(0), {.steps = 2}), std::invalid_argument);
  EXPECT_THROW((void)check_gradient(objective, VectorX(0), {.greatest_step = 0.0}), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::gradient_check_test
