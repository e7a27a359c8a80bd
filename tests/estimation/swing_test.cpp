// The modulus with which a body swings as fast as its surface was seen to.
#include "estimation/swing.hpp"

#include "support/released.hpp"

namespace pliant::swing_test {
namespace {

using test::hanging::edge, test::hanging::length;

/// A slender bar along x, held at its low end and pulled aside a little; gravity acts along x.
test::released::Released bar_under(double gravity, double modulus) {
  test::released::Released scene(test::released::bar(ElementKind::QuadraticTetrahedron), Integrator::Newton);
  scene.options.times.clear();
  for (int f = 0; f <= 80; ++f) scene.options.times.push_back(0.05 * f);
  scene.options.max_dt = 0.05;
  scene.options.newton.tolerance = scene.options.solver.tolerance = 1e-8;
  scene.theta[scene.layout.mass_damping] = 0.2;
  scene.theta[scene.layout.stiffness_damping] = 0.0;
  scene.theta.segment<3>(scene.layout.gravity) = Vector3(gravity, 0.0, 0.0);
  scene.layout.set_moduli(scene.theta, modulus);
  scene.set_pulls({0.0, 0.02, 0.0}, Vector3::Zero());
  return scene;
}

std::vector<FrameObservations> seen_of(const test::released::Released& scene) {
  Simulation simulation(scene.body, scene.options);
  std::vector<FrameObservations> seen;
  const RolloutSummary summary = simulation.run(scene.theta, [&](int f, const State& state, auto) {
    FrameObservations frame;
    frame.frame = f;
    for (Eigen::Index n = 0; n < state.x.rows(); ++n) frame.points.push_back({state.x.row(n).transpose(), 0.001});
    seen.push_back(std::move(frame));
    return true;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return seen;
}

/// Modulus over the one at which a standing bar buckles under its weight (Greenhill: rho g A L^3 / E I = 7.837).
double critical_modulus(const test::released::Released& scene) {
  return scene.theta[scene.layout.density] * 9.81 * 12.0 * std::pow(length, 3) / (7.837 * edge * edge);
}

class Swing : public ::testing::TestWithParam<std::pair<double, double>> {};  // gravity, share of the first guess

/// Bars that hang, lie without weight, and stand at 1.6 times what they need to: in steps that go with the square of
/// the frequency alone the last would swing ever farther off.
TEST_P(Swing, FindsTheModulusWhateverTheWeightDoes) {
  const auto [gravity, off] = GetParam();
  test::released::Released truth = bar_under(gravity, 1.0);
  const double modulus = 1.6 * critical_modulus(truth);
  truth.layout.set_moduli(truth.theta, modulus);
  VectorX theta = truth.theta;
  truth.layout.set_moduli(theta, off * modulus);
  Simulation simulation(truth.body, truth.options);
  const auto start = swing_start(simulation, theta, seen_of(truth));
  ASSERT_TRUE(start.has_value());
  EXPECT_NEAR(start->youngs_modulus / modulus, 1.0, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Weights, Swing,
                         ::testing::Values(std::pair(9.81, 3.0), std::pair(9.81, 0.3), std::pair(0.0, 5.0),
                                           std::pair(0.0, 0.2), std::pair(-9.81, 5.0), std::pair(-9.81, 1.5)));

}  // namespace
}  // namespace pliant::swing_test
