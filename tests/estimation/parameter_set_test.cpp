#include "estimation/parameter_set.hpp"

#include "support/derivatives.hpp"
#include "support/recordings.hpp"
#include "support/tolerance.hpp"

namespace pliant {
namespace {

using test::tolerance;

ParameterSet all_estimated() {
  ParameterSet set = test::torus_parameters(test::torus_scene(0.05, 2).theta, 1);
  for (const Parameter& p : std::vector(set.parameters())) set.set_estimated(p.name, true);
  return set;
}

VectorX somewhere(const ParameterSet& set) {
  VectorX p = set.to_unconstrained(set.reference());
  for (Eigen::Index i = 0; i < p.size(); ++i) p[i] += 0.3 * std::sin(2.0 + 3.0 * double(i));
  return p;
}

TEST(ParameterSet, RoundTrips) {
  const ParameterSet set = all_estimated();
  ASSERT_EQ(set.dimension(), 17);
  const VectorX p = somewhere(set), theta = set.to_theta(p);
  EXPECT_LT((set.to_unconstrained(theta) - p).norm(), tolerance(1e-12));
  EXPECT_LT((set.to_theta(set.to_unconstrained(theta)) - theta).norm(), tolerance(1e-12) * theta.norm());
  EXPECT_LT((set.to_theta(set.to_unconstrained(set.reference())) - set.reference()).norm(),
            tolerance(1e-12) * theta.norm());
  EXPECT_NEAR(theta.segment<3>(theta::plane_normal(0)).norm(), 1.0, tolerance(1e-14));
}

TEST(ParameterSet, JacobianMatchesCentralDifferences) {
  const ParameterSet set = all_estimated();
  const VectorX p = somewhere(set);
  const MatrixX J = set.jacobian(p);
  ASSERT_EQ(J.rows(), theta::size(1));
  for (int i = 0; i < set.dimension(); ++i) {
    ASSERT_GT(J.col(i).norm(), 0.0);
    const auto along = [&](double h) -> VectorX { return set.to_theta(p + h * VectorX::Unit(p.size(), i)); };
    EXPECT_LT(test::best_relative_error(along, J.col(i), 1.0), tolerance(1e-8))
        << set.coordinate_names()[std::size_t(i)];
  }
}

TEST(ParameterSet, WhatIsNotEstimatedStays) {
  ParameterSet set = all_estimated();
  set.set_estimated("gravity", false);
  set.set_estimated("youngs_modulus", false);
  EXPECT_EQ(set.dimension(), 13);
  const VectorX theta = set.to_theta(VectorX::Constant(13, 0.1));
  EXPECT_EQ(theta[theta::youngs_modulus], set.reference()[theta::youngs_modulus]);
  EXPECT_EQ(theta.segment<3>(theta::gravity), set.reference().segment<3>(theta::gravity));
  EXPECT_NE(theta[theta::density], set.reference()[theta::density]);
  EXPECT_EQ(set.jacobian(VectorX::Zero(13)).row(theta::gravity).norm(), 0.0);
}

TEST(ParameterSet, NamesEveryCoordinateAndRefusesUnknownOnes) {
  ParameterSet set = all_estimated();
  const auto names = set.coordinate_names();
  ASSERT_EQ(int(names.size()), set.dimension());
  EXPECT_EQ(names.front(), "youngs_modulus");
  EXPECT_EQ(names[5], "gravity.x");
  EXPECT_EQ(names.back(), "plane.tilt_2");
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
  EXPECT_THROW(set.set_estimated("stiffness", true), std::invalid_argument);
  EXPECT_EQ(set.find("stiffness"), nullptr);
  EXPECT_EQ(set.find("density")->theta_index, theta::density);
}

TEST(ParameterSet, ClampsScalarsIntoTheirBounds) {
  const ParameterSet set = all_estimated();
  const VectorX high = set.to_theta(set.clamp(VectorX::Constant(17, 100.0)));
  const VectorX low = set.to_theta(set.clamp(VectorX::Constant(17, -100.0)));
  EXPECT_NEAR(high[theta::youngs_modulus], 1e7, tolerance(1.0));
  EXPECT_NEAR(low[theta::youngs_modulus], 1.0, tolerance(1e-9));
  EXPECT_NEAR(high[theta::poissons_ratio], 0.495, tolerance(1e-9));
  EXPECT_NEAR(low[theta::poissons_ratio], 0.02, tolerance(1e-9));
  const VectorX inside = somewhere(set);
  EXPECT_EQ(set.clamp(inside), inside);
}

TEST(ParameterSet, PriorsAreNormal) {
  std::vector<Parameter> list = all_estimated().parameters();
  list[0].prior_std = 0.5;
  list[0].prior_mean = VectorX::Constant(1, 8.0);
  list[5].prior_std = 2.0;
  VectorX mean(3);
  mean << 0.1, -4.0, 0.2;
  list[5].prior_mean = mean;
  const ParameterSet set(list, all_estimated().reference());
  const VectorX p = somewhere(set);
  VectorX gradient;
  MatrixX curvature;
  const double value = set.prior(p, &gradient, &curvature);
  const double expected = 0.5 * std::pow((p[0] - 8.0) / 0.5, 2) + 0.5 * (p.segment(5, 3) - mean).squaredNorm() / 4.0;
  EXPECT_NEAR(value, expected, tolerance(1e-12) * expected);
  for (int i = 0; i < 17; ++i) {
    const VectorX e = VectorX::Unit(17, i);
    EXPECT_NEAR(gradient[i], (set.prior(p + 1e-3 * e) - set.prior(p - 1e-3 * e)) / 2e-3, tolerance(1e-8));
    EXPECT_EQ((curvature * e - (i == 0 ? 4.0 : i >= 5 && i < 8 ? 0.25 : 0.0) * e).norm(), 0.0);
  }
}

/// Three moduli tied to one another, the second of them not estimated, the first one with a prior of its own.
TEST(ParameterSet, AJointPriorTiesLogarithmsTogether) {
  std::vector<Parameter> list;
  for (int k = 0; k < 3; ++k)
    list.push_back({"youngs_modulus@" + std::to_string(k + 1), "Pa", Transform::Logarithm, theta::modulus(k, 3, 16)});
  list[0].estimated = list[2].estimated = true;
  list[0].prior_std = 0.5;
  list[0].prior_mean = VectorX::Constant(1, 8.0);
  VectorX reference = VectorX::Constant(16, 2000.0);
  ParameterSet set(list, reference);
  MatrixX precision(3, 3);  // of differences, along a chain
  precision << 4, -4, 0, -4, 5, -1, 0, -1, 1;
  set.set_joint_prior({"youngs_modulus@1", "youngs_modulus@2", "youngs_modulus@3"}, precision);
  VectorX p(2);
  p << 8.3, 7.1;
  const double fixed = std::log(2000.0);
  const double expected =
      0.5 * std::pow(0.3 / 0.5, 2) + 0.5 * (4.0 * std::pow(8.3 - fixed, 2) + std::pow(7.1 - fixed, 2));
  VectorX gradient;
  MatrixX curvature;
  EXPECT_NEAR(set.prior(p, &gradient, &curvature), expected, tolerance(1e-12) * expected);
  for (int i = 0; i < 2; ++i) {
    const VectorX e = VectorX::Unit(2, i);
    EXPECT_NEAR(gradient[i], (set.prior(p + 1e-3 * e) - set.prior(p - 1e-3 * e)) / 2e-3, tolerance(1e-8));
  }
  EXPECT_TRUE(curvature.isApprox((MatrixX(2, 2) << 8.0, 0.0, 0.0, 1.0).finished(), 1e-14));
  set.set_estimated("youngs_modulus@2", true);
  VectorX all(3);
  all << 8.0, 7.0, 6.5;
  const double before = set.prior(all), one = 0.5 * std::pow(0.7 / 0.5, 2);
  EXPECT_NEAR(set.prior(all + VectorX::Constant(3, 0.7)) - before, one, 1e-12) << "a common factor is free";
  set.prior(all, nullptr, &curvature);
  EXPECT_EQ(curvature(1, 2), -1.0);
  EXPECT_THROW(set.set_joint_prior({"mass_damping"}, MatrixX::Identity(1, 1)), std::invalid_argument);
}

TEST(ParameterSet, DirectionsKeepTheirLengthAndTheirOrigin) {
  Parameter direction{"gravity", "m/s^2", Transform::Direction, theta::gravity};
  direction.estimated = true;
  VectorX reference = VectorX::Zero(theta::size(0));
  reference.segment<3>(theta::gravity) = Vector3(0.5, -9.7, 0.3);
  direction.origin = reference.segment(theta::gravity, 3);
  ParameterSet set({direction}, reference);
  ASSERT_EQ(set.dimension(), 2);
  EXPECT_LT(set.to_unconstrained(reference).norm(), tolerance(1e-15));
  VectorX p(2);
  p << 0.1, -0.2;
  const VectorX theta = set.to_theta(p);
  EXPECT_NEAR(theta.segment<3>(theta::gravity).norm(), direction.origin.norm(), tolerance(1e-13));
  EXPECT_LT((set.to_unconstrained(theta) - p).norm(), tolerance(1e-13));
  const Vector3 turned = theta.segment<3>(theta::gravity), before = direction.origin;
  EXPECT_NEAR(std::acos(turned.dot(before) / before.squaredNorm()), std::atan(p.norm()), tolerance(1e-12));
  const MatrixX J = set.jacobian(p);
  for (int i = 0; i < 2; ++i) {
    const auto along = [&](double h) -> VectorX { return set.to_theta(p + h * VectorX::Unit(2, i)); };
    EXPECT_LT(test::best_relative_error(along, J.col(i), 1.0), tolerance(1e-8));
  }
  set.set_reference(theta);  // a later stage starts elsewhere: the prior stays where it was
  EXPECT_LT((set.to_unconstrained(theta) - p).norm(), tolerance(1e-13));
}

TEST(ParameterSet, AScalarMayStandInSeveralPlaces) {
  Parameter modulus{"youngs_modulus", "Pa", Transform::Logarithm, 0};
  modulus.also = {2, 3};
  Parameter shift{"range_error", "m", Transform::Shift, 1, 0.1};
  modulus.estimated = shift.estimated = true;
  const ParameterSet set({modulus, shift}, VectorX::Constant(4, 2.0));
  VectorX p(2);
  p << 1.0, -0.5;
  const VectorX theta = set.to_theta(p);
  EXPECT_EQ(theta, (VectorX(4) << std::exp(1.0), -0.05, std::exp(1.0), std::exp(1.0)).finished());
  EXPECT_LT((set.to_unconstrained(theta) - p).norm(), tolerance(1e-15));
  const MatrixX J = set.jacobian(p);
  EXPECT_EQ(J.col(0), (VectorX(4) << std::exp(1.0), 0.0, std::exp(1.0), std::exp(1.0)).finished());
  EXPECT_EQ(J.col(1), (VectorX(4) << 0.0, 0.1, 0.0, 0.0).finished());
}

}  // namespace
}  // namespace pliant
