#pragma once

#include <gtest/gtest.h>

#include <utility>

#include "motion/simulation.hpp"
#include "support/bodies.hpp"

namespace pliant::test {

namespace hanging {
// Slender, so that the clamp, which keeps the end from contracting, hardly shows.
inline constexpr double length = 0.6, edge = 0.03;

/// A bar along x, clamped at its low end.
struct Hanging {
  explicit Hanging(std::shared_ptr<const Body> of) : body(std::move(of)), layout({.moduli = body->modulus.controls}) {
    options.blocks = layout;
    options.times = {0.0};
    options.is_static = true;
    options.newton.tolerance = 1e-12;
    options.holds = {{[](const Vector3& p) { return p.x() < -0.5 * length + 1e-6; }}};
    theta[layout.youngs_moduli[0]] = 1.5e6;
    theta[layout.poissons_ratio] = 0.3;
    theta[layout.density] = 1000.0;
    theta.segment<3>(layout.gravity) = Vector3(0.0, 0.0, -9.81);
  }
  /// Gives the scene other blocks of parameters; those that it has already keep their values.
  void set_blocks(const MotionCounts& counts) {
    const MotionLayout before = std::exchange(layout, MotionLayout(counts));
    theta = carry(before.layout(), theta, layout.layout(), layout.zero());
    options.blocks = layout;
  }
  Points positions(const VectorX& at) const {
    Simulation simulation(body, options);
    Points x;
    const RolloutSummary summary = simulation.run(at, [&](int, const State& state, auto) { return x = state.x, true; });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    return x;
  }
  /// Mean displacement of the free end.
  Vector3 tip(const Points& x) const {
    Vector3 sum = Vector3::Zero();
    int count = 0;
    for (Eigen::Index n = 0; n < x.rows(); ++n)
      if (body->nodes(n, 0) > 0.5 * length - 1e-6) sum += (x.row(n) - body->nodes.row(n)).transpose(), ++count;
    return sum / count;
  }
  double slender_deflection(double nu) const {
    const double E = theta[layout.youngs_moduli[0]], I = std::pow(edge, 4) / 12.0, A = edge * edge;
    const double w = theta[layout.density] * A * -layout.gravity.vector(theta).z();
    return w * std::pow(length, 4) / (8 * E * I) + w * length * length / (2 * 5.0 / 6.0 * E / (2 * (1 + nu)) * A);
  }

  std::shared_ptr<const Body> body;
  MotionLayout layout;
  SimulationOptions options;
  VectorX theta = layout.zero();
};

inline std::shared_ptr<const Body> quadratic_bar(int along = 30, int across = 2) {
  return tet_body({length, edge, edge}, {along, across, across}, true, 0.0);
}
inline std::shared_ptr<const Body> hex_bar(int across = 2) { return box_body({length, edge, edge}, edge / across); }

}  // namespace hanging

}  // namespace pliant::test
