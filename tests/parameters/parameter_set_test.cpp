#include "parameters/parameter_set.hpp"

#include <set>
#include <stdexcept>

#include "support/derivatives.hpp"
#include "support/parameters.hpp"
#include "support/tolerance.hpp"

namespace pliant::parameter_set_test {
namespace {

using test::tolerance;

const MotionLayout layout({.planes = 1});

ParameterSet all_estimated() {
  ParameterSet set = test::torus_parameters(layout, test::torus_values(layout));
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
  EXPECT_NEAR(layout.planes[0].normal.vector(theta).norm(), 1.0, tolerance(1e-14));
}

TEST(ParameterSet, JacobianMatchesCentralDifferences) {
  const ParameterSet set = all_estimated();
  const VectorX p = somewhere(set);
  const MatrixX J = set.jacobian(p);
  ASSERT_EQ(J.rows(), layout.size());
  for (int i = 0; i < set.dimension(); ++i) {
    ASSERT_GT(J.col(i).norm(), 0.0);
    const auto along = [&](double h) -> VectorX { return set.to_theta(p + h * VectorX::Unit(p.size(), i)); };
    EXPECT_LT(test::best_relative_error(along, J.col(i), 1.0), tolerance(1e-8))
        << set.coordinate_names()[std::size_t(i)];
  }
}

TEST(ParameterSet, AnInverseHyperbolicSineIsLinearNearZeroAndALogarithmFarBeyondItsScale) {
  const Parameter damping{"mass_damping", "1/s", Transform::InverseSinh, layout.mass_damping, 0.3, 0.0, 1e4, true};
  VectorX theta = VectorX::Zero(layout.size());
  const ParameterSet set(layout.layout(), {damping}, theta);
  const auto slope = [&](double value) {
    theta[layout.mass_damping] = value;
    return set.jacobian(set.to_unconstrained(theta))(layout.mass_damping.first, 0);
  };
  EXPECT_NEAR(slope(0.0), 0.3, tolerance(1e-12)) << "a logarithm's would be zero";
  EXPECT_NEAR(slope(0.003), 0.3, 1e-4);
  EXPECT_NEAR(slope(300.0), 300.0, 1e-3);
  EXPECT_EQ(set.to_theta(set.clamp(VectorX::Constant(1, -2.0)))[layout.mass_damping], 0.0);
  EXPECT_NEAR(set.to_theta(set.clamp(VectorX::Constant(1, 50.0)))[layout.mass_damping], 1e4, tolerance(1e-6));
}

TEST(ParameterSet, AStepOfWhatActsByItsInverseChangesTheInverseInProportion) {
  Parameter stiffness{"youngs_modulus", "Pa", Transform::Logarithm, layout.youngs_moduli[0], 1.0, 1.0, 1e9, true};
  stiffness.acts_by_inverse = true;
  const Parameter damping{
      "stiffness_damping", "s", Transform::Logarithm, layout.stiffness_damping, 1.0, 0.0, 1e4, true};
  const ParameterSet set(layout.layout(), {stiffness, damping}, VectorX::Ones(layout.size()));
  const Eigen::Vector2d p(7.0, -3.0);
  const auto to = [&](double step) -> VectorX { return set.moved(p, Eigen::Vector2d(step, step)); };
  for (const double step : {-5.0, -0.5, 0.2, 0.5}) {
    EXPECT_NEAR(std::exp(p[0] - to(step)[0]), 1.0 - step, tolerance(1e-12)) << "the inverse";
    EXPECT_EQ(to(step)[1], p[1] + step) << "any other";
  }
  for (const double step : {-0.7, 0.3, 0.5, 3.0}) {  // smooth where the curve passes into its tangent, too
    const double h = 1e-5, slope = (to(step + h)[0] - to(step - h)[0]) / (2.0 * h);
    EXPECT_NEAR(slope, 1.0 / (1.0 - std::min(step, 0.5)), 1e-4);
  }
  EXPECT_NEAR(to(1e-6)[0] - p[0], 1e-6, tolerance(1e-11)) << "to first order a step of p";
  EXPECT_NEAR(to(100.0)[0], std::log(1e9), tolerance(1e-12)) << "within the bounds";
}

TEST(ParameterSet, WhatIsNotEstimatedStays) {
  ParameterSet set = all_estimated();
  set.set_estimated("gravity", false);
  set.set_estimated("youngs_modulus", false);
  EXPECT_EQ(set.dimension(), 13);
  const VectorX theta = set.to_theta(VectorX::Constant(13, 0.1));
  EXPECT_EQ(layout.moduli(theta), layout.moduli(set.reference()));
  EXPECT_EQ(layout.gravity.vector(theta), layout.gravity.vector(set.reference()));
  EXPECT_NE(theta[layout.density], set.reference()[layout.density]);
  EXPECT_EQ(set.jacobian(VectorX::Zero(13)).row(layout.gravity).norm(), 0.0);
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
  EXPECT_EQ(set.find("density")->at, layout.density);
}

TEST(ParameterSet, ClampsScalarsIntoTheirBounds) {
  const ParameterSet set = all_estimated();
  const VectorX high = set.to_theta(set.clamp(VectorX::Constant(17, 100.0)));
  const VectorX low = set.to_theta(set.clamp(VectorX::Constant(17, -100.0)));
  EXPECT_NEAR(high[layout.youngs_moduli[0]], 1e7, tolerance(1.0));
  EXPECT_NEAR(low[layout.youngs_moduli[0]], 1.0, tolerance(1e-9));
  EXPECT_NEAR(high[layout.poissons_ratio], 0.495, tolerance(1e-9));
  EXPECT_NEAR(low[layout.poissons_ratio], 0.02, tolerance(1e-9));
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
  const ParameterSet set(layout.layout(), list, all_estimated().reference());
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

/// A direction that is known better than the length along it: narrow across, wide along.
TEST(ParameterSet, AVectorsPriorMayBeNarrowAcrossADirection) {
  VectorX theta = layout.zero();
  theta.segment<3>(layout.gravity) = Vector3(0.0, -9.0, 0.5);
  Parameter gravity{"gravity", "m/s^2", Transform::Vector, layout.gravity};
  gravity.estimated = true, gravity.prior_std = 10.0, gravity.prior_mean = Vector3(0.0, -9.81, 0.0);
  const Vector3 up = Vector3(0.1, 1.0, 0.0).normalized();
  const Matrix3 along = up * up.transpose();
  gravity.prior_shape = along + 0.05 * (Matrix3::Identity() - along);
  const ParameterSet set(layout.layout(), {gravity}, theta);
  const Vector3 mean(0.0, -9.81, 0.0), across = up.cross(Vector3::UnitZ()).normalized();
  EXPECT_NEAR(set.prior(mean + 10.0 * up), 0.5, 1e-12);
  EXPECT_NEAR(set.prior(mean + 0.5 * across), 0.5, 1e-12);
  const VectorX p = set.to_unconstrained(theta);
  VectorX gradient;
  MatrixX curvature;
  (void)set.prior(p, &gradient, &curvature);
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    const VectorX e = VectorX::Unit(p.size(), i);
    EXPECT_NEAR(gradient[i], (set.prior(p + 1e-3 * e) - set.prior(p - 1e-3 * e)) / 2e-3, tolerance(1e-8));
    VectorX above, below;
    (void)set.prior(p + 1e-3 * e, &above);
    (void)set.prior(p - 1e-3 * e, &below);
    EXPECT_LT((curvature.col(i) - (above - below) / 2e-3).norm(), tolerance(1e-7));
  }
}

/// Three moduli tied to one another, the second of them not estimated, the first one with a prior of its own.
TEST(ParameterSet, AJointPriorTiesLogarithmsTogether) {
  const MotionLayout of_three({.moduli = 3});
  std::vector<Parameter> list;
  for (const ParameterHandle& modulus : of_three.youngs_moduli)
    list.push_back({"youngs_modulus@" + std::to_string(list.size() + 1), "Pa", Transform::Logarithm, modulus});
  list[0].estimated = list[2].estimated = true;
  list[0].prior_std = 0.5;
  list[0].prior_mean = VectorX::Constant(1, 8.0);
  ParameterSet set(of_three.layout(), list, VectorX::Constant(of_three.size(), 2000.0));
  MatrixX precision(3, 3);  // of differences, along a chain
  precision << 4, -4, 0, -4, 5, -1, 0, -1, 1;
  set.set_joint_prior({"youngs_modulus@1", "youngs_modulus@2", "youngs_modulus@3"}, precision);
  EXPECT_EQ(set.joint_coordinates(), (std::vector<Eigen::Index>{0, 1})) << "of those that are estimated";
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
  set.set_joint_prior({"youngs_modulus@3", "youngs_modulus@1"}, MatrixX::Identity(2, 2));
  EXPECT_EQ(set.joint_coordinates(), (std::vector<Eigen::Index>{2, 0})) << "in the prior's order";
  EXPECT_THROW(set.set_joint_prior({"mass_damping"}, MatrixX::Identity(1, 1)), std::invalid_argument);
}

TEST(ParameterSet, DirectionsKeepTheirLengthAndTheirOrigin) {
  Parameter direction{"gravity", "m/s^2", Transform::Direction, layout.gravity};
  direction.estimated = true;
  VectorX reference = layout.zero();
  reference.segment<3>(layout.gravity) = Vector3(0.5, -9.7, 0.3);
  direction.origin = reference.segment(layout.gravity, 3);
  ParameterSet set(layout.layout(), {direction}, reference);
  ASSERT_EQ(set.dimension(), 2);
  EXPECT_LT(set.to_unconstrained(reference).norm(), tolerance(1e-15));
  VectorX p(2);
  p << 0.1, -0.2;
  const VectorX theta = set.to_theta(p);
  EXPECT_NEAR(layout.gravity.vector(theta).norm(), direction.origin.norm(), tolerance(1e-13));
  EXPECT_LT((set.to_unconstrained(theta) - p).norm(), tolerance(1e-13));
  const Vector3 turned = layout.gravity.vector(theta), before = direction.origin;
  EXPECT_NEAR(std::acos(turned.dot(before) / before.squaredNorm()), std::atan(p.norm()), tolerance(1e-12));
  const MatrixX J = set.jacobian(p);
  for (int i = 0; i < 2; ++i) {
    const auto along = [&](double h) -> VectorX { return set.to_theta(p + h * VectorX::Unit(2, i)); };
    EXPECT_LT(test::best_relative_error(along, J.col(i), 1.0), tolerance(1e-8));
  }
  set.set_reference(theta);  // a later stage starts elsewhere: the prior stays where it was
  EXPECT_LT((set.to_unconstrained(theta) - p).norm(), tolerance(1e-13));
}

TEST(ParameterSet, AStrengthIsTheLengthOfWhatADirectionTurns) {
  VectorX reference = layout.zero();
  reference.segment<3>(layout.gravity) = Vector3(0.5, -9.7, 0.3);
  Parameter direction{"gravity", "m/s^2", Transform::Direction, layout.gravity};
  direction.estimated = true;
  direction.origin = reference.segment(layout.gravity, 3);
  Parameter strength = direction;
  strength.name = "how strong", strength.transform = Transform::Strength;
  const ParameterSet set(layout.layout(), {direction, strength}, reference);
  EXPECT_EQ(set.coordinate_names().back(), "how strong.strength");
  const Vector3 p(0.1, -0.2, 0.3);
  const VectorX theta = set.to_theta(p);
  EXPECT_NEAR(layout.gravity.vector(theta).norm(), std::exp(0.3) * direction.origin.norm(), tolerance(1e-13));
  EXPECT_LT((set.to_unconstrained(theta) - p).norm(), tolerance(1e-13));
  const MatrixX J = set.jacobian(p);
  for (int i = 0; i < 3; ++i) {
    const auto along = [&](double h) -> VectorX { return set.to_theta(p + h * VectorX::Unit(3, i)); };
    EXPECT_LT(test::best_relative_error(along, J.col(i), 1.0), tolerance(1e-8)) << i;
  }
}

TEST(ParameterSet, AShiftIsALengthOfAnySign) {
  ParameterLayout own;
  own.add({"youngs_modulus", "Pa"});
  Parameter shift{"range_error", "m", Transform::Shift, own.add({"range_error", "m", 1, Role::Sensor}), 0.1};
  shift.estimated = true;
  const ParameterSet set(own, {shift}, VectorX::Constant(2, 2.0));
  const VectorX p = VectorX::Constant(1, -0.5), theta = set.to_theta(p);
  EXPECT_EQ(theta, Eigen::Vector2d(2.0, -0.05));
  EXPECT_LT((set.to_unconstrained(theta) - p).norm(), tolerance(1e-15));
  EXPECT_EQ(set.jacobian(p), Eigen::Vector2d(0.0, 0.1));
}

TEST(ParameterSet, RolesAreThoseOfTheBlocks) {
  const ParameterSet set = all_estimated();
  for (const Parameter& p : set.parameters()) EXPECT_EQ(p.role, layout.layout().block_of(p.at).role) << p.name;
  EXPECT_EQ(set.find("mass_damping")->role, Role::Damping);
  EXPECT_EQ(set.find("gravity")->role, Role::Load);
  EXPECT_EQ(set.find("plane")->role, Role::Obstacle);
}

TEST(ParameterSet, WhatIsOfTheObjectIsToldByRoleAndUnit) {
  const std::set<std::string> of_object = {"youngs_modulus", "poissons_ratio", "mass_damping", "stiffness_damping",
                                           "density"};
  const ParameterSet set = all_estimated();
  for (const Parameter& p : set.parameters()) {
    EXPECT_EQ(is_modulus(p), p.name == "youngs_modulus") << p.name;
    EXPECT_EQ(is_of_object(p), of_object.contains(p.name)) << p.name;
  }
}

TEST(ParameterSet, CoordinatesAreFoundByHandles) {
  ParameterSet set = all_estimated();
  EXPECT_EQ(set.coordinate(layout.youngs_moduli[0]), 0);
  EXPECT_EQ(set.coordinate(layout.gravity), 5);
  EXPECT_EQ(set.coordinate(layout.planes[0].whole()), 14);
  EXPECT_THROW((void)set.coordinate(layout.planes[0].normal), std::invalid_argument) << "a part is no parameter";
  set.set_estimated("mass_damping", false);
  EXPECT_EQ(set.coordinate(layout.gravity), 4);
  EXPECT_THROW((void)set.coordinate(layout.mass_damping), std::invalid_argument);
  EXPECT_THROW((void)set.coordinate({}), std::invalid_argument);
}

TEST(ParameterSet, EveryCoordinateKnowsItsParameter) {
  ParameterSet set = all_estimated();
  set.set_estimated("density", false);
  const std::vector<const Parameter*> of = set.coordinate_parameters();
  const std::vector<std::string> names = set.coordinate_names();
  ASSERT_EQ(of.size(), names.size());
  for (std::size_t i = 0; i < of.size(); ++i) {
    EXPECT_TRUE(names[i].starts_with(of[i]->name)) << names[i];
    EXPECT_TRUE(of[i]->estimated);
    const Eigen::Index first = set.coordinate(of[i]->at);
    EXPECT_GE(Eigen::Index(i), first);
    EXPECT_LT(Eigen::Index(i), first + of[i]->dimension());
  }
}

TEST(ParameterSet, RefusesWhatIsNotOfItsLayout) {
  const VectorX reference = layout.zero();
  const std::vector<Parameter> density = {{"density", "kg/m^3", Transform::Logarithm, layout.density}};
  EXPECT_NO_THROW(ParameterSet(layout.layout(), density, reference));
  for (const Eigen::Index size : {reference.size() - 1, reference.size() + 1})
    EXPECT_THROW(ParameterSet(layout.layout(), density, VectorX::Zero(size)), std::invalid_argument);
  const ParameterHandle beyond{layout.size(), 1};
  EXPECT_THROW(ParameterSet(layout.layout(), {{"beyond", "1", Transform::Shift, beyond}}, reference),
               std::invalid_argument);
  EXPECT_THROW(ParameterSet(layout.layout(), {{"nowhere", "1", Transform::Shift, ParameterHandle()}}, reference),
               std::invalid_argument);
}

}  // namespace
}  // namespace pliant::parameter_set_test
