#pragma once

#include "support/hanging.hpp"

namespace pliant::test::released {

inline constexpr int last = 2, pulls = 2;

/// A soft hanging bar, pulled aside and let go.
struct Released : hanging::Hanging {
  Released(std::shared_ptr<const Body> of, Integrator integrator) : Hanging(std::move(of)) {
    options.is_static = false;
    options.times.clear();
    for (int f = 0; f <= last; ++f) options.times.push_back(0.02 * f);
    options.max_dt = 0.01;
    options.integrator = integrator;
    options.newton.tolerance = 1e-13;
    options.solver.tolerance = 1e-13;
    set_blocks({.pulls = pulls});
    layout.set_moduli(theta, 3e5);
    theta[layout.mass_damping] = 0.5;
    theta[layout.stiffness_damping] = 0.004;
    set_pulls({0.01, 0.1, 0.05}, {0.0, -0.03, 0.02});
  }
  void set_pulls(const Vector3& first, const Vector3& second) {
    theta.segment<3>(layout.pulls[0]) = first;
    theta.segment<3>(layout.pulls[1]) = second;
  }
  /// Instead of pulls a weight hangs from the free end, until its string is cut; the bar is light and stiff enough for
  /// that to show.
  void hang(double mass) {
    set_blocks({});
    layout.set_moduli(theta, 5e6);
    theta[layout.density] = 200.0;
    options.released_weights = {{Vector3(0.5 * hanging::length, 0.2 * hanging::edge, -0.5 * hanging::edge), mass}};
  }
  VectorX positions_at(const VectorX& at, int frame) const {
    Simulation simulation(body, options);
    VectorX out;
    const RolloutSummary summary = simulation.run(at, [&](int f, const State& state, auto) {
      if (f == frame) out = flat(state.x);
      return f < frame;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    return out;
  }
};

inline std::shared_ptr<const Body> bar(ElementKind kind) {
  using namespace hanging;
  if (kind == ElementKind::Hexahedron) return hex_bar(1);
  return tet_body({length, edge, edge}, {6, 1, 1}, kind == ElementKind::QuadraticTetrahedron, 0.0);
}

}  // namespace pliant::test::released
