#include "elasticity/corotated.hpp"

#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant {
namespace {

using test::tolerance;

struct Elastic : ::testing::TestWithParam<HexFormulation> {
  Elastic() : body(test::torus_body(0.1, 0.04, 0.05, {GetParam(), MassKind::Consistent})), term(body) {
    theta.setZero(theta::size(0));
    theta[theta::youngs_modulus] = 3000.0;
    theta[theta::poissons_ratio] = 0.35;
    term.set_parameters(theta);
  }
  Points force(const Points& z) {
    Points f = Points::Zero(z.rows(), 3);
    term.add_force(z, f);
    return f;
  }
  const Points& X() const { return body->reference_positions(); }

  std::shared_ptr<const Body> body;
  VectorX theta;
  CorotatedElasticity term;
};

TEST_P(Elastic, RigidMotionCostsNoForceAndNoEnergy) {
  term.linearise(test::deformed(X(), 0.3));
  const double scale = force(test::deformed(X(), 0.3)).norm();
  ASSERT_GT(scale, 1.0);
  for (const double angle : {0.0, 1.0, 2.5, 3.1, -2.0}) {
    const Points moved = test::deformed(X(), 0.0, angle);
    term.linearise(moved);
    EXPECT_LT(force(moved).norm(), tolerance(1e-12) * scale) << angle;
    EXPECT_LT(term.energy(moved), tolerance(1e-20));
    const Matrix3 R = Eigen::AngleAxisd(angle, Vector3(0.3, -0.8, 0.5).normalized()).toRotationMatrix();
    for (int e = 0; e < body->grid.cell_count(); ++e) EXPECT_LT((term.rotation(e).R - R).norm(), tolerance(1e-12));
  }
}

TEST_P(Elastic, ForceIsMinusTheGradientOfTheEnergyAtFixedRotations) {
  term.linearise(test::deformed(X(), 0.35));
  const Points z = test::deformed(X(), 0.25, 1.7), direction = test::deformed(X(), 0.5, -0.4);
  const double exact = -force(z).cwiseProduct(direction).sum();
  ASSERT_GT(std::abs(exact), 0.0);
  const auto along = [&](double step) -> VectorX { return VectorX::Constant(1, term.energy(z + step * direction)); };
  // Quadratic in z: central differences are exact up to rounding.
  EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, exact), 1.0), tolerance(1e-9));
}

TEST_P(Elastic, MatrixIsMinusTheForcesDerivative) {
  term.linearise(test::deformed(X(), 0.35));
  BlockMatrix K(body->pattern);
  term.add_matrix(2.0, K);
  const MatrixX dense = test::dense(K);
  EXPECT_LT((dense - dense.transpose()).norm(), tolerance(1e-14) * dense.norm());
  const Points z = test::deformed(X(), 0.25, 1.7), direction = test::deformed(X(), 0.5, -0.4);
  const VectorX change = flat(force(z + direction)) - flat(force(z));
  ASSERT_GT(change.norm(), 1.0);
  EXPECT_LT((dense * flat(direction) + 2.0 * change).norm(), tolerance(1e-11) * change.norm());
}

TEST_P(Elastic, FrameIndifferent) {
  const Points z = test::deformed(X(), 0.3);
  term.linearise(z);
  const Points f = force(z);
  const double energy = term.energy(z);
  const Matrix3 R = Eigen::AngleAxisd(2.0, Vector3(1, 2, -1).normalized()).toRotationMatrix();
  const Points turned = z * R.transpose();
  term.linearise(turned);
  EXPECT_NEAR(term.energy(turned), energy, tolerance(1e-11) * energy);
  EXPECT_LT((force(turned) - f * R.transpose()).norm(), tolerance(1e-11) * f.norm());
}

TEST_P(Elastic, InternalForcesBalance) {
  const Points z = test::deformed(X(), 0.3);
  term.linearise(z);
  const Points f = force(z);
  EXPECT_LT(f.colwise().sum().norm(), tolerance(1e-12) * f.norm());
}

/// Uniform stretch of the whole cut body: V times the energy density, whatever the grid cuts.
TEST_P(Elastic, UniformStretchHasTheExactEnergy) {
  const Vector3 stretch(1.02, 0.97, 1.05);
  const Points z = test::deformed(X() * stretch.asDiagonal(), 0.0, 2.2);
  term.linearise(z);
  const UnitLame c = unit_lame(0.35);
  const Vector3 strain = stretch - Vector3::Ones();
  const double density = 3000.0 * (0.5 * c.lambda * strain.sum() * strain.sum() + c.mu * strain.squaredNorm());
  EXPECT_NEAR(term.energy(z), density * body->volume(), tolerance(1e-10) * density * body->volume());
}

TEST_P(Elastic, RelativeModulusScalesItsElements) {
  Body varied = *body;
  for (double& m : varied.relative_modulus) m = 2.5;
  CorotatedElasticity stiffer(std::make_shared<Body>(varied));
  stiffer.set_parameters(theta);
  const Points z = test::deformed(X(), 0.3);
  term.linearise(z), stiffer.linearise(z);
  EXPECT_NEAR(stiffer.energy(z), 2.5 * term.energy(z), tolerance(1e-12) * term.energy(z));
}

INSTANTIATE_TEST_SUITE_P(Formulations, Elastic, ::testing::Values(HexFormulation::IncompatibleModes, HexFormulation::Trilinear));

}  // namespace
}  // namespace pliant
