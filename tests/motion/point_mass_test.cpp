#include <cmath>
#include <numbers>

#include "motion/simulation.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::point_mass_test {
namespace {

using test::tolerance;

constexpr double length = 0.2, edge = 0.05;

/// A short bar along x with a weight at its free end, of hexahedra or quadratic tetrahedra, by either integrator.
struct WeightedBar : ::testing::TestWithParam<std::tuple<ElementKind, Integrator>> {
  WeightedBar() {
    body = std::get<0>(GetParam()) == ElementKind::Hexahedron ? test::box_body({length, edge, edge}, edge)
                                                              : test::tet_body({length, edge, edge}, {2, 1, 1}, true);
    for (int frame = 0; frame <= 4; ++frame) options.times.push_back(frame / 50.0);
    options.max_dt = 1.0 / 200.0 + 1e-9;
    options.newmark_theta = 0.5;
    options.integrator = std::get<1>(GetParam());
    options.newton.tolerance = 1e-13;
    options.solver.kind = SolverKind::Simplicial;
    options.weights = {{Vector3(0.5 * length, 0.01, 0.5 * edge), 0.3}};  // off the nodes
    options.blocks = layout;
    layout.set_moduli(theta, 1e5);
    theta[layout.poissons_ratio] = 0.3;
    theta[layout.density] = 500.0;  // 0.25 kg
    theta.segment<3>(layout.gravity) << 0.4, -0.3, -9.81;
  }
  void clamp() {
    options.holds = {{[](const Vector3& p) { return p.x() < -0.5 * length + 1e-6; }}};
    options.hold_strongly = true;
  }
  VectorX last_positions(const VectorX& parameters) const {
    Simulation simulation(body, options);
    VectorX x;
    const RolloutSummary summary = simulation.run(parameters, [&](int, const State& state, auto) {
      x = flat(state.x);
      return true;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    return x;
  }
  double height(const VectorX& positions, const Vector3& rest) const {
    return Embedding(*body, {rest}).position(0, as_points(positions)).z();
  }

  std::shared_ptr<const Body> body;
  MotionLayout layout;
  SimulationOptions options;
  VectorX theta = layout.zero();
};

/// What falls freely feels no weight: the body stays in shape only where a hung mass is as inert as it is heavy.
TEST_P(WeightedBar, FallsFreelyInShape) {
  const VectorX x = last_positions(theta);
  const double t = options.times.back();
  const Points expected =
      body->reference_positions().rowwise() + (0.5 * t * t * layout.gravity.vector(theta)).transpose();
  EXPECT_LT((as_points(x) - expected).cwiseAbs().maxCoeff(), tolerance(1e-11));
}

/// A weight a thousand times heavier than its bar is an oscillator whose frequency is the root of g over its
/// deflection at rest.
TEST_P(WeightedBar, SwingsAsItsDeflectionSays) {
  clamp();
  const Vector3 at(0.5 * length, 0.0, 0.0);  // on the axis: off it the weight would swing lengthwise too
  options.weights = {{at, 0.3}};
  theta.segment<3>(layout.gravity) << 0.0, 0.0, -9.81;
  layout.set_moduli(theta, 1e7);
  theta[layout.density] = 0.6;
  options.is_static = true;
  const double deflection = at.z() - height(last_positions(theta), at);
  ASSERT_GT(deflection, 1e-4);
  ASSERT_LT(deflection, 0.01 * length);
  options.is_static = false;
  const double period = 2.0 * std::numbers::pi * std::sqrt(deflection / 9.81);
  options.max_dt = period / 200.0;
  for (const double part : {0.25, 0.5, 0.75, 1.0}) {
    options.times = {0.0, part * period};
    const double drop = at.z() - height(last_positions(theta), at);
    // Released without deflection. What the bar's own mass and the step leave is far below a hundredth.
    EXPECT_NEAR(drop / deflection, 1.0 - std::cos(2.0 * std::numbers::pi * part), tolerance(0.02)) << part;
  }
}

TEST_P(WeightedBar, DerivativesMatchDifferencesAndEachOther) {
  clamp();
  theta[layout.mass_damping] = 0.7;
  theta[layout.stiffness_damping] = 0.002;
  const int last = int(options.times.size()) - 1;
  Simulation simulation(body, options);
  const Points weight = test::deformed(body->reference_positions(), 0.3);
  VectorX gradient;
  const RolloutSummary summary = simulation.run_adjoint(
      theta, last, [](int, const State&) { return true; },
      [&](int frame, const State&, Points& bar) {
        if (frame == last) bar += weight;
      },
      gradient);
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  for (const Eigen::Index index : {Eigen::Index(layout.youngs_moduli[0]), Eigen::Index(layout.mass_damping),
                                   Eigen::Index(layout.stiffness_damping), Eigen::Index(layout.density),
                                   Eigen::Index(layout.gravity), layout.linear_velocity + 1}) {
    VectorX direction = VectorX::Zero(theta.size());
    direction[index] = theta[index] != 0.0 ? std::abs(theta[index]) : 1.0;
    VectorX tangent;
    simulation.run(theta, direction, last, [&](int frame, const State&, std::span<const State> tangents) {
      if (frame == last) tangent = flat(tangents[0].x);
      return true;
    });
    const auto along = [&](double h) { return last_positions(theta + h * direction); };
    EXPECT_LT(test::best_relative_error(along, tangent, 1.0), tolerance(1e-6)) << "theta[" << index << "]";
    const double by_tangent = flat(weight).dot(tangent);
    EXPECT_NEAR(gradient.dot(direction), by_tangent, tolerance(1e-9) * weight.norm() * tangent.norm())
        << "theta[" << index << "]";
  }
}

INSTANTIATE_TEST_SUITE_P(All, WeightedBar,
                         ::testing::Combine(::testing::Values(ElementKind::Hexahedron,
                                                              ElementKind::QuadraticTetrahedron),
                                            ::testing::Values(Integrator::Lagged, Integrator::Newton)));

TEST(Stepper, RefusesCarriedPointsWithoutMasses) {
  const auto body = test::box_body({length, edge, edge}, edge);
  StepOptions options;
  options.dt = 0.01;
  Stepper stepper(body, {}, MotionLayout(), options);
  EXPECT_THROW(stepper.carry(Embedding(*body, {Vector3::Zero()}), {}), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::point_mass_test
