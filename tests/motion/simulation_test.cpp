#include "motion/simulation.hpp"

#include "base/parallel.hpp"
#include "support/derivatives.hpp"
#include "support/scenes.hpp"
#include "support/tolerance.hpp"

namespace pliant::simulation_test {
namespace {

using test::tolerance;

constexpr int last = 4;  // four frames: free flight, impact and rebound
constexpr double cell_size = 0.04;

test::TorusScene scene_for(int frames = last + 1, Integrator integrator = Integrator::Lagged) {
  test::TorusScene scene = test::torus_scene(cell_size, frames);
  scene.options.integrator = integrator;
  scene.options.newton.tolerance = 1e-13;
  return scene;
}

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

TEST(Simulation, SceneFliesHitsAndReturns) {
  test::TorusScene scene = scene_for();
  Simulation simulation(scene.body, scene.options);
  std::vector<double> speed;
  simulation.run(scene.theta, [&](int, const State& state, auto) {
    speed.push_back(state.v.col(1).mean());
    return true;
  });
  EXPECT_LT(speed[0], -1.4);
  EXPECT_GT(speed[last], -0.3) << "the sensitivities below would not see the contact";
}

/// A parameter of theta, and the integrator.
class Sensitivity : public ::testing::TestWithParam<std::tuple<int, Integrator>> {
 protected:
  Sensitivity() : scene(scene_for(last + 1, std::get<1>(GetParam()))) {
    scene.options.friction_speed = 0.2;  // the plane is rough
    scene.theta[scene.layout.planes[0].friction] = 0.3;
    scene.theta[scene.layout.contact_stiffness] = scene.options.contact.stiffness;
  }
  int index() const { return std::get<0>(GetParam()); }
  test::TorusScene scene;
};

TEST_P(Sensitivity, TangentMatchesCentralDifferences) {
  Simulation simulation(scene.body, scene.options);
  const VectorX direction = relative_scale(scene.theta, index());
  VectorX tangent;
  simulation.run(scene.theta, direction, last, [&](int f, const State&, std::span<const State> tangents) {
    if (f == last) tangent = flat(tangents[0].x);
    return true;
  });
  ASSERT_GT(tangent.norm(), 1e-9) << "the parameter has no effect: the test would prove nothing";
  const auto along = [&](double h) { return positions_at(simulation, scene.theta + h * direction, last); };
  // Bottom of the V between the differences' h^2 and the solver's tolerance / h.
  EXPECT_LT(test::best_relative_error(along, tangent, 1.0), tolerance(1e-6));
}

TEST_P(Sensitivity, AdjointMatchesTangent) {
  Simulation simulation(scene.body, scene.options);
  const VectorX direction = relative_scale(scene.theta, index());
  const Points weight = test::deformed(scene.body->reference_positions(), 0.3);
  double by_tangent = 0.0;
  simulation.run(scene.theta, direction, last, [&](int f, const State&, std::span<const State> tangents) {
    if (f % 2 == 0) by_tangent += weight.cwiseProduct(tangents[0].x).sum();
    return true;
  });
  ASSERT_NE(by_tangent, 0.0);
  VectorX gradient;
  const auto summary = simulation.run_adjoint(
      scene.theta, last, [](int, const State&) { return true; },
      [&](int f, const State&, Points& bar) {
        if (f % 2 == 0) bar += weight;
      },
      gradient);
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  // Nothing but rounding and the solver's tolerance of 1e-13 lies between the two.
  EXPECT_NEAR(gradient.dot(direction), by_tangent, tolerance(1e-9) * std::abs(by_tangent));
}

INSTANTIATE_TEST_SUITE_P(EveryParameter, Sensitivity,
                         ::testing::Combine(::testing::Range(0, MotionLayout({.planes = 1}).size()),
                                            ::testing::Values(Integrator::Lagged, Integrator::Newton)));

/// Fits solve for derivatives less exactly than for steps, by either integrator, in both directions.
TEST(Simulation, DerivativesAreAsExactAsAskedFor) {
  for (const Integrator integrator : {Integrator::Lagged, Integrator::Newton}) {
    test::TorusScene scene = scene_for(last + 1, integrator);
    const VectorX direction = relative_scale(scene.theta, scene.layout.youngs_moduli[0].first);
    const Points weight = test::deformed(scene.body->reference_positions(), 0.3);
    std::vector<Points> ends, tangents;
    std::vector<double> gradients;
    for (const double asked : {0.0, 1e-5}) {
      scene.options.solver.derivative_tolerance = asked;
      Simulation simulation(scene.body, scene.options);
      simulation.run(scene.theta, direction, last, [&](int f, const State& state, std::span<const State> changes) {
        if (f == last) ends.push_back(state.x), tangents.push_back(changes[0].x);
        return true;
      });
      VectorX gradient;
      const auto summary = simulation.run_adjoint(
          scene.theta, last, [](int, const State&) { return true; },
          [&](int f, const State&, Points& bar) {
            if (f == last) bar += weight;
          },
          gradient);
      ASSERT_TRUE(summary.succeeded) << summary.failure;
      gradients.push_back(gradient.dot(direction));
    }
    EXPECT_EQ(ends[0], ends[1]);
    EXPECT_LT((tangents[1] - tangents[0]).norm(), 1e-3 * tangents[0].norm());
    EXPECT_NEAR(gradients[1], gradients[0], 1e-3 * std::abs(gradients[0]));
    EXPECT_NE(tangents[1], tangents[0]);
    EXPECT_NE(gradients[1], gradients[0]);
  }
}

/// One step a frame is too long for an impact: the steps in which nodes leap are taken in halves, and both derivatives
/// follow them.
TEST(Simulation, StepsThatAreTooLongAreHalved) {
  test::TorusScene scene = scene_for();
  const int as_planned = [&] {
    Simulation simulation(scene.body, scene.options);
    return simulation.run(scene.theta, [](int, const State&, auto) { return true; }).steps;
  }();
  EXPECT_GE(as_planned, last);
  scene.options.max_dt = 1.0;
  scene.theta.segment<3>(scene.layout.linear_velocity) *= 3.0;
  Simulation simulation(scene.body, scene.options);
  const VectorX direction = relative_scale(scene.theta, scene.layout.youngs_moduli[0].first);
  const Points weight = test::deformed(scene.body->reference_positions(), 0.3);
  double by_tangent = 0.0;
  const RolloutSummary run =
      simulation.run(scene.theta, direction, last, [&](int f, const State& state, std::span<const State> tangents) {
        EXPECT_LT(state.x.cwiseAbs().maxCoeff(), 2.0) << "it does not explode";
        if (f == last) by_tangent = weight.cwiseProduct(tangents[0].x).sum();
        return true;
      });
  ASSERT_TRUE(run.succeeded) << run.failure;
  EXPECT_GT(run.steps, last) << "some were halved";
  VectorX gradient;
  const RolloutSummary reverse = simulation.run_adjoint(
      scene.theta, last, [](int, const State&) { return true; },
      [&](int f, const State&, Points& bar) {
        if (f == last) bar += weight;
      },
      gradient);
  ASSERT_TRUE(reverse.succeeded) << reverse.failure;
  EXPECT_EQ(reverse.steps, run.steps);
  EXPECT_NEAR(gradient.dot(direction), by_tangent, tolerance(1e-9) * std::abs(by_tangent));
}

/// Two schemes of one equation: their difference vanishes with the step, the fully implicit one's own error too.
/// Two steppers take the steps of a run with tangents in turns, and threads share the directions.
TEST(Simulation, TangentsChangeNoBitOfTheMotionAndThreadsNoneOfTheTangents) {
  const test::TorusScene scene = test::torus_scene(0.04, 4);
  const MatrixX directions = MatrixX::Identity(scene.theta.size(), scene.theta.size()).leftCols(9);
  struct Frame {
    Points x;
    std::vector<Points> tangents;
  };
  const auto frames_of = [&](const MatrixX& along) {
    std::vector<Frame> frames;
    Simulation simulation(scene.body, scene.options);
    const RolloutSummary summary =
        simulation.run(scene.theta, along, 3, [&](int, const State& state, std::span<const State> tangents) {
          frames.push_back({state.x, {}});
          for (const State& t : tangents) frames.back().tangents.push_back(t.x);
          return true;
        });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    EXPECT_EQ(summary.frames, 4);
    return frames;
  };
  const std::vector<Frame> alone = frames_of(MatrixX(scene.theta.size(), 0)), with = frames_of(directions);
  std::vector<Frame> in_one_thread;
  {
    const ThreadLimit limit(1);
    in_one_thread = frames_of(directions);
  }
  ASSERT_EQ(alone.size(), 4u);
  ASSERT_EQ(with.size(), 4u);
  ASSERT_EQ(in_one_thread.size(), 4u);
  for (std::size_t f = 0; f < 4; ++f) {
    EXPECT_EQ(alone[f].x, with[f].x) << f;
    ASSERT_EQ(with[f].tangents.size(), 9u);
    for (std::size_t c = 0; c < 9; ++c) EXPECT_EQ(with[f].tangents[c], in_one_thread[f].tangents[c]) << f << ' ' << c;
  }
  EXPECT_GT(with[3].tangents[0].norm(), 0.0);
}

TEST(Simulation, ARunWithTangentsEndsWhereItsFramesSay) {
  const test::TorusScene scene = test::torus_scene(0.04, 4);
  const MatrixX directions = MatrixX::Identity(scene.theta.size(), scene.theta.size()).leftCols(5);
  int seen = 0;
  const auto until_second = [&](int frame, const State&, std::span<const State>) { return ++seen, frame < 2; };
  Simulation simulation(scene.body, scene.options);
  const RolloutSummary with = simulation.run(scene.theta, directions, 3, until_second);
  EXPECT_EQ(seen, 3);
  const RolloutSummary without = simulation.run(scene.theta, MatrixX(scene.theta.size(), 0), 3, until_second);
  EXPECT_TRUE(with.succeeded && without.succeeded);
  EXPECT_EQ(with.frames, without.frames);
  EXPECT_EQ(with.steps, without.steps) << "one that was taken in vain does not count";
}

TEST(Simulation, BothIntegratorsAgreeAsStepsShrink) {
  const auto difference = [](double share) {
    std::array<VectorX, 2> x;
    for (const Integrator integrator : {Integrator::Lagged, Integrator::Newton}) {
      test::TorusScene scene = scene_for(3, integrator);
      scene.theta.segment<3>(scene.layout.planes[0].point).y() -= 1.0;  // in flight: impacts are not smooth
      scene.theta.segment<3>(scene.layout.angular_velocity) *= 5.0;
      scene.options.max_dt *= share;
      scene.options.newmark_theta = 0.5;
      Simulation simulation(scene.body, scene.options);
      x[std::size_t(integrator)] = positions_at(simulation, scene.theta, 2);
    }
    return (x[0] - x[1]).norm();
  };
  const double coarse = difference(1.0), fine = difference(0.25);
  ASSERT_GT(coarse, 1e-9);
  EXPECT_GT(coarse / fine, 9.0) << "second order: sixteen";
}

TEST(Simulation, CheckpointedAdjointIsTheSame) {
  test::TorusScene scene = scene_for(13);
  const auto gradient = [&](std::size_t budget, std::size_t& peak) {
    scene.options.memory_budget = budget;
    Simulation simulation(scene.body, scene.options);
    VectorX theta_bar;
    const auto summary = simulation.run_adjoint(
        scene.theta, 12, [](int, const State&) { return true; },
        [](int, const State& state, Points& bar) { bar += state.x; }, theta_bar);
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    peak = simulation.peak_state_bytes();
    return theta_bar;
  };
  std::size_t all = 0, few = 0;
  const VectorX kept = gradient(std::size_t(1) << 30, all), replayed = gradient(0, few);
  EXPECT_LT((kept - replayed).norm(), tolerance(1e-12) * kept.norm());
  EXPECT_LT(few, all / 3 + 1) << "48 steps need about 2 sqrt(48) states";
}

TEST(Simulation, EverySolverGivesTheSameMotion) {
  VectorX reference;
  for (const SolverKind kind : {SolverKind::Iterative, SolverKind::Simplicial, SolverKind::Cholmod}) {
    test::TorusScene scene = test::torus_scene(cell_size, last + 1, kind);
    Simulation simulation(scene.body, scene.options);
    const VectorX x = positions_at(simulation, scene.theta, last);
    if (reference.size() == 0) reference = x;
    EXPECT_LT((x - reference).norm(), tolerance(1e-10) * reference.norm());
  }
}

}  // namespace
}  // namespace pliant::simulation_test
