// Coulomb friction of a block on a slope against the rigid block's motion.
#include <cmath>

#include "motion/simulation.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::friction_test {
namespace {

using test::tolerance;

constexpr double gravity = 9.81, angle = 0.4;  // [m/s^2], [rad]
/// Below about this speed friction is less than Coulomb's [m/s]: `default_friction_speed`. A few times as much is what
/// starts and stops may differ by.
const double fades = std::sqrt(2e-4 * gravity * 0.12);

/// Of a stiff flat block that is let go on a slope: how fast it goes down, and sinks away from it, at the end [m/s].
struct End {
  double along = 0.0, away = 0.0;
};

End slide(double friction, bool of_tetrahedra, Integrator integrator, double seconds, double speed = 0.0) {
  const auto body =
      of_tetrahedra ? test::tet_body({0.12, 0.04, 0.12}, {3, 1, 3}, false) : test::box_body({0.12, 0.04, 0.12}, 0.04);
  const MotionLayout layout({.planes = 1});
  const Vector3 normal(std::sin(angle), std::cos(angle), 0.0), down(std::cos(angle), -std::sin(angle), 0.0);
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 2e5);
  theta[layout.poissons_ratio] = 0.3;
  theta[layout.density] = 300.0;
  theta[layout.stiffness_damping] = 2e-3;
  // The slope is level, and gravity tilted.
  theta.segment<3>(layout.gravity) = gravity * Vector3(std::sin(angle), -std::cos(angle), 0.0);
  theta.segment<3>(layout.linear_velocity) = Vector3(speed, 0.0, 0.0);
  theta.segment<3>(layout.planes[0].normal) = Vector3::UnitY();
  theta.segment<3>(layout.planes[0].point) = Vector3(0.0, body->nodes.col(1).minCoeff(), 0.0);
  theta[layout.planes[0].friction] = friction;
  SimulationOptions options;
  options.times = {0.0, seconds};
  options.max_dt = 1.0 / 480.0;
  options.blocks = layout;
  options.integrator = integrator;
  options.contact = default_contact(*body, 300.0 * body->volume(), gravity);
  options.friction_speed = default_friction_speed(*body, gravity);
  Simulation simulation(body, options);
  End end;
  const RolloutSummary summary = simulation.run(theta, [&](int, const State& state, auto) {
    Points momentum = Points::Zero(state.v.rows(), 3);
    body->add_mass_product(1.0 / body->volume(), state.v, momentum);
    end = {momentum.col(0).sum(), momentum.col(1).sum()};
    return true;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return end;
}

struct Slope : ::testing::TestWithParam<std::tuple<bool, Integrator>> {
  End slide(double friction, double seconds, double speed = 0.0) const {
    return friction_test::slide(friction, std::get<0>(GetParam()), std::get<1>(GetParam()), seconds, speed);
  }
};

TEST_P(Slope, SlidesWithTheAccelerationOfARigidBlock) {
  for (const double friction : {0.0, 0.1, 0.25}) {
    const double seconds = 0.5, expected = seconds * gravity * (std::sin(angle) - friction * std::cos(angle));
    const End end = slide(friction, seconds);
    EXPECT_NEAR(end.along, expected, friction > 0.0 ? 3.0 * fades : tolerance(0.005) * expected) << friction;
    EXPECT_GT(0.5 * gravity * friction * std::cos(angle), friction > 0.0 ? 9.0 * fades : -1.0) << "it shows";
    EXPECT_LT(std::abs(end.away), 0.02);
  }
}

TEST_P(Slope, SticksWhereFrictionCarriesIt) {
  const End end = slide(0.7, 0.5);  // tan(0.4) = 0.42
  EXPECT_LT(std::abs(end.along), 2.0 * fades);
  EXPECT_GT(gravity * std::sin(angle) * 0.5, 20.0 * fades) << "without friction it would have gone";
}

TEST_P(Slope, StopsWhatGoesUp) {
  const double expected = -0.9 + 0.1 * gravity * (std::sin(angle) + 0.4 * std::cos(angle));  // still going up
  EXPECT_LT(expected, -10.0 * fades);
  EXPECT_NEAR(slide(0.4, 0.1, -0.9).along, expected, 3.0 * fades);
}

INSTANTIATE_TEST_SUITE_P(Bodies, Slope,
                         ::testing::Combine(::testing::Bool(),
                                            ::testing::Values(Integrator::Lagged, Integrator::Newton)),
                         [](const auto& c) {
                           return std::string(std::get<0>(c.param) ? "Tetrahedra" : "Hexahedra") +
                                  (std::get<1>(c.param) == Integrator::Lagged ? "Lagged" : "Newton");
                         });

}  // namespace
}  // namespace pliant::friction_test
