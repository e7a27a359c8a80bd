#include "motion/simulation.hpp"

#include "support/derivatives.hpp"
#include "support/scenes.hpp"

namespace pliant {
namespace {

VectorX positions_at(Simulation& simulation, const VectorX& theta, int frame) {
  VectorX out;
  const RolloutSummary summary = simulation.run(theta, [&](int f, const State& state, auto) {
    if (f == frame) out = flat(state.x);
    return f < frame;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return out;
}

VectorX relative_scale(const VectorX& theta, int index) {
  VectorX direction = VectorX::Zero(theta.size());
  direction[index] = std::abs(theta[index]) > 0 ? std::abs(theta[index]) : 1.0;
  return direction;
}

class Sensitivity : public ::testing::TestWithParam<int> {};

// Eight frames: free flight, impact and rebound.
TEST_P(Sensitivity, TangentMatchesCentralDifferences) {
  test::TorusScene scene = test::torus_scene(0.032, 8);
  Simulation simulation(scene.body, scene.options);
  const VectorX direction = relative_scale(scene.theta, GetParam());
  VectorX tangent;
  simulation.run(scene.theta, direction, 7, [&](int f, const State&, std::span<const State> tangents) {
    if (f == 7) tangent = flat(tangents[0].x);
    return true;
  });
  ASSERT_GT(tangent.norm(), 1e-9) << "the parameter has no effect: the test would prove nothing";
  const auto along = [&](double h) { return positions_at(simulation, scene.theta + h * direction, 7); };
  EXPECT_LT(test::best_relative_error(along, tangent, 1.0), 1e-5);
}

TEST_P(Sensitivity, AdjointMatchesTangent) {
  test::TorusScene scene = test::torus_scene(0.032, 8);
  Simulation simulation(scene.body, scene.options);
  const VectorX direction = relative_scale(scene.theta, GetParam());
  Points weight = Points::Random(scene.body->node_count(), 3);
  double by_tangent = 0.0;
  simulation.run(scene.theta, direction, 7, [&](int f, const State&, std::span<const State> tangents) {
    if (f % 4 == 3) by_tangent += weight.cwiseProduct(tangents[0].x).sum();
    return true;
  });
  VectorX gradient;
  const auto summary = simulation.run_adjoint(
      scene.theta, 7, [](int, const State&) { return true; },
      [&](int f, const State&, Points& bar) {
        if (f % 4 == 3) bar += weight;
      },
      gradient);
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  EXPECT_NEAR(gradient.dot(direction), by_tangent, 1e-9 * std::abs(by_tangent));
}

INSTANTIATE_TEST_SUITE_P(EveryParameter, Sensitivity, ::testing::Range(0, theta::size(1)));

TEST(Simulation, CheckpointedAdjointIsTheSame) {
  test::TorusScene scene = test::torus_scene(0.032, 20);
  const auto gradient = [&](std::size_t budget, std::size_t& peak) {
    scene.options.memory_budget = budget;
    Simulation simulation(scene.body, scene.options);
    VectorX theta_bar;
    const auto summary = simulation.run_adjoint(
        scene.theta, 19, [](int, const State&) { return true; },
        [](int, const State& state, Points& bar) { bar += state.x; }, theta_bar);
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    peak = simulation.peak_state_bytes();
    return theta_bar;
  };
  std::size_t all = 0, few = 0;
  const VectorX kept = gradient(std::size_t(1) << 30, all), replayed = gradient(0, few);
  EXPECT_LT((kept - replayed).norm(), 1e-12 * kept.norm());
  EXPECT_LT(few, all / 3) << "76 steps need about 2 sqrt(76) states";
}

}  // namespace
}  // namespace pliant
