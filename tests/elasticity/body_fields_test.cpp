#include "elasticity/body_fields.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "elasticity/law_elasticity.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::body_fields_test {
namespace {

using test::tolerance;

constexpr double E = 3000.0, nu = 0.35;
constexpr double mu = E / (2.0 * (1.0 + nu)), lambda = E * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
const Vector3 size(0.2, 0.1, 0.1);

/// A law's Cauchy stress under the stretches (l, t, t), by hand.
struct Along {
  double along, across;
};

struct Case {
  std::string name;
  std::function<std::shared_ptr<const Body>()> make_body;
  std::function<std::unique_ptr<Elasticity>(const std::shared_ptr<const Body>&)> make_elasticity;
  std::function<Along(double l, double t)> stress;
  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

/// Linear in S - I: sigma = R T S R^T / J.
Along linear(double l, double t) {
  const double trace = l - 1.0 + 2.0 * (t - 1.0), J = l * t * t;
  return {(2.0 * mu * (l - 1.0) + lambda * trace) * l / J, (2.0 * mu * (t - 1.0) + lambda * trace) * t / J};
}
/// Smith et al. 2018 without their barrier.
Along neo_hookean(double l, double t) {
  const double J = l * t * t, pressure = (lambda + mu) * (J - 1.0) - mu;
  return {mu * l * l / J + pressure, mu * t * t / J + pressure};
}
constexpr double exponent = -4.0;
/// Storakers 1986, one term.
Along ogden(double l, double t) {
  const double J = l * t * t, bulk = std::pow(J, -exponent * nu / (1.0 - 2.0 * nu)), factor = 2.0 * mu / exponent / J;
  return {factor * (std::pow(l, exponent) - bulk), factor * (std::pow(t, exponent) - bulk)};
}

template <class Law>
auto with_law(const std::vector<double>& row) {
  return [row](const std::shared_ptr<const Body>& body) -> std::unique_ptr<Elasticity> {
    const MatrixX table =
        Eigen::Map<const Eigen::RowVectorXd>(row.data(), Eigen::Index(row.size())).replicate(body->element_count(), 1);
    return LawElasticity::make(body, std::make_shared<Law>(table));
  };
}

auto turning(ElasticLaw law) {
  return [law](const std::shared_ptr<const Body>& body) {
    const MotionLayout layout;
    VectorX theta = layout.zero();
    layout.set_moduli(theta, E);
    theta[layout.poissons_ratio] = nu;
    auto elasticity = make_elasticity(body, layout, law);
    elasticity->set_parameters(theta);
    return elasticity;
  };
}

std::vector<Case> cases() {
  const LambdaAlpha linear_row = lambda_alpha({E, nu});
  const std::vector<std::pair<std::string, std::function<std::shared_ptr<const Body>()>>> tetrahedra = {
      {"Tetrahedra",
       [] {
         return test::tet_body(size, {4, 2, 2}, false);
       }},
      {"QuadraticTetrahedra", [] {
         return test::tet_body(size, {3, 2, 2}, true);
       }}};
  auto bodies = tetrahedra;
  for (const HexFormulation formulation : {HexFormulation::IncompatibleModes, HexFormulation::Trilinear})
    bodies.emplace_back(formulation == HexFormulation::Trilinear ? "TrilinearHexahedra" : "Hexahedra", [formulation] {
      return test::box_body(size, 0.05, {formulation, MassKind::Consistent});
    });
  std::vector<Case> all;
  for (const auto& [name, make] : bodies) {
    all.push_back({name + "Corotated", make, turning(ElasticLaw::Corotated), linear});
    all.push_back({name + "NeoHookeanMean", make, turning(ElasticLaw::NeoHookean), neo_hookean});
  }
  for (const auto& [name, make] : tetrahedra) {
    all.push_back({name + "Linear", make, with_law<LinearLaw>({linear_row.lambda, linear_row.alpha}), linear});
    all.push_back({name + "NeoHookean", make, with_law<NeoHookeanLaw>({mu, lambda}), neo_hookean});
    all.push_back({name + "Ogden", make, with_law<OgdenLaw>({mu, exponent, nu}), ogden});
  }
  return all;
}

/// How far a bar that is stretched to l times its length draws in sideways, where its sides are free.
double free_width(const Case& c, double l) {
  double low = 0.5, high = 2.0;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (c.stress(l, middle).across > 0.0 ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

const Matrix3 turn = Eigen::AngleAxisd(1.9, Vector3(0.3, -0.8, 0.5).normalized()).toRotationMatrix();

class BodyFieldsOf : public testing::TestWithParam<Case> {
 protected:
  BodyFieldsOf() : body(GetParam().make_body()), elasticity(GetParam().make_elasticity(body)) {}
  BodyFields at(const Matrix3& F) const {
    return body_fields(*body, *elasticity, body->reference_positions() * F.transpose());
  }
  std::shared_ptr<const Body> body;
  std::unique_ptr<Elasticity> elasticity;
};

TEST_P(BodyFieldsOf, ABarThatIsPulledHasTheStressAndStrainOfItsLaw) {
  for (const double l : {0.8, 0.97, 1.1, 1.4}) {
    const double t = free_width(GetParam(), l), expected = std::abs(GetParam().stress(l, t).along);
    const Matrix3 F = turn * Vector3(l, t, t).asDiagonal();
    const BodyFields fields = at(F);
    for (std::size_t e = 0; e < fields.von_mises.size(); ++e) {
      ASSERT_NEAR(fields.von_mises[e], expected, tolerance(1e-9) * E) << l << ", element " << e;
      ASSERT_NEAR(fields.greatest_strain[e], std::abs(l - 1.0), tolerance(1e-12)) << l << ", element " << e;
    }
    const Vector3 along = turn * Vector3::UnitX();
    EXPECT_NEAR(along.dot(fields.stress[0] * along), GetParam().stress(l, t).along, tolerance(1e-9) * E);
    EXPECT_NEAR(along.dot(fields.strain[0] * along), l - 1.0, tolerance(1e-12));
    // It is in equilibrium but for the forces on its ends: sides and inside carry none. (The surface of the grid's box
    // lies a ten-millionth of a cell outside its nodes.)
    Points force = Points::Zero(body->node_count(), 3);
    elasticity->add_force(body->reference_positions() * F.transpose(), force);
    double elsewhere = 0.0;
    for (int n = 0; n < body->node_count(); ++n)
      if (std::abs(std::abs(body->nodes(n, 0)) - 0.5 * size.x()) > 1e-9)
        elsewhere = std::max(elsewhere, force.row(n).norm());
    EXPECT_LT(elsewhere, tolerance(1e-7) * E * size.y() * size.z()) << l;
    EXPECT_GT(force.norm(), 1e-3 * E * size.y() * size.z());
  }
}

TEST_P(BodyFieldsOf, TheTangentModulusIsTheSlopeOfABarsCurve) {
  const auto pull = [&](double l) {  // force over the area at rest
    const double t = free_width(GetParam(), l);
    return GetParam().stress(l, t).along * t * t;
  };
  constexpr double step = 1e-4;
  for (const double l : {0.8, 1.0, 1.3}) {
    const double t = free_width(GetParam(), l);
    const BodyFields fields = at(turn * Vector3(l, t, t).asDiagonal());
    const double slope = (pull(l + step) - pull(l - step)) / (2.0 * step);
    for (const double modulus : fields.tangent_modulus) ASSERT_NEAR(modulus, slope, tolerance(1e-6) * E) << l;
  }
}

TEST_P(BodyFieldsOf, TurningAloneMakesNone) {
  const BodyFields fields = at(turn);
  for (std::size_t e = 0; e < fields.von_mises.size(); ++e) {
    ASSERT_LT(fields.von_mises[e], tolerance(1e-10) * E);
    ASSERT_LT(fields.greatest_strain[e], tolerance(1e-12));
    ASSERT_NEAR(fields.tangent_modulus[e], E, tolerance(1e-9) * E);
  }
}

TEST_P(BodyFieldsOf, PressureFromAllSidesMakesNoVonMisesStress) {
  const double s = 0.9;
  const BodyFields fields = at(s * turn);
  for (std::size_t e = 0; e < fields.von_mises.size(); ++e) {
    ASSERT_LT(fields.von_mises[e], tolerance(1e-9) * E);
    ASSERT_NEAR(fields.stress[e].trace() / 3.0, GetParam().stress(s, s).along, tolerance(1e-9) * E);
    ASSERT_NEAR(fields.greatest_strain[e], 1.0 - s, tolerance(1e-12));
  }
}

INSTANTIATE_TEST_SUITE_P(All, BodyFieldsOf, testing::ValuesIn(cases()), [](const auto& i) { return i.param.name; });

TEST(BodyFields, WhatTheLawDoesNotKnowIsNotANumber) {
  const auto body = test::tet_body(size, {2, 1, 1}, false);
  const auto elasticity = with_law<OgdenLaw>({mu, exponent, nu})(body);
  const Matrix3 mirror = Vector3(-1.0, 1.0, 1.0).asDiagonal();
  const BodyFields fields = body_fields(*body, *elasticity, body->reference_positions() * mirror);
  EXPECT_TRUE(std::isnan(fields.von_mises[0]));
  EXPECT_TRUE(std::isnan(fields.tangent_modulus[0]));
  const OgdenLaw law(MatrixX{{mu, exponent, nu}});
  EXPECT_TRUE(cauchy_stress(law, 0, mirror).hasNaN());
}

TEST(CauchyStress, IsThatOfTheBody) {
  const auto body = test::tet_body(size, {2, 1, 1}, false);
  const auto elasticity = with_law<NeoHookeanLaw>({mu, lambda})(body);
  const Points x = test::deformed(body->reference_positions(), 0.2);
  const BodyFields fields = body_fields(*body, *elasticity, x);
  const NeoHookeanLaw law(MatrixX{{mu, lambda}});
  for (int e = 0; e < body->element_count(); ++e) {
    Matrix3 F = Matrix3::Zero();
    for (int a = 0; a < 4; ++a) F += x.row(body->element(e)[a]).transpose() * body->gradients(e).row(a);
    EXPECT_LT((cauchy_stress(law, 0, F) - fields.stress[std::size_t(e)]).norm(), tolerance(1e-10) * E) << e;
  }
}

TEST(Averages, AreMeansByVolume) {
  const auto body = test::tet_body(size, {4, 2, 2}, true);
  const std::vector<Vector3> points = {{0.09, 0.01, 0.02}, {-0.1, 0.05, 0.05}, {0.0, 0.0, 0.0}};
  const Embedding embedding(*body, points);
  std::vector<double> values(std::size_t(body->element_count()), 7.0);
  EXPECT_THAT(averages_at(*body, embedding, values), testing::Each(testing::DoubleNear(7.0, 1e-12)));
  const int corner = body->element(0)[0];
  double sum = 0.0, volume = 0.0;
  for (int e = 0; e < body->element_count(); ++e) {
    values[std::size_t(e)] = double(e);
    if (std::ranges::find(body->element(e), corner) == body->element(e).end()) continue;
    sum += body->element_volume[std::size_t(e)] * double(e), volume += body->element_volume[std::size_t(e)];
  }
  const Embedding at_corner(*body, {Vector3(body->nodes.row(corner))});
  EXPECT_NEAR(averages_at(*body, at_corner, values)[0], sum / volume, 1e-6);
}

}  // namespace
}  // namespace pliant::body_fields_test
