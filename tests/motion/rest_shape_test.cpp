// Bodies whose load-free shape, or whose scan, follows from theta: the derivatives of all that hangs on it.
#include "motion/rest_shape.hpp"

#include "support/derivatives.hpp"
#include "support/released.hpp"
#include "support/tolerance.hpp"

namespace pliant::rest_shape_test {
namespace {

using test::tolerance;
using test::released::bar;
using test::released::last;
using test::released::pulls;
using test::released::Released;

/// What of the scan is unknown.
enum class Unknown { LoadFree, Correction, Both };

/// A soft hanging bar as it was scanned, pulled aside and let go.
struct Shaped : Released {
  Shaped(ElementKind kind, Integrator integrator, Unknown unknown) : Released(bar(kind), integrator) {
    options.scan_sags = unknown != Unknown::Correction;
    if (unknown != Unknown::LoadFree)
      options.shape = {{Vector3(0.25, 0.01, 0.0), Vector3(-0.05, 0.0, 0.01)}, 0.02, 0.2};
    const int shapes = int(options.shape.points.size());
    set_blocks({.pulls = pulls, .scan_corrections = shapes});
    if (shapes > 0) {
      theta.segment<3>(layout.scan_corrections[0]) = Vector3(0.3, -0.5, 0.8);
      theta.segment<3>(layout.scan_corrections[1]) = Vector3(-0.2, 0.4, 0.1);
    }
    layout.set_moduli(theta, 2e7);
  }
};

/// One way to be shaped and moved.
struct Case {
  const char* name;
  ElementKind kind;
  Integrator integrator;
  Unknown unknown;
  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

class Shapes : public ::testing::TestWithParam<std::tuple<Case, Eigen::Index>> {
 protected:
  Shaped scene{std::get<0>(GetParam()).kind, std::get<0>(GetParam()).integrator, std::get<0>(GetParam()).unknown};
  VectorX direction() const {
    const Eigen::Index index = std::get<1>(GetParam());
    return VectorX::Unit(scene.theta.size(), index) * scene.theta[index];
  }
  /// Of the first and the last frame.
  VectorX positions_at(const VectorX& theta) const {
    Simulation simulation(scene.body, scene.options);
    VectorX both(2 * 3 * scene.body->node_count());
    const RolloutSummary summary = simulation.run(theta, [&](int f, const State& state, auto) {
      if (f == 0) both.head(both.size() / 2) = flat(state.x);
      if (f == last) both.tail(both.size() / 2) = flat(state.x);
      return true;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    return both;
  }
};

TEST_P(Shapes, TangentMatchesCentralDifferencesAndAdjointMatchesTangent) {
  Simulation simulation(scene.body, scene.options);
  const Points weight = test::deformed(scene.body->reference_positions(), 0.3);
  std::vector<VectorX> tangents;
  RolloutSummary summary =
      simulation.run(scene.theta, direction(), last, [&](int, const State&, std::span<const State> t) {
        tangents.push_back(flat(t[0].x));
        return true;
      });
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  VectorX both(2 * tangents[0].size());
  both << tangents[0], tangents[last];
  EXPECT_GT(both.norm(), 1e-6) << "the parameter has no effect: the test would prove nothing";
  const auto along = [&](double h) { return positions_at(scene.theta + h * direction()); };
  EXPECT_LT(test::best_relative_error(along, both, 0.3), tolerance(1e-6));

  VectorX gradient;
  summary = simulation.run_adjoint(
      scene.theta, last, [](int, const State&) { return true; },
      [&](int f, const State&, Points& bar) {
        if (f % 2 == 0) bar += weight;
      },
      gradient);
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  const double by_tangent = flat(weight).dot(tangents[0] + tangents[2]);
  EXPECT_NEAR(gradient.dot(direction()), by_tangent, tolerance(1e-7) * std::abs(by_tangent));
}

constexpr Case free_lagged{"quadratic, load-free, lagged", ElementKind::QuadraticTetrahedron, Integrator::Lagged,
                           Unknown::LoadFree},
    free_newton{"linear, load-free, Newton", ElementKind::Tetrahedron, Integrator::Newton, Unknown::LoadFree},
    corrected_lagged{"linear, correction, lagged", ElementKind::Tetrahedron, Integrator::Lagged, Unknown::Correction},
    corrected_newton{"quadratic, correction, Newton", ElementKind::QuadraticTetrahedron, Integrator::Newton,
                     Unknown::Correction},
    both_lagged{"linear, both, lagged", ElementKind::Tetrahedron, Integrator::Lagged, Unknown::Both},
    both_newton{"quadratic, both, Newton", ElementKind::QuadraticTetrahedron, Integrator::Newton, Unknown::Both};

const MotionLayout corrected({.pulls = pulls, .scan_corrections = 2});

INSTANTIATE_TEST_SUITE_P(Material, Shapes,
                         ::testing::Combine(::testing::Values(free_lagged, free_newton, corrected_lagged,
                                                              corrected_newton, both_lagged, both_newton),
                                            ::testing::Values(corrected.youngs_moduli[0], corrected.poissons_ratio,
                                                              corrected.density, corrected.gravity + 2,
                                                              corrected.pulls[0] + 1)));
INSTANTIATE_TEST_SUITE_P(
    Scan, Shapes,
    ::testing::Combine(::testing::Values(corrected_lagged, corrected_newton, both_lagged, both_newton),
                       ::testing::Values(corrected.scan_corrections[0], corrected.scan_corrections[1] + 2)));

/// Without pulls the object hangs as it was scanned, whatever it is made of, and stays there.
TEST(Shape, AScanThatSagsIsAnEquilibriumOfEveryMaterial) {
  Shaped scene(ElementKind::QuadraticTetrahedron, Integrator::Newton, Unknown::LoadFree);
  scene.set_pulls(Vector3::Zero(), Vector3::Zero());
  for (const double modulus : {2e7, 6e7}) {
    scene.layout.set_moduli(scene.theta, modulus);
    for (const int frame : {0, last})
      EXPECT_LT((scene.positions_at(scene.theta, frame) - flat(scene.body->nodes)).cwiseAbs().maxCoeff(),
                tolerance(1e-7))
          << modulus << " Pa";
  }
}

TEST(Shape, WhatCannotCarryTheScanFailsAndSaysSo) {
  Shaped scene(ElementKind::Tetrahedron, Integrator::Lagged, Unknown::LoadFree);
  scene.layout.set_moduli(scene.theta, 300.0);
  Simulation simulation(scene.body, scene.options);
  const RolloutSummary summary = simulation.run(scene.theta, [](int, const State&, auto) { return true; });
  EXPECT_FALSE(summary.succeeded);
  EXPECT_THAT(summary.failure, ::testing::HasSubstr("cannot be held up"));
}

/// What pulls, dampings and velocities change is the motion: the shape is that which was found, and its derivatives by
/// them are zero.
TEST(Shape, FollowsWhatItDependsOnAndNothingElse) {
  const Shaped scene(ElementKind::QuadraticTetrahedron, Integrator::Lagged, Unknown::Both);
  const std::vector<int> held = held_nodes(*scene.body, scene.options.holds);
  RestShape shape(scene.body, held, true, {}, shape_basis(*scene.body, scene.options.shape, held), scene.layout,
                  scene.options.material);
  ASSERT_EQ(shape.find(scene.theta), "");
  ASSERT_TRUE(shape.prepare_derivatives());
  const std::shared_ptr<const Body> found = shape.body();
  const MotionLayout& l = scene.layout;
  std::vector<ParameterHandle> followed = {l.youngs_moduli[0], l.poissons_ratio, l.density, l.gravity};
  followed.insert(followed.end(), l.scan_corrections.begin(), l.scan_corrections.end());
  for (Eigen::Index i = 0; i < scene.theta.size(); ++i) {
    const VectorX unit = VectorX::Unit(scene.theta.size(), i);
    const Points tangent = shape.reference_tangent(unit, shape.scan_tangent(unit));
    EXPECT_EQ(tangent.isZero(0.0), !changes_any(followed, unit)) << i;
  }
  for (const ParameterHandle& block : l.all()) {
    ASSERT_EQ(shape.find(scene.theta), "");
    const std::shared_ptr<const Body> before = shape.body();
    VectorX theta = scene.theta;
    theta[block] += 1e-3 * std::max(std::abs(theta[block]), 0.1);
    ASSERT_EQ(shape.find(theta), "");
    EXPECT_EQ(shape.body() == before, !changes_any(followed, theta - scene.theta)) << block.first;
  }
  ASSERT_EQ(shape.find(scene.theta), "");
  EXPECT_LT((shape.body()->reference_positions() - found->reference_positions()).cwiseAbs().maxCoeff(), 1e-7);
}

/// Drawn from the prior, the field has its width far from what is held, and vanishes there.
TEST(ShapeField, HasThePriorsWidthAndVanishesWhereHeld) {
  const auto body = bar(ElementKind::QuadraticTetrahedron);
  const std::vector<int> held =
      held_nodes(*body, Shaped(ElementKind::Tetrahedron, Integrator::Lagged, Unknown::LoadFree).options.holds);
  const ShapeField field{{Vector3(0.3, 0.0, 0.0), Vector3(0.1, 0.0, 0.0), Vector3(-0.1, 0.0, 0.0)}, 0.02, 0.1};
  const MatrixX basis = shape_basis(*body, field, held);
  ASSERT_EQ(basis.cols(), 3);
  for (const int n : held) EXPECT_EQ(basis.row(n).norm(), 0.0);
  for (Eigen::Index n = 0; n < basis.rows(); ++n)
    if (std::abs(body->nodes(n, 0) - 0.3) < 1e-9) {
      EXPECT_NEAR(basis.row(n).norm(), 0.02, 1e-3) << n;
    }
  // Smooth: neighbours move along.
  for (int e = 0; e < body->element_count(); ++e)
    for (const int n : body->element(e)) {
      if (std::ranges::find(held, n) != held.end() || std::ranges::find(held, body->element(e)[0]) != held.end())
        continue;
      EXPECT_LT((basis.row(n) - basis.row(body->element(e)[0])).norm(), 0.03);
    }
}

}  // namespace
}  // namespace pliant::rest_shape_test
