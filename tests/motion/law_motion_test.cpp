// Bodies of a material law in motion: a bar of 0.4 x 0.1 x 0.1 m, held at one end and let go with a velocity.
#include "elasticity/law_elasticity.hpp"
#include "elasticity/sampled_law.hpp"
#include "motion/simulation.hpp"
#include "support/bodies.hpp"
#include "support/samples.hpp"

namespace pliant::law_motion_test {
namespace {

constexpr double modulus = 2e4, nu = 0.3, density = 100.0;

std::shared_ptr<const MaterialLaw> ogden(const Body& body) {
  // Two terms of one Poisson's ratio, together of the modulus above at rest.
  MatrixX q(body.element_count(), 6);
  const double mu = modulus / (2.0 * (1.0 + nu));
  q.rowwise() = (Eigen::RowVectorXd(6) << 0.6 * mu, 9.0, nu, 0.4 * mu, -7.0, nu).finished();
  return std::make_shared<OgdenLaw>(q);
}

/// Twice as stiff where it is strained by a tenth.
std::shared_ptr<const MaterialLaw> sampled(const Body& body) {
  MatrixX strains(body.element_count(), 6);
  std::vector<MaterialSample> samples;
  for (int k = 0; k < 4; ++k) {
    for (int e = 0; e < body.element_count(); ++e)
      for (int i = 0; i < 6; ++i) strains(e, i) = 0.04 * k * std::sin(1.0 + e + 3.1 * i + 7.3 * k);
    samples.push_back(test::stiffening_sample(strains, modulus, 10.0, nu));
  }
  return sample_material(test::one_term_ogden(body.element_count(), 0.5 * modulus / (1.0 + nu), nu), samples, {1e-6, 4})
      .law;
}

struct LetGo {
  double greatest_change = 0.0;  ///< of all energy, relative to what there was at the start
  double least_kinetic = 1.0;    ///< part of it
  Points last;
};

/// @param speed  of all that is not held, along the bar and across [m/s]
LetGo let_go(const std::shared_ptr<const Body>& body, const std::shared_ptr<const MaterialLaw>& law, double speed,
             double dt, Integrator integrator = Integrator::Newton) {
  SimulationOptions options;
  for (int f = 0; f <= 20; ++f) options.times.push_back(5e-3 * f);
  options.max_dt = dt;
  options.newmark_theta = 0.5;
  if (law) options.material.elastic = law;
  options.integrator = integrator;
  options.newton.tolerance = 1e-10;
  options.holds = {Hold{[](const Vector3& p) { return p.x() < -0.199; }}};
  const MotionLayout layout;
  options.blocks = layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, modulus);
  theta[layout.poissons_ratio] = nu;
  theta[layout.density] = density;
  theta.segment<3>(layout.linear_velocity) = speed * Vector3(1.0, 0.5, 0.0);
  Simulation simulation(body, options);
  LetGo result;
  double first = 0.0;
  const auto elasticity = law ? LawElasticity::make(body, law) : nullptr;
  const RolloutSummary summary = simulation.run(theta, [&](int frame, const State& state, auto) {
    if (frame + 1 == int(options.times.size())) result.last = state.x;
    if (!elasticity) return true;
    Points momentum = Points::Zero(state.v.rows(), 3);
    body->add_mass_product(density, state.v, momentum);
    const double kinetic = 0.5 * momentum.cwiseProduct(state.v).sum();
    const double energy = kinetic + elasticity->evaluate(state.x, false);
    if (frame == 1) first = energy;  // what is held stands still from the first step on
    if (frame < 1) return true;
    result.greatest_change = std::max(result.greatest_change, std::abs(energy / first - 1.0));
    result.least_kinetic = std::min(result.least_kinetic, kinetic / first);
    return true;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return result;
}

struct LawMotion : ::testing::TestWithParam<std::shared_ptr<const MaterialLaw> (*)(const Body&)> {
  std::shared_ptr<const Body> body = test::tet_body({0.4, 0.1, 0.1}, {8, 2, 2}, false, 0.1);
  std::shared_ptr<const MaterialLaw> law = GetParam()(*body);
};

TEST_P(LawMotion, OfGreatAmplitudeKeepsItsEnergyAsStepsShrink) {
  const LetGo coarse = let_go(body, law, 2.0, 2.5e-3), fine = let_go(body, law, 2.0, 0.625e-3);
  EXPECT_LT(fine.least_kinetic, 0.3) << "most of the energy must have been stored in between";
  EXPECT_LT(fine.greatest_change, 0.02);
  EXPECT_LT(fine.greatest_change, 0.25 * coarse.greatest_change);
}

/// Steps that are linear about where the start leads are off implicit ones of the same length by far less than either
/// is off the motion.
TEST_P(LawMotion, OfPredictedStepsIsNearlyThatOfImplicitOnes) {
  const double speed = 1.0;
  const Points exact = let_go(body, law, speed, 0.078125e-3).last;
  for (const double dt : {1.25e-3, 0.3125e-3}) {
    const Points implicit = let_go(body, law, speed, dt).last;
    const Points predicted = let_go(body, law, speed, dt, Integrator::Lagged).last;
    ASSERT_GT((implicit - exact).norm(), 0.002 * (exact - body->nodes).norm());
    EXPECT_LT((predicted - implicit).norm(), 0.2 * (implicit - exact).norm()) << dt;
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, LawMotion, ::testing::Values(&ogden, &sampled),
                         [](const auto& c) { return c.param == &ogden ? "Ogden" : "Sampled"; });

TEST(LawMotionSmall, IsThatOfItsModuliAtRest) {
  const auto body = test::tet_body({0.4, 0.1, 0.1}, {8, 2, 2}, false, 0.1);
  const double speed = 1e-3;
  const Points by_law = let_go(body, ogden(*body), speed, 2.5e-3).last,
               by_moduli = let_go(body, nullptr, speed, 2.5e-3).last;
  const double moved = (by_moduli - body->nodes).norm();
  ASSERT_GT(moved, 0.0);
  EXPECT_LT((by_law - by_moduli).norm(), 0.01 * moved);
}

/// What rounding leaves of the forces is far more than a billionth of the weight where a body hardly strains.
TEST(LawAtRest, IsFoundHoweverStiffTheBodyIs) {
  const auto body = test::tet_body({0.4, 0.1, 0.1}, {8, 2, 2}, true, 0.1);
  SimulationOptions options;
  options.times = {0.0};
  options.is_static = true;
  options.holds = {Hold{[](const Vector3& p) { return p.x() < -0.199; }}};
  const MotionLayout layout;
  options.blocks = layout;
  const auto sag = [&](double stiffer) {
    MatrixX q(body->element_count(), 3);
    q.rowwise() = (Eigen::RowVectorXd(3) << stiffer * modulus / (2.0 * (1.0 + nu)), 2.0, nu).finished();
    options.material.elastic = std::make_shared<OgdenLaw>(q);
    VectorX theta = layout.zero();
    layout.set_moduli(theta, stiffer * modulus);
    theta[layout.poissons_ratio] = nu;
    theta[layout.density] = density;
    theta.segment<3>(layout.gravity) = Vector3(0.0, -9.81, 0.0);
    double farthest = 0.0;
    Simulation simulation(body, options);
    const RolloutSummary summary = simulation.run(theta, [&](int, const State& state, auto) {
      farthest = (state.x - body->nodes).rowwise().norm().maxCoeff();
      return true;
    });
    EXPECT_TRUE(summary.succeeded) << stiffer << ": " << summary.failure;
    return farthest;
  };
  const double soft = sag(1e3);
  ASSERT_GT(soft, 1e-5);
  EXPECT_NEAR(1e5 * sag(1e8) / soft, 1.0, 0.01);
}

}  // namespace
}  // namespace pliant::law_motion_test
