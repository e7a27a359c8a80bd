#include "motion/penalty.hpp"

#include <cmath>
#include <numbers>

#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::penalty_test {
namespace {

using test::tolerance;

struct Penalties : ::testing::TestWithParam<Penalty::Onset> {
  Penalty penalty{3e5, 0.002, GetParam()};
};

TEST_P(Penalties, HaveTheDerivativesTheySay) {
  for (const double gap : {-0.03, -0.0051, -0.0013, -1e-5, 0.0007, 0.0019, 0.011}) {
    if (gap >= penalty.reach()) continue;
    const Penalty::Value v = penalty.at(gap), p = penalty.pressure_at(gap);
    EXPECT_EQ(v.pressure, p.pressure);
    EXPECT_GT(v.energy, 0.0);
    EXPECT_GT(v.pressure, 0.0);
    const auto expect = [&](auto value, double derivative, const char* what) {
      const auto along = [&](double h) -> VectorX { return VectorX::Constant(1, value(penalty.at(gap + h))); };
      if (derivative == 0.0)
        EXPECT_LT(std::abs(along(1e-6)[0] - along(-1e-6)[0]), 1e-9 * penalty.stiffness) << what << " " << gap;
      else
        EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, derivative), 1e-3), tolerance(1e-6))
            << what << " " << gap;
    };
    expect([](const Penalty::Value& at) { return at.energy; }, -v.pressure, "energy");
    expect([](const Penalty::Value& at) { return at.pressure; }, v.slope, "pressure");
    expect([](const Penalty::Value& at) { return at.slope; }, v.curvature, "slope");
  }
}

TEST_P(Penalties, VanishBeyondTheirReachAndAreLinearInside) {
  const double full = penalty.pressure_at(-0.001).pressure;
  EXPECT_LT(penalty.at(1.01 * penalty.reach()).pressure, 1e-12 * full);
  EXPECT_LT(penalty.at(1.01 * penalty.reach()).energy, 1e-12 * full * 0.001);
  EXPECT_NEAR(penalty.pressure_at(-0.1).pressure, 0.1 * penalty.stiffness, 1e-9 * 0.1 * penalty.stiffness);
}

INSTANTIATE_TEST_SUITE_P(Kinds, Penalties, ::testing::Values(Penalty::Onset::Softplus, Penalty::Onset::Quadratic),
                         [](const auto& c) { return c.param == Penalty::Onset::Softplus ? "Softplus" : "Quadratic"; });

/// -Li2(-1) = pi^2 / 12.
TEST(Softplus, HasTheDilogarithmAsEnergy) {
  const Penalty unit{1.0, 1.0};
  EXPECT_NEAR(unit.at(0.0).energy, std::numbers::pi * std::numbers::pi / 12.0, 1e-12);
}

}  // namespace
}  // namespace pliant::penalty_test
