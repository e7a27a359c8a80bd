#include "motion/wind.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/primitives.hpp"
#include "motion/simulation.hpp"
#include "support/bodies.hpp"

namespace pliant::wind_test {
namespace {

/// Force on a body at rest in a wind [N].
Vector3 drag(const Body& body, const TriangleMesh& surface, const Vector3& velocity, const WindOptions& options = {}) {
  const MotionLayout layout({.wind = true});
  Wind wind(body, surface, options, layout.wind);
  VectorX theta = layout.zero();
  theta.segment<3>(layout.wind) = velocity;
  wind.set_parameters(theta);
  const Points still = Points::Zero(body.node_count(), 3);
  wind.begin_step({&body.nodes, &still, 0.0, 1e-3});
  wind.linearise(body.nodes);
  Points force = Points::Zero(body.node_count(), 3);
  wind.add_force(body.nodes, force);
  return force.colwise().sum().transpose();
}

TEST(Wind, PushesAPlateByItsDragCoefficient) {
  const Vector3 size(0.4, 0.02, 0.3);
  const auto body = test::tet_body(size, {4, 1, 3}, false);
  WindOptions options;
  options.tangential = 0.0;
  const Vector3 force = drag(*body, make_box(size, 0.05), {0.0, -7.0, 0.0}, options);
  EXPECT_LT((force - Vector3(0.0, -0.5 * 1.2 * 1.2 * 0.4 * 0.3 * 49.0, 0.0)).norm(), 1e-12);
  // Aslant the pressure goes with the square of the cosine.
  const double c = std::cos(0.6), s = std::sin(0.6);
  const Vector3 aslant = drag(*body, make_box(size, 0.05), 7.0 * Vector3(0.0, -c, s), options);
  EXPECT_NEAR(aslant.y(), c * c * force.y(), 1e-12);
  // Along it there is friction on both faces alone, but for its edges.
  options.tangential = 0.01, options.normal = 0.0;
  const Vector3 along = drag(*body, make_box(size, 0.05), {5.0, 0.0, 0.0}, options);
  EXPECT_NEAR(along.x(), 0.5 * 1.2 * 0.01 * (2.0 * 0.4 * 0.3 + 2.0 * 0.4 * 0.02) * 25.0, 1e-6);
}

TEST(Wind, PushesABallByHalfTheCoefficientOfAPlate) {
  const double radius = 0.1;
  const auto body = std::make_shared<Body>(make_body(test::sphere_grid(radius, 0.04)));
  WindOptions options;
  options.tangential = 0.0;
  const Vector3 force = drag(*body, make_sphere(radius, 4), {0.0, 0.0, 6.0}, options);
  EXPECT_NEAR(force.z(), 0.5 * 1.2 * 0.6 * std::numbers::pi * radius * radius * 36.0, 0.01 * force.z());
  EXPECT_LT(std::hypot(force.x(), force.y()), 1e-3 * force.z());
}

/// A plate that falls flat: m dv/dt = m g - c v^2, so v = v_t tanh(g t / v_t).
TEST(Wind, BrakesAFallToItsTerminalVelocity) {
  const Vector3 size(0.4, 0.02, 0.4);
  const auto body = test::tet_body(size, {4, 1, 4}, false);
  const TriangleMesh surface = make_box(size, 0.1);
  const double density = 30.0, g = 9.81;
  SimulationOptions options;
  const MotionLayout layout({.wind = true});
  options.blocks = layout;
  VectorX theta = layout.zero();
  theta[layout.youngs_moduli[0]] = 1e7;
  theta[layout.poissons_ratio] = 0.3;
  theta[layout.density] = density;
  theta.segment<3>(layout.gravity) = Vector3(0.0, -g, 0.0);
  for (int frame = 0; frame <= 20; ++frame) options.times.push_back(0.05 * frame);
  options.max_dt = 5e-3;
  WindOptions air;
  air.tangential = 0.0;
  options.further_forces.push_back([&](const auto& of) -> std::unique_ptr<ForceTerm> {
    return std::make_unique<Wind>(*of, surface, air, layout.wind);
  });
  const double terminal = std::sqrt(density * size.y() * g / (0.5 * air.air_density * air.normal));
  double worst = 0.0, last = 0.0;
  const RolloutSummary summary = Simulation(body, options).run(theta, [&](int frame, const State& state, auto) {
    last = -state.v.col(1).mean();
    worst = std::max(worst, std::abs(last - terminal * std::tanh(g * options.times[std::size_t(frame)] / terminal)));
    return true;
  });
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  EXPECT_LT(worst, 0.01 * terminal);
  EXPECT_NEAR(last, terminal, 0.01 * terminal);
}

TEST(Gusts, HaveTheirVarianceAndSpectrum) {
  const Vector3 mean(8.0, 0.0, 0.0);
  const double intensity = 0.2, length = 4.0;
  double along = 0.0, across = 0.0, above = 0.0, slow = 0.0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Gusts gusts(mean, Vector3::UnitY(), intensity, length, seed);
    // Averages over 0.25 s keep what is slower than about 2 Hz.
    for (double time = 0.0; time < 60.0; time += 0.25) {
      Vector3 average = Vector3::Zero();
      for (int k = 0; k < 10; ++k) average += 0.1 * gusts.at(time + 0.025 * k);
      const Vector3 v = gusts.at(time);
      along += v.x() * v.x(), across += v.z() * v.z(), above += v.y() * v.y(), slow += average.x() * average.x();
      ++count;
    }
  }
  const double sigma = intensity * mean.norm();
  EXPECT_NEAR(std::sqrt(along / count), sigma, 0.03 * sigma);
  EXPECT_NEAR(std::sqrt(across / count), 0.8 * sigma, 0.03 * sigma);
  EXPECT_NEAR(std::sqrt(above / count), 0.5 * sigma, 0.03 * sigma);
  // Of Kaimal's spectrum: the integral of S(f) times that of the average, sinc^2(pi f T).
  double expected = 0.0;
  for (double f = 5e-4; f < 200.0; f *= 1.002) {
    const double a = 10.3 * f * length / mean.norm(), x = std::numbers::pi * f * 0.25;
    expected += 0.002 * sigma * sigma * (2.0 / 3.0) * a / std::pow(1.0 + a, 5.0 / 3.0) * std::pow(std::sin(x) / x, 2);
  }
  EXPECT_NEAR(slow / count, expected, 0.05 * expected);
}

TEST(Gusts, AreTheSameForTheSameSeed) {
  const Gusts one({5, 0, 1}, Vector3::UnitY(), 0.3, 2.0, 3), same({5, 0, 1}, Vector3::UnitY(), 0.3, 2.0, 3),
      other({5, 0, 1}, Vector3::UnitY(), 0.3, 2.0, 4);
  EXPECT_EQ(one.at(1.7), same.at(1.7));
  EXPECT_GT((one.at(1.7) - other.at(1.7)).norm(), 1e-3);
  EXPECT_EQ(Gusts().at(1.0), Vector3(Vector3::Zero()));
}

}  // namespace
}  // namespace pliant::wind_test
