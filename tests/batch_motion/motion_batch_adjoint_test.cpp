#include <algorithm>
#include <functional>

#include "batch_motion/motion_batch.hpp"
#include "batch_scenes.hpp"
#include "support/tolerance.hpp"

namespace pliant::motion_batch_adjoint_test {
namespace {

using test::BatchScene;
using test::tolerance;

constexpr double solver_tolerance = 1e-12;
const std::vector<int> at = {0, 5, 12};
constexpr int steps = 12;

/// Weights of positions and velocities in the cost: generic.
State weights(const Body& body, int step) {
  State w{Points(body.node_count(), 3), Points(body.node_count(), 3)};
  for (Eigen::Index n = 0; n < w.x.rows(); ++n)
    for (int d = 0; d < 3; ++d) {
      w.x(n, d) = std::sin(1.0 + 0.7 * double(n) + d + 0.3 * step);
      w.v(n, d) = 0.02 * std::cos(2.0 + 0.4 * double(n) + 1.7 * d + step);
    }
  return w;
}
double cost_of(const Body& body, int step, const State& state) {
  const State w = weights(body, step);
  return w.x.cwiseProduct(state.x).sum() + 5.0 * state.x.cwiseProduct(w.x).cwiseProduct(state.x).sum() +
         w.v.cwiseProduct(state.v).sum();
}
void add_cost_cotangent(const Body& body, int step, const State& state, State& bar) {
  const State w = weights(body, step);
  bar.x += w.x + 10.0 * w.x.cwiseProduct(state.x);
  bar.v += w.v;
}

struct Swept {
  std::vector<double> costs;
  std::vector<BatchGradient> gradients;
};
/// Costs and gradients of members.
Swept sweep(const BatchScene& scene, const std::vector<BatchMember>& members,
            std::size_t memory_budget = std::size_t(1) << 30) {
  BatchOptions options = scene.options;
  options.tolerance = solver_tolerance;
  options.memory_budget = memory_budget;
  MotionBatch batch(scene.body, options, int(members.size()));
  for (std::size_t k = 0; k < members.size(); ++k) batch.set_member(int(k), members[k]);
  Swept swept;
  swept.costs.assign(members.size(), 0.0);
  const std::vector<BatchRun> runs = batch.run_adjoint(
      steps, at,
      [&](int step, std::span<const State> states) {
        for (std::size_t k = 0; k < states.size(); ++k) swept.costs[k] += cost_of(*scene.body, step, states[k]);
      },
      [&](int step, std::span<const State> states, std::span<State> bars) {
        for (std::size_t k = 0; k < states.size(); ++k) add_cost_cotangent(*scene.body, step, states[k], bars[k]);
      },
      swept.gradients);
  for (const BatchRun& run : runs) EXPECT_TRUE(run.succeeded);
  return swept;
}

/// One number of a member, how it is changed, and its derivative.
struct Number {
  std::string name;
  double size;  ///< of a change that matters
  std::function<void(BatchMember&, double)> add;
  std::function<double(const BatchGradient&)> derivative;
};
std::vector<Number> numbers(const BatchScene& scene) {
  const BatchMember& m = scene.member;
  std::vector<Number> list = {
      {"youngs_modulus", m.youngs_modulus, [](BatchMember& k, double h) { k.youngs_modulus += h; },
       [](const BatchGradient& g) { return g.youngs_modulus; }},
      {"poissons_ratio", 0.3, [](BatchMember& k, double h) { k.poissons_ratio += h; },
       [](const BatchGradient& g) { return g.poissons_ratio; }},
      {"mass_damping", 1.0, [](BatchMember& k, double h) { k.mass_damping += h; },
       [](const BatchGradient& g) { return g.mass_damping; }},
      {"stiffness_damping", 0.003, [](BatchMember& k, double h) { k.stiffness_damping += h; },
       [](const BatchGradient& g) { return g.stiffness_damping; }},
      {"density", m.density, [](BatchMember& k, double h) { k.density += h; },
       [](const BatchGradient& g) { return g.density; }}};
  for (int d = 0; d < 3; ++d)
    list.push_back({"gravity", 1.0, [d](BatchMember& k, double h) { k.gravity[d] += h; },
                    [d](const BatchGradient& g) { return g.gravity[d]; }});
  for (const Eigen::Index n : {7, 20})
    for (int d = 0; d < 3; ++d) {
      list.push_back({"start.x", 0.01, [=](BatchMember& k, double h) { k.start.x(n, d) += h; },
                      [=](const BatchGradient& g) { return g.start.x(n, d); }});
      list.push_back({"start.v", 1.0, [=](BatchMember& k, double h) { k.start.v(n, d) += h; },
                      [=](const BatchGradient& g) { return g.start.v(n, d); }});
    }
  if (!scene.options.with_plane) return list;
  for (int d = 0; d < 3; ++d) {
    list.push_back({"plane_point", 0.01, [d](BatchMember& k, double h) { k.plane_point[d] += h; },
                    [d](const BatchGradient& g) { return g.plane_point[d]; }});
    list.push_back({"plane_normal", 0.1, [d](BatchMember& k, double h) { k.plane_normal[d] += h; },
                    [d](const BatchGradient& g) { return g.plane_normal[d]; }});
  }
  list.push_back({"friction", 0.3, [](BatchMember& k, double h) { k.friction += h; },
                  [](const BatchGradient& g) { return g.friction; }});
  list.push_back({"contact_stiffness", m.contact_stiffness, [](BatchMember& k, double h) { k.contact_stiffness += h; },
                  [](const BatchGradient& g) { return g.contact_stiffness; }});
  return list;
}

/// Differences of fourth order, whose error is that of the costs, some thousands of the solver's tolerance, over h.
void expect_gradient_of_differences(const BatchScene& scene) {
  constexpr double h = 1e-4, by_costs = 1e-7;
  const std::vector<Number> list = numbers(scene);
  std::vector<BatchMember> members(4 * list.size() + 1, scene.member);
  for (std::size_t k = 0; k < list.size(); ++k)
    for (const int i : {0, 1, 2, 3}) {
      constexpr double at_steps[] = {-2.0, -1.0, 1.0, 2.0};
      list[k].add(members[4 * k + std::size_t(i)], at_steps[i] * h * list[k].size);
    }
  const Swept swept = sweep(scene, members);
  for (std::size_t k = 0; k < list.size(); ++k) {
    const double* cost = &swept.costs[4 * k];
    const double difference = (8.0 * (cost[2] - cost[1]) - (cost[3] - cost[0])) / (12.0 * h);
    const double derivative = list[k].derivative(swept.gradients.back()) * list[k].size;
    EXPECT_GT(std::abs(difference), 100.0 * by_costs) << list[k].name;  // the number matters
    EXPECT_NEAR(derivative, difference, tolerance(1e-5) * std::abs(difference) + tolerance(by_costs)) << list[k].name;
  }
}

TEST(MotionBatchAdjoint, GradientOfHexahedraInContactIsThatOfDifferences) {
  expect_gradient_of_differences(test::batch_torus(0.05));
}
TEST(MotionBatchAdjoint, GradientOfHeldTetrahedraIsThatOfDifferences) {
  expect_gradient_of_differences(test::batch_bar({6, 2, 2}));
}

TEST(MotionBatchAdjoint, GradientIsTheSimulations) {
  for (const BatchScene& scene : {test::batch_torus(0.05), test::batch_bar({6, 2, 2})}) {
    std::vector<BatchMember> members;
    for (int k = 0; k < 3; ++k) members.push_back(scene.other(2 * k));
    const Swept swept = sweep(scene, members);
    for (std::size_t k = 0; k < members.size(); ++k) {
      Simulation simulation = scene.simulation(members[k], steps, 1e-13);
      VectorX bar;
      NodeCotangents nodes;
      double cost = 0.0;
      // The simulation's costs are of positions: these leave velocities out.
      const auto position_cost = [&](int step, const State& state) {
        if (std::ranges::find(at, step) != at.end()) cost += cost_of(*scene.body, step, state);
        return true;
      };
      ASSERT_TRUE(simulation
                      .run_adjoint(
                          scene.theta(members[k]), steps, position_cost,
                          [&](int step, const State& state, Points& x_bar) {
                            State own{Points::Zero(x_bar.rows(), 3), Points::Zero(x_bar.rows(), 3)};
                            if (std::ranges::find(at, step) != at.end())
                              add_cost_cotangent(*scene.body, step, state, own);
                            x_bar += own.x;
                          },
                          bar, &nodes)
                      .succeeded);
      // The same without velocities in the batch.
      BatchOptions options = scene.options;
      options.tolerance = solver_tolerance;
      MotionBatch batch(scene.body, options, 1);
      batch.set_member(0, members[k]);
      std::vector<BatchGradient> gradients;
      batch.run_adjoint(
          steps, at, {},
          [&](int step, std::span<const State> states, std::span<State> bars) {
            add_cost_cotangent(*scene.body, step, states[0], bars[0]);
            bars[0].v.setZero();
          },
          gradients);
      const BatchGradient& g = gradients.front();
      const auto near = [](double a, double b, const char* name) {
        EXPECT_NEAR(a, b, tolerance(1e-7) * std::abs(b) + tolerance(1e-12)) << name;
      };
      EXPECT_NEAR(swept.costs[k], cost, tolerance(1e-9) * std::abs(cost));
      const MotionLayout& layout = scene.layout;
      near(g.youngs_modulus, bar[layout.youngs_moduli[0]], "youngs_modulus");
      near(g.poissons_ratio, bar[layout.poissons_ratio], "poissons_ratio");
      near(g.mass_damping, bar[layout.mass_damping], "mass_damping");
      near(g.stiffness_damping, bar[layout.stiffness_damping], "stiffness_damping");
      near(g.density, bar[layout.density], "density");
      for (int d = 0; d < 3; ++d) near(g.gravity[d], bar[layout.gravity.first + d], "gravity");
      EXPECT_LT((g.start.v - nodes.start_velocities).norm(), tolerance(1e-7) * nodes.start_velocities.norm());
      if (scene.options.held.empty()) {
        EXPECT_LT((g.start.x - nodes.start).norm(), tolerance(1e-7) * nodes.start.norm());
      }
      for (const PlaneBlock& plane : layout.planes) {
        for (int d = 0; d < 3; ++d) {
          near(g.plane_point[d], bar[plane.point.first + d], "plane_point");
          near(g.plane_normal[d], bar[plane.normal.first + d], "plane_normal");
        }
        near(g.friction, bar[plane.friction], "friction");
        near(g.contact_stiffness, bar[plane.stiffness], "contact_stiffness");
      }
    }
  }
}

TEST(MotionBatchAdjoint, ASmallMemoryGivesTheSameGradient) {
  const BatchScene torus = test::batch_torus(0.05);
  const std::vector<BatchMember> members = {torus.member, torus.other(2)};
  const Swept kept = sweep(torus, members), again = sweep(torus, members, 0);
  for (std::size_t k = 0; k < members.size(); ++k) {
    // Rotations are looked for from others: they differ by rounding.
    EXPECT_NEAR(kept.gradients[k].youngs_modulus, again.gradients[k].youngs_modulus,
                tolerance(1e-9) * std::abs(kept.gradients[k].youngs_modulus));
    EXPECT_LT((kept.gradients[k].start.x - again.gradients[k].start.x).norm(),
              tolerance(1e-9) * kept.gradients[k].start.x.norm());
  }
}

TEST(MotionBatchAdjoint, AMembersGradientDoesNotDependOnThoseBesideIt) {
  const BatchScene torus = test::batch_torus(0.05);
  std::vector<BatchMember> members;
  for (int k = 0; k < 11; ++k) members.push_back(torus.other(k));
  const Swept all = sweep(torus, members);
  for (const std::size_t k : {std::size_t(0), std::size_t(10)}) {
    const Swept alone = sweep(torus, {members[k]});
    EXPECT_EQ(alone.gradients[0].youngs_modulus, all.gradients[k].youngs_modulus);
    EXPECT_EQ(alone.gradients[0].friction, all.gradients[k].friction);
    EXPECT_EQ(alone.gradients[0].start.x, all.gradients[k].start.x);
  }
}

}  // namespace
}  // namespace pliant::motion_batch_adjoint_test
