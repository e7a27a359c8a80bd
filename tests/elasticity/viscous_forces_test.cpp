// Derivatives of both are in the battery of force terms (motion/force_term_test.cpp).
#include "elasticity/viscous_forces.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "elasticity/corotated.hpp"
#include "elasticity/reference_forces.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant {
namespace {

struct Damped {
  explicit Damped(const test::BodyKind& kind) : body(kind.make()), theta(layout.zero()) {
    layout.set_moduli(theta, 3000.0);
    theta[layout.poissons_ratio] = 0.3;
    theta[layout.stiffness_damping] = beta;
    term = make_viscous_forces(body, layout, layout.stiffness_damping);
    term->set_parameters(theta);
  }
  Points moved(const Matrix3& F) const { return body->reference_positions() * F.transpose(); }
  Points force(const Points& start, const Points& lag, const Points& end) {
    const Points velocity = Points::Zero(start.rows(), 3);
    term->begin_step({&start, &velocity, 0.0, dt});
    term->linearise(lag);
    Points f = Points::Zero(start.rows(), 3);
    term->add_force(end, f);
    return f;
  }
  double volume() const { return body->volume(); }

  static constexpr double beta = 0.004, dt = 0.01;
  std::shared_ptr<const Body> body;
  MotionLayout layout;
  VectorX theta;
  std::unique_ptr<ForceTerm> term;
};

/// Under a homogeneous F and rate dF/dt the power is that of S = beta C : dE/dt over the volume, dE/dt = sym(F^T
/// dF/dt).
TEST(ViscousForces, TakeThePowerOfTheGreenStrainRate) {
  Matrix3 F, rate;
  F << 0.7, 0.1, 0.0, -0.2, 1.1, 0.05, 0.1, 0.0, 1.3;
  rate << -2.0, 0.5, 0.3, 0.1, 1.0, -0.4, 0.2, 0.6, 0.8;
  for (const test::BodyKind& kind : test::body_kinds()) {
    Damped damped(kind);
    const Points x = damped.moved(F), velocity = damped.moved(rate);
    const Points f = damped.force(x, x, x + Damped::dt * velocity);
    const Matrix3 strain_rate = 0.5 * (F.transpose() * rate + rate.transpose() * F);
    const UnitLame lame = unit_lame(0.3);
    const double density =
        lame.lambda * strain_rate.trace() * strain_rate.trace() + 2.0 * lame.mu * strain_rate.squaredNorm();
    const double power = -Damped::beta * 3000.0 * damped.volume() * density;
    EXPECT_NEAR(f.cwiseProduct(velocity).sum() / power, 1.0, 1e-10) << kind.name;
    EXPECT_LT(f.colwise().sum().norm(), 1e-10 * f.norm()) << kind.name;
  }
}

TEST(ViscousForces, LeaveARigidMotionAlone) {
  Matrix3 F;
  F << 0.7, 0.1, 0.0, -0.2, 1.1, 0.05, 0.1, 0.0, 1.3;
  Matrix3 spin;
  spin << 0.0, -3.0, 1.0, 3.0, 0.0, 2.0, -1.0, -2.0, 0.0;
  for (const test::BodyKind& kind : test::body_kinds()) {
    Damped damped(kind);
    const Points x = damped.moved(F);
    const Points turning = damped.force(x, x, x + Damped::dt * x * spin.transpose());
    const Points stretching = damped.force(x, x, x + Damped::dt * 3.0 * x);
    EXPECT_LT(turning.norm(), 1e-12 * stretching.norm()) << kind.name;
  }
}

TEST(ViscousForces, AreThoseOfRayleighAtSmallStrain) {
  for (const test::BodyKind& kind : test::body_kinds()) {
    Damped damped(kind);
    const Points x = damped.body->reference_positions();
    const Points way = 1e-3 * Points::Random(x.rows(), 3);
    const auto elasticity = make_elasticity(damped.body, damped.layout);
    elasticity->set_parameters(damped.theta);
    elasticity->linearise(x);
    Points elastic = Points::Zero(x.rows(), 3);
    elasticity->add_force(x + way, elastic);
    const Points viscous = damped.force(x, x, x + way);
    EXPECT_LT((viscous - Damped::beta / Damped::dt * elastic).norm(), 1e-10 * viscous.norm()) << kind.name;
  }
}

/// The force of every node, of a way that no two elements share, on bodies of many elements.
TEST(ViscousForces, AreThoseOfTheirMatrix) {
  for (const test::BodyKind& kind : test::body_kinds()) {
    Damped damped(kind);
    const Points& X = damped.body->reference_positions();
    Points lag = X, way(X.rows(), 3);
    for (Eigen::Index n = 0; n < X.rows(); ++n)
      for (int d = 0; d < 3; ++d) {
        lag(n, d) += 2e-3 * std::sin(double(7 * n + d));
        way(n, d) = 1e-3 * std::cos(double(5 * n + 3 * d));
      }
    const Points force = damped.force(X, lag, X + way);
    BlockMatrix matrix(damped.body->pattern);
    damped.term->add_matrix(1.0, matrix);
    VectorX expected;
    matrix.multiply(flat(way), expected);
    for (Eigen::Index n = 0; n < X.rows(); ++n)
      ASSERT_LT((force.row(n).transpose() + expected.segment<3>(3 * n)).norm(), 1e-10 * expected.norm())
          << kind.name << ", node " << n;
  }
}

/// Where the nodes are stress-free is not where the body was given: the forces are those of a body with that reference,
/// and their derivatives by it those of central differences.
TEST(ViscousForces, OfTetrahedraHaveDerivativesByTheReference) {
  for (const test::BodyKind& kind : test::body_kinds()) {
    Damped damped(kind);
    if (damped.body->kind == ElementKind::Hexahedron) {
      EXPECT_THROW(damped.term->set_reference(damped.body), std::invalid_argument);
      continue;
    }
    const Points &nodes = damped.body->nodes, X = test::deformed(nodes, 0.1, 0.2);
    const Points start = test::deformed(nodes, 0.25, 1.7), lag = test::deformed(nodes, 0.3, 0.9),
                 end = test::deformed(nodes, 0.2, -0.6), along = test::deformed(nodes, 0.3, -0.4);
    const auto force_of = [&](const Points& reference) {
      damped.term->set_reference(std::make_shared<Body>(with_reference(*damped.body, reference)));
      damped.term->set_parameters(damped.theta);
      return damped.force(start, lag, end);
    };
    const auto by_reference =
        ReferenceForces::make_viscous(damped.body, damped.layout, damped.layout.stiffness_damping);
    by_reference->set_parameters(damped.theta);
    ASSERT_TRUE(by_reference->linearise(X, lag, (end - start) / Damped::dt));
    Points expected = Points::Zero(X.rows(), 3);
    by_reference->add_force(expected);
    const Points f = force_of(X);
    ASSERT_GT(f.norm(), 0.0);
    EXPECT_LT((f - expected).norm(), test::tolerance(1e-10) * f.norm()) << kind.name;

    damped.term->linearise_reference(end);
    Points tangent = Points::Zero(X.rows(), 3), bar = Points::Zero(X.rows(), 3);
    damped.term->add_reference_tangent(along, tangent);
    const Points weight = test::deformed(nodes, 0.5, 2.1);
    damped.term->add_reference_adjoint(weight, bar);
    EXPECT_NEAR(bar.cwiseProduct(along).sum() / weight.cwiseProduct(tangent).sum(), 1.0, test::tolerance(1e-10))
        << kind.name;
    const auto at = [&](double h) -> VectorX { return flat(force_of(X + h * along)); };
    EXPECT_LT(test::best_relative_error(at, VectorX(flat(tangent)), 0.1, 6), test::tolerance(1e-7)) << kind.name;
  }
}

TEST(ViscousForces, AreNothingAtRest) {
  Damped damped(test::body_kinds().front());
  damped.term->begin_step({});
  const Points x = damped.body->reference_positions();
  damped.term->linearise(x);
  Points f = Points::Zero(x.rows(), 3);
  damped.term->add_force(2.0 * x, f);
  EXPECT_EQ(f.norm(), 0.0);
}

/// Homogeneous uniaxial strain: sigma = F P^T / J, with what lateral constraint asks for.
TEST(NeoHookeanMean, HasTheStressOfItsEnergy) {
  const UnitLame lame = unit_lame(0.35);
  for (const double stretch : {0.5, 0.8, 1.0, 1.4}) {
    const Matrix3 F = Vector3(stretch, 1.0, 1.0).asDiagonal();
    for (const test::BodyKind& kind : test::body_kinds()) {
      const auto body = kind.make();
      MotionLayout layout;
      VectorX theta = layout.zero();
      layout.set_moduli(theta, 3000.0);
      theta[layout.poissons_ratio] = 0.35;
      const auto term = make_elasticity(body, layout, ElasticLaw::NeoHookean);
      term->set_parameters(theta);
      const Points x = body->reference_positions() * F;
      term->linearise(x);
      const double s = stretch;
      // dW/ds of W = mu/2 (s^2 - 1) - mu (s - 1) + (lambda + mu)/2 (s - 1)^2; lateral faces have unit area s.
      const double along = 3000.0 * (lame.mu * s - lame.mu + (lame.lambda + lame.mu) * (s - 1.0));
      EXPECT_NEAR(term->cauchy_stress(0)(0, 0), along, 1e-9 * 3000.0) << kind.name << " " << s;
      const double W = 3000.0 * (0.5 * lame.mu * (s * s - 1.0) - lame.mu * (s - 1.0) +
                                 0.5 * (lame.lambda + lame.mu) * (s - 1.0) * (s - 1.0));
      EXPECT_NEAR(term->energy(x), W * body->volume(), 1e-9 * 3000.0 * body->volume()) << kind.name << " " << s;
    }
  }
}

}  // namespace
}  // namespace pliant
