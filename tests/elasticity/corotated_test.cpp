#include "elasticity/corotated.hpp"

#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::corotated_test {
namespace {

using test::tolerance;

struct Elastic : ::testing::TestWithParam<test::BodyKind> {
  Elastic() : body(GetParam().make()), owned(make_elasticity(body, layout)), term(*owned) {
    theta = layout.zero();
    layout.set_moduli(theta, 3000.0);
    theta[layout.poissons_ratio] = 0.35;
    term.set_parameters(theta);
  }
  Points force(const Points& z) {
    Points f = Points::Zero(z.rows(), 3);
    term.add_force(z, f);
    return f;
  }
  const Points& X() const { return body->reference_positions(); }

  MotionLayout layout;
  std::shared_ptr<const Body> body;
  VectorX theta;
  std::unique_ptr<Elasticity> owned;
  Elasticity& term;
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
    for (int e = 0; e < body->element_count(); ++e) EXPECT_LT((term.rotation(e).R - R).norm(), tolerance(1e-12));
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
  for (double& m : varied.modulus.relative) m = 2.5;
  const auto other = make_elasticity(std::make_shared<Body>(varied), layout);
  Elasticity& stiffer = *other;
  stiffer.set_parameters(theta);
  const Points z = test::deformed(X(), 0.3);
  term.linearise(z), stiffer.linearise(z);
  EXPECT_NEAR(stiffer.energy(z), 2.5 * term.energy(z), tolerance(1e-12) * term.energy(z));
}

/// Linear tetrahedra have one gradient, so that the polar decomposition's rotation is the energy's best: forces are its
/// exact gradient and the exact stiffness is symmetric. The others' mean rotation is not quite, and theirs is not.
TEST_P(Elastic, ExactStiffnessIsTheForcesDerivative) {
  const Points z = test::deformed(X(), 0.25, 1.7), direction = test::deformed(X(), 0.5, -0.4);
  const auto force_at = [&](const Points& x) {
    term.linearise(x);
    return force(x);
  };
  const auto along = [&](double step) -> VectorX { return -flat(force_at(z + step * direction)); };
  term.linearise(z);
  BlockMatrix K(body->pattern);
  term.add_matrix(1.0, K);
  term.add_lag_matrix(z, 1.0, K);
  const MatrixX dense = test::dense(K);
  const VectorX exact = dense * flat(direction);
  EXPECT_LT(test::best_relative_error(along, exact, 0.1), tolerance(1e-7));
  const double asymmetry = (dense - dense.transpose()).norm() / dense.norm();
  if (body->kind == ElementKind::Tetrahedron)
    EXPECT_LT(asymmetry, tolerance(1e-13));
  else
    EXPECT_GT(asymmetry, 1e-6);
}

TEST_P(Elastic, ControlModuliMixInTheLogarithm) {
  Body mixed = *body;
  const int n = body->element_count();
  mixed.modulus.controls = 3;
  mixed.modulus.weights = (MatrixX::Random(n, 3).array() + 1.5).matrix();
  for (int e = 0; e < n; ++e) mixed.modulus.weights.row(e) /= mixed.modulus.weights.row(e).sum();
  const MotionLayout layout3({.moduli = 3, .planes = 2});
  ElementModuli moduli(std::make_shared<Body>(mixed), layout3);
  VectorX theta3 = layout3.zero();
  const Vector3 controls(1000.0, 4000.0, 9000.0);
  for (int k = 0; k < 3; ++k) theta3[layout3.youngs_moduli[std::size_t(k)]] = controls[k];
  moduli.set_parameters(theta3);
  for (int e = 0; e < n; ++e) {
    const double expected = std::exp(mixed.modulus.weights.row(e).dot(controls.array().log().matrix()));
    EXPECT_NEAR(moduli[e], expected, tolerance(1e-12) * expected);
  }
  layout3.set_moduli(theta3, 1000.0);
  moduli.set_parameters(theta3);
  for (int e = 0; e < n; ++e)
    EXPECT_NEAR(moduli[e], 1000.0, tolerance(1e-9)) << "equal controls are a homogeneous object";
}

INSTANTIATE_TEST_SUITE_P(Kinds, Elastic, ::testing::ValuesIn(test::body_kinds()),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace pliant::corotated_test
