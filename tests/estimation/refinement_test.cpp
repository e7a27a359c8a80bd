// What discretisation leaves of an error, on sequences whose limit is known.
#include "estimation/refinement.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace pliant::refinement_test {
namespace {

/// Values of limit + c h^order at spacings h that shrink by the ratio.
std::vector<double> sequence(double limit, double c, double order, double ratio, int count) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(limit + c * std::pow(ratio, -order * i));
  return values;
}

TEST(Refinement, TwoValuesOfTheAssumedOrderGiveTheLimit) {
  const auto values = sequence(3.0, 0.2, 2.0, 1.5, 2);
  const Limit limit = limit_of(values, 1.5, 2.0);
  EXPECT_NEAR(limit.value, 3.0, 1e-12);
  EXPECT_NEAR(limit.error, 3.0 * std::abs(values.back() - 3.0), 1e-12);
}

TEST(Refinement, ThreeValuesShowTheirOwnOrder) {
  for (const double order : {0.7, 1.0, 1.6}) {
    const auto values = sequence(-1.0, -0.4, order, 2.0, 3);
    const Limit limit = limit_of(values, 2.0, 2.0);
    EXPECT_NEAR(limit.value, -1.0, 1e-12) << order;
    EXPECT_NEAR(limit.error, 1.25 * std::abs(values.back() + 1.0), 1e-12) << order;
  }
}

/// Believing an order of five of elements of second order would understate what is left.
TEST(Refinement, MoreThanTheOrderOfTheElementsIsNotBelieved) {
  const auto values = sequence(1.0, 1.0, 5.0, 1.5, 3);
  const double rest = std::abs(values[2] - values[1]) / (1.5 * 1.5 - 1.0);
  EXPECT_NEAR(limit_of(values, 1.5, 2.0).error, 1.25 * rest, 1e-12);
}

TEST(Refinement, ValuesThatSwingOrGrowApartAreNotExtrapolated) {
  for (const auto& values : {std::vector{1.0, 1.2, 1.1}, std::vector{1.0, 1.1, 1.3}}) {
    const Limit limit = limit_of(values, 1.5, 2.0);
    EXPECT_EQ(limit.value, values.back());
    EXPECT_NEAR(limit.error, 1.25 * 0.2, 1e-12);
  }
  EXPECT_EQ(limit_of(std::vector{1.0, 2.0, 2.0}, 1.5, 2.0).error, 0.0);
  EXPECT_THROW((void)limit_of(std::vector{1.0}, 1.5, 2.0), std::invalid_argument);
  EXPECT_THROW((void)limit_of(std::vector{1.0, 2.0}, 1.0, 2.0), std::invalid_argument);
}

TEST(Refinement, StepsComeBeforeMeshesAndStaticsHasNone) {
  const auto all = refined_spacings({12.0, 1.0}, 3, true, true);
  ASSERT_EQ(all.size(), 4u);
  EXPECT_EQ(all[0].steps, 2.0);
  EXPECT_EQ(all[1].steps, 4.0);
  EXPECT_EQ(all[2].cells, 18.0);
  EXPECT_EQ(all[3].cells, 27.0);
  EXPECT_EQ(all[3].steps, 1.0);
  EXPECT_EQ(all[1].cells, 12.0);
  EXPECT_EQ(refined_spacings({12.0, 1.0}, 2, true, false).size(), 1u);
  EXPECT_TRUE(refined_spacings({12.0, 1.0}, 1, true, true).empty());
}

/// ln E = ln 1000 + 0.3 (12 / cells)^2 + 0.05 / steps^2: both errors vanish together.
TEST(Refinement, MeshAndStepAreTakenToTheirLimitsTogether) {
  const auto estimate = [](Spacing s) {
    const double p = std::log(1000.0) + 0.3 * std::pow(12.0 / s.cells, 2) + 0.05 / (s.steps * s.steps);
    return RefinedEstimate{s.cells, s.steps, 0, VectorX::Constant(1, std::exp(p)), 0.0, true, ""};
  };
  ParameterLayout layout;
  const ParameterHandle modulus = layout.add({"youngs_modulus", "Pa"});
  const ParameterSet parameters(layout, {{"youngs_modulus", "Pa", Transform::Logarithm, modulus, 1.0, 1.0, 1e9, true}},
                                VectorX::Constant(1, 1.0));
  std::vector<RefinedEstimate> estimates{estimate({12.0, 1.0})};
  for (const Spacing& s : refined_spacings({12.0, 1.0}, 2, true, true)) estimates.push_back(estimate(s));
  const Refinement r = extrapolate(estimates, parameters);
  EXPECT_EQ(r.estimates[std::size_t(r.finest)].cells, 18.0);
  EXPECT_NEAR(std::exp(r.extrapolated[0]), 1000.0, 1e-6);
  EXPECT_NEAR(r.mesh_error[0], 3.0 * 0.3 / 2.25, 1e-9);
  EXPECT_NEAR(r.step_error[0], 0.75 * 0.05 + 3.0 * 0.05 / 4.0, 1e-9);
  const Refinement alone = extrapolate({estimates.front()}, parameters);
  EXPECT_EQ(alone.finest, 0);
  EXPECT_EQ(alone.mesh_error.size(), 0);
  EXPECT_EQ(alone.step_error.size(), 0);
}

}  // namespace
}  // namespace pliant::refinement_test
