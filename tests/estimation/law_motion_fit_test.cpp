// A law found from a motion: points followed on a swinging bar, made on a finer mesh with shorter steps.
#include <random>

#include "estimation/objective.hpp"
#include "estimation/optimiser.hpp"
#include "estimation/press_law.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::law_motion_fit_test {
namespace {

constexpr double modulus = 2e4, exponent = 9.0, nu = 0.3, noise = 1e-4;
constexpr int frames = 12;

/// A bar of 0.2 x 0.05 x 0.05 m of quadratic tetrahedra, held at one end and thrown along and across: it is stretched
/// and compressed as it swings.
struct SwingingLaw {
  explicit SwingingLaw(const Eigen::Vector3i& cells, double dt)
      : body(test::tet_body({0.2, 0.05, 0.05}, cells, true, 0.05)) {
    for (int f = 0; f < frames; ++f) options.times.push_back(0.008 * f);
    options.max_dt = dt;
    options.newmark_theta = 0.5;
    options.holds = {Hold{[](const Vector3& p) { return p.x() < -0.0999; }}};
    const MotionBlocks blocks = add_motion_blocks(layout, {});
    law = LawLayout::of_motion(layout, blocks, {1, 1});
    options.blocks = blocks;
    options.material.elastic = law;
    theta = VectorX::Zero(layout.size());
    theta[law.modulus(0)] = modulus;
    theta[law.poissons_ratio()] = nu;
    theta[law.exponent(0)] = exponent;
    theta[blocks.density] = 100.0;
    theta[blocks.stiffness_damping] = 2e-4;
    theta.segment<3>(blocks.gravity) = Vector3(0.0, -9.81, 0.0);
    theta.segment<3>(blocks.linear_velocity) = Vector3(0.8, 1.2, 0.0);
  }
  std::shared_ptr<const Body> body;
  ParameterLayout layout;
  LawLayout law;
  SimulationOptions options;
  VectorX theta;
};

struct Fitted {
  double modulus, exponent, modulus_std, exponent_std;
};

/// @param of  whose motion is seen
Fitted fit_motion(const SwingingLaw& of, double seen_noise) {
  std::vector<Vector3> rest;
  for (const double x : {-0.05, 0.0, 0.05, 0.1})
    for (const double y : {-0.025, 0.025})
      for (const double z : {-0.025, 0.025}) rest.emplace_back(x, y, z);
  const PointTracks seen(*of.body, rest);
  auto observations = std::make_shared<std::vector<FrameObservations>>();
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Simulation simulation(of.body, of.options);
  const Embedding points(*of.body, rest);
  const auto made = simulation.run(of.theta, [&](int f, const State& state, auto) {
    FrameObservations frame{f};
    for (int i = 0; i < points.point_count(); ++i)
      frame.tracks.push_back(
          {i, points.position(i, state.x) + seen_noise * Vector3(normal(random), normal(random), normal(random)),
           noise});
    observations->push_back(std::move(frame));
    return true;
  });
  EXPECT_TRUE(made.succeeded) << made.failure;

  SwingingLaw fitting({6, 2, 2}, 0.004);
  fitting.theta[fitting.law.modulus(0)] = 1.3 * modulus;
  fitting.theta[fitting.law.exponent(0)] = 4.0;
  std::vector<Parameter> list = {
      {"youngs_modulus", "Pa", Transform::Logarithm, fitting.law.modulus(0), 1.0, 1.0, 1e7, true},
      {"exponent_1", "1", Transform::Shift, fitting.law.exponent(0), 4.0, -60.0, 60.0, true}};
  ParameterSet set(fitting.layout, std::move(list), fitting.theta);
  const VectorX start = set.to_unconstrained(fitting.theta);
  ObjectiveOptions o;
  o.outlier_scale = 0.1;
  o.last_frame = frames - 1;
  Objective objective({nullptr, std::make_shared<PointTracks>(*fitting.body, rest)}, fitting.body, fitting.options,
                      observations, set, o);
  const OptimiserSummary summary = minimise(objective, start, {.step_tolerance = 1e-5, .cost_tolerance = 1e-8});
  EXPECT_TRUE(summary.succeeded && summary.converged) << summary.reason;
  const VectorX found = set.to_theta(summary.p);
  const MatrixX covariance = summary.evaluation.gauss_newton.inverse();
  return {found[fitting.law.modulus(0)], found[fitting.law.exponent(0)], modulus * std::sqrt(covariance(0, 0)),
          4.0 * std::sqrt(covariance(1, 1))};
}

/// By the model that fits it nothing but the noise of 0.1 mm is between the truth and what is found.
TEST(LawMotionFit, FindsModulusAndExponentUpToTheNoise) {
  const Fitted found = fit_motion(SwingingLaw({6, 2, 2}, 0.004), noise);
  EXPECT_LT(found.exponent_std, 0.2);
  EXPECT_LT(found.modulus_std, 0.01 * modulus);
  EXPECT_NEAR(found.modulus, modulus, 3.0 * found.modulus_std);
  EXPECT_NEAR(found.exponent, exponent, 3.0 * found.exponent_std);
}

/// On another mesh and with a quarter of the step.
TEST(LawMotionFit, FindsModulusAndExponentOfAFinerModel) {
  const Fitted found = fit_motion(SwingingLaw({9, 3, 3}, 0.001), noise);
  EXPECT_NEAR(found.modulus, modulus, 0.03 * modulus);
  EXPECT_NEAR(found.exponent, exponent, 0.1 * exponent);
}

}  // namespace
}  // namespace pliant::law_motion_fit_test
