#include "motion/patch_forces.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "motion/simulation.hpp"
#include "support/bodies.hpp"

namespace pliant::patch_forces_test {
namespace {

struct Floating {
  std::shared_ptr<const Body> body = test::box_body({0.2, 0.1, 0.1}, 0.05);
  SimulationOptions options;
  VectorX theta;

  Floating() {
    const MotionLayout layout;
    options.blocks = layout;
    theta = layout.zero();
    theta[layout.youngs_moduli[0]] = 2e4;
    theta[layout.poissons_ratio] = 0.3;
    theta[layout.density] = 500.0;
    for (int frame = 0; frame <= 40; ++frame) options.times.push_back(0.01 * frame);
    options.max_dt = 1e-3;
  }
  double mass() const { return 500.0 * body->volume(); }
  Vector3 momentum(const State& state) const {
    Points p = Points::Zero(body->node_count(), 3);
    body->add_mass_product(500.0, state.v, p);
    return p.colwise().sum().transpose();
  }
  std::vector<State> run() {
    std::vector<State> states;
    const RolloutSummary summary = Simulation(body, options).run(theta, [&](int, const State& state, auto) {
      states.push_back(state);
      return true;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    return states;
  }
  void add(const LedSpringsOptions& grip, const Patch& patch) {
    options.further_forces.push_back([grip, patch](const auto& of) -> std::unique_ptr<ForceTerm> {
      return std::make_unique<LedSprings>(*of, patch, grip);
    });
  }
};

KeyedMotion shift_of(const Vector3& shift, double seconds) {
  KeyFrames<6>::Value there = KeyFrames<6>::Value::Zero();
  there.head<3>() = shift;
  return {Vector3::Zero(), KeyFrames<6>({{0.0, KeyFrames<6>::Value::Zero()}, {seconds, there}})};
}

TEST(Patch, SharesSumToOne) {
  const auto body = test::box_body({0.2, 0.1, 0.1}, 0.05);
  for (const double radius : {0.0, 0.03, 1.0}) {
    const Patch patch = surface_patch(*body, {0.1, 0.0, 0.0}, radius);
    ASSERT_FALSE(patch.rest.empty());
    EXPECT_NEAR(std::accumulate(patch.share.begin(), patch.share.end(), 0.0), 1.0, 1e-12);
  }
  EXPECT_EQ(surface_patch(*body, {0.1, 0.0, 0.0}, 0.0).rest.size(), 1u);
  const RegionPatch none = region_patch(*body, [](const Vector3&) { return false; });
  EXPECT_TRUE(none.patch.rest.empty());
  EXPECT_EQ(none.volume, 0.0);
}

TEST(AppliedForce, GivesTheObjectItsImpulse) {
  Floating scene;
  scene.options.further_forces.push_back([](const auto& of) -> std::unique_ptr<ForceTerm> {
    return std::make_unique<PatchLoad>(*of, surface_patch(*of, {0.1, 0.0, 0.0}, 0.06),
                                       KeyFrames<3>(Vector3(0.2, 0.0, -0.1)));
  });
  const State last = scene.run().back();
  EXPECT_LT((scene.momentum(last) - 0.4 * Vector3(0.2, 0.0, -0.1)).norm(), 1e-6);
}

/// A stiff grip leads what it holds along its motion.
TEST(LedSprings, LeadsWhereItsMotionGoes) {
  Floating scene;
  LedSpringsOptions grip;
  grip.stiffness = 1e5, grip.from_rest = true, grip.motion = shift_of({0.0, 0.15, 0.0}, 0.2);
  std::vector<int> nodes;
  for (int n = 0; n < scene.body->node_count(); ++n)
    if (scene.body->nodes(n, 0) > 0.04) nodes.push_back(n);
  const RegionPatch region = region_patch(*scene.body, [](const Vector3& p) { return p.x() > 0.0375; });
  EXPECT_NEAR(region.volume, 0.0625 * 0.1 * 0.1, 1e-9);
  scene.add(grip, region.patch);
  const State last = scene.run().back();
  for (const int n : nodes) EXPECT_NEAR(last.x(n, 1) - scene.body->nodes(n, 1), 0.15, 0.004);
}

/// It takes hold of what flies by where that is, and lets go with the momentum that it has then.
TEST(LedSprings, TakesHoldAndLetsGo) {
  Floating scene;
  scene.theta.segment<3>(scene.options.blocks.linear_velocity) = Vector3(1.0, 0.0, 0.0);
  LedSpringsOptions grip;
  grip.stiffness = 40.0, grip.from = 0.1, grip.until = 0.2;
  scene.add(grip, surface_patch(*scene.body, {0.1, 0.0, 0.0}, 0.06));
  const std::vector<State> states = scene.run();
  EXPECT_LT((scene.momentum(states[10]) - scene.momentum(states[0])).norm(), 1e-9 * scene.mass());
  // A mass of 1 kg on a spring of 40 N/m that is slack as it takes hold: v = cos(omega t).
  const double omega = std::sqrt(40.0 / scene.mass());
  EXPECT_NEAR(scene.momentum(states[20]).x() / scene.mass(), std::cos(0.1 * omega), 0.03);
  EXPECT_LT((scene.momentum(states[40]) - scene.momentum(states[20])).norm(), 1e-9 * scene.mass());
}

TEST(LedSprings, ReachesForAPlace) {
  Floating scene;
  scene.theta[scene.options.blocks.mass_damping] = 40.0;
  for (double& time : scene.options.times) time *= 5.0;
  LedSpringsOptions grip;
  grip.stiffness = 200.0, grip.reaches = true, grip.motion = shift_of({0.3, 0.1, 0.0}, 0.01);
  const Patch patch = surface_patch(*scene.body, {0.1, 0.0, 0.0}, 0.06);
  scene.add(grip, patch);
  const State last = scene.run().back();
  Vector3 middle = Vector3::Zero();
  const Embedding points(*scene.body, patch.rest);
  for (int i = 0; i < points.point_count(); ++i) middle += patch.share[std::size_t(i)] * points.position(i, last.x);
  EXPECT_LT((middle - Vector3(0.3, 0.1, 0.0)).norm(), 0.003);
}

TEST(LedSprings, RefusesWhatCannotHold) {
  const auto body = test::box_body({0.2, 0.1, 0.1}, 0.05);
  EXPECT_THROW(LedSprings(*body, {{Vector3::Zero()}, {1.0}}, {}), std::invalid_argument);
  LedSpringsOptions stiff;
  stiff.stiffness = 1.0;
  EXPECT_THROW(LedSprings(*body, {}, stiff), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::patch_forces_test
