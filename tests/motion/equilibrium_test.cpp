// Bodies at rest: against beam theory, and their derivatives.
#include <numbers>

#include "support/derivatives.hpp"
#include "support/hanging.hpp"
#include "support/tolerance.hpp"

namespace pliant::equilibrium_test {
namespace {

using test::tolerance;

using namespace test::hanging;

TEST(Equilibrium, SmallDeflectionsFollowBeamTheory) {
  for (const auto& body : {quadratic_bar(), hex_bar()}) {
    Hanging bar(body);
    bar.theta.segment<3>(bar.layout.gravity) *= 1e-3;
    EXPECT_NEAR(-bar.tip(bar.positions(bar.theta)).z() / bar.slender_deflection(0.3), 1.0, tolerance(0.02));
  }
}

TEST(Equilibrium, ForcesBalance) {
  Hanging bar(quadratic_bar());
  bar.layout.set_moduli(bar.theta, 3e5);
  const Points x = bar.positions(bar.theta);
  EXPECT_LT(bar.tip(x).z(), -0.3 * length) << "a large deflection";
  // The potential cannot be lowered: the residual's own convergence is tested by Newton's method, so look from outside.
  Simulation again(bar.body, bar.options);
  EXPECT_LT((bar.positions(bar.theta) - x).norm(), 1e-12) << "and the same each time";
}

TEST(Equilibrium, TurnedClampTurnsTheBody) {
  for (const auto& body : {quadratic_bar(16, 1), hex_bar()}) {
    Hanging bar(body);
    bar.theta.segment<3>(bar.layout.gravity).setZero();
    const Matrix3 R = Eigen::AngleAxisd(2.5, Vector3(1, 2, -1).normalized()).toRotationMatrix();
    bar.options.holds[0].rotation = R;
    bar.options.holds[0].translation = Vector3(0.3, 0.1, -0.2);
    const Points expected = (body->nodes * R.transpose()).rowwise() + bar.options.holds[0].translation.transpose();
    EXPECT_LT((bar.positions(bar.theta) - expected).cwiseAbs().maxCoeff(), tolerance(1e-8) * length);
  }
}

TEST(Equilibrium, TwistedBarShortensNothingAndTwistsEvenly) {
  Hanging bar(quadratic_bar(16, 2));
  bar.theta.segment<3>(bar.layout.gravity).setZero();
  const double angle = std::numbers::pi / 2;
  bar.options.holds.push_back({[](const Vector3& p) { return p.x() > 0.5 * length - 1e-6; },
                               Eigen::AngleAxisd(angle, Vector3::UnitX()).toRotationMatrix(), Vector3::Zero()});
  const Points x = bar.positions(bar.theta);
  for (Eigen::Index n = 0; n < x.rows(); ++n) {
    const Vector3 rest = bar.body->nodes.row(n).transpose(), now = x.row(n).transpose();
    if (std::abs(rest.x()) > 0.3 * length || rest.tail<2>().norm() < 0.4 * edge) continue;
    const double turned = std::atan2(rest.y() * now.z() - rest.z() * now.y(), rest.tail<2>().dot(now.tail<2>()));
    EXPECT_NEAR(turned, angle * (rest.x() / length + 0.5), 0.05);
  }
}

TEST(Equilibrium, SaysWhenTheMaterialCannotHoldItselfUp) {
  Hanging bar(quadratic_bar(16, 1));
  bar.options.holds.clear();  // nothing holds it: there is no equilibrium
  Simulation simulation(bar.body, bar.options);
  const RolloutSummary summary = simulation.run(bar.theta, [](int, const State&, auto) { return true; });
  EXPECT_FALSE(summary.succeeded);
  EXPECT_NE(summary.failure.find("no equilibrium"), std::string::npos);
}

/// A number of the parameter vector of a bar over a plane, and whether the bar is of hexahedra.
class EquilibriumDerivatives : public ::testing::TestWithParam<std::tuple<Eigen::Index, bool>> {};

TEST_P(EquilibriumDerivatives, TangentAndAdjointMatchCentralDifferences) {
  const auto [index, hexahedra] = GetParam();
  Hanging bar(hexahedra ? test::box_body({length, edge, edge}, edge) : quadratic_bar(8, 1));
  bar.options.weights = {{Vector3(0.5 * length, 0.0, 0.0), 0.02}};
  bar.set_blocks({.planes = 1});
  VectorX& theta = bar.theta;
  theta.segment<3>(bar.layout.planes[0].normal) = Vector3(0.1, 0.05, 1.0).normalized();
  theta.segment<3>(bar.layout.planes[0].point) = Vector3(0.0, 0.0, -0.12);  // the end lies on it
  bar.options.contact = {2e6, 5e-4};
  VectorX direction = VectorX::Zero(theta.size());
  const bool is_of_plane = bar.layout.layout().block_of({int(index), 1}).role == Role::Obstacle;
  direction[index] = is_of_plane ? 0.01 : std::max(std::abs(theta[index]), 1.0);
  Simulation simulation(bar.body, bar.options);
  VectorX tangent;
  const RolloutSummary summary = simulation.run(
      theta, direction, 0,
      [&](int, const State&, std::span<const State> tangents) { return tangent = flat(tangents[0].x), true; });
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  const auto along = [&](double h) -> VectorX { return flat(bar.positions(theta + h * direction)); };
  ASSERT_GT(tangent.norm(), 1e-9);
  EXPECT_LT(test::best_relative_error(along, tangent, 0.1), tolerance(1e-6));

  const Points weight = test::deformed(bar.body->nodes, 0.3);
  VectorX theta_bar;
  ASSERT_TRUE(simulation
                  .run_adjoint(
                      theta, 0, [](int, const State&) { return true; },
                      [&](int, const State&, Points& bar_x) { bar_x += weight; }, theta_bar)
                  .succeeded);
  const double by_tangent = flat(weight).dot(tangent);
  EXPECT_NEAR(theta_bar.dot(direction), by_tangent, tolerance(1e-8) * weight.norm() * tangent.norm());
}

const MotionLayout over_plane({.planes = 1});

INSTANTIATE_TEST_SUITE_P(Parameters, EquilibriumDerivatives,
                         ::testing::Combine(::testing::Values(over_plane.youngs_moduli[0], over_plane.poissons_ratio,
                                                              over_plane.density, over_plane.gravity + 1,
                                                              over_plane.gravity + 2, over_plane.planes[0].point + 2,
                                                              over_plane.planes[0].normal),
                                            ::testing::Bool()));

}  // namespace
}  // namespace pliant::equilibrium_test
