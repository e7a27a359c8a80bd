// Objects that are held in a deformed pose and let go.
#include <numbers>

#include "base/error.hpp"
#include "motion/compliance.hpp"
#include "motion/pull.hpp"
#include "support/derivatives.hpp"
#include "support/released.hpp"
#include "support/tolerance.hpp"

namespace pliant::release_test {
namespace {

using test::tolerance;
using test::released::bar;
using test::released::Released;

constexpr int last = test::released::last;

enum class HeldBy { Pulls, Weight };

/// A number of the parameter vector, the elements, the integrator, and what holds the object until it is let go.
class Release : public ::testing::TestWithParam<std::tuple<Eigen::Index, ElementKind, Integrator, HeldBy>> {
 protected:
  Release() {
    if (std::get<3>(GetParam()) == HeldBy::Weight) scene.hang(0.05);
  }
  Eigen::Index index() const { return std::get<0>(GetParam()); }
  Released scene{bar(std::get<1>(GetParam())), std::get<2>(GetParam())};
  VectorX direction() const {
    const double size = std::abs(scene.theta[index()]);
    return VectorX::Unit(scene.theta.size(), index()) * (size > 0.0 ? size : 0.1);
  }
};

TEST_P(Release, TangentMatchesCentralDifferences) {
  Simulation simulation(scene.body, scene.options);
  std::vector<VectorX> tangents;
  simulation.run(scene.theta, direction(), last, [&](int, const State&, std::span<const State> t) {
    tangents.push_back(flat(t[0].x));
    return true;
  });
  ASSERT_EQ(int(tangents.size()), last + 1);
  for (const int frame : {0, last}) {
    const VectorX& tangent = tangents[std::size_t(frame)];
    if (tangent.norm() == 0.0) continue;  // dampings and velocities do not act on the pose
    const auto along = [&](double h) { return scene.positions_at(scene.theta + h * direction(), frame); };
    EXPECT_LT(test::best_relative_error(along, tangent, 0.3), tolerance(1e-6)) << "frame " << frame;
  }
  EXPECT_GT(tangents[last].norm(), 1e-9) << "the parameter has no effect: the test would prove nothing";
}

TEST_P(Release, AdjointMatchesTangent) {
  Simulation simulation(scene.body, scene.options);
  const Points weight = test::deformed(scene.body->reference_positions(), 0.3);
  double by_tangent = 0.0;
  simulation.run(scene.theta, direction(), last, [&](int f, const State&, std::span<const State> t) {
    if (f % 2 == 0) by_tangent += weight.cwiseProduct(t[0].x).sum();
    return true;
  });
  VectorX gradient;
  const auto summary = simulation.run_adjoint(
      scene.theta, last, [](int, const State&) { return true; },
      [&](int f, const State&, Points& bar) {
        if (f % 2 == 0) bar += weight;
      },
      gradient);
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  // What lies between the two are the tolerances of the linear solvers, 1e-12, over several steps.
  EXPECT_NEAR(gradient.dot(direction()), by_tangent, tolerance(1e-8) * std::abs(by_tangent));
}

const MotionLayout pulled({.pulls = test::released::pulls}), unpulled;
const auto parameters_that_act =
    ::testing::Values(pulled.youngs_moduli[0], pulled.poissons_ratio, pulled.stiffness_damping, pulled.density,
                      pulled.gravity + 1, pulled.linear_velocity + 2, pulled.pulls[0] + 1, pulled.pulls[1] + 2);
const auto without_pulls =
    ::testing::Values(unpulled.youngs_moduli[0], unpulled.poissons_ratio, unpulled.stiffness_damping, unpulled.density,
                      unpulled.gravity + 1, unpulled.linear_velocity + 2);

INSTANTIATE_TEST_SUITE_P(Hexahedra, Release,
                         ::testing::Combine(parameters_that_act, ::testing::Values(ElementKind::Hexahedron),
                                            ::testing::Values(Integrator::Lagged), ::testing::Values(HeldBy::Pulls)));
INSTANTIATE_TEST_SUITE_P(Tetrahedra, Release,
                         ::testing::Combine(parameters_that_act,
                                            ::testing::Values(ElementKind::Tetrahedron,
                                                              ElementKind::QuadraticTetrahedron),
                                            ::testing::Values(Integrator::Newton), ::testing::Values(HeldBy::Pulls)));
INSTANTIATE_TEST_SUITE_P(HexahedraUnderAWeight, Release,
                         ::testing::Combine(without_pulls, ::testing::Values(ElementKind::Hexahedron),
                                            ::testing::Values(Integrator::Lagged), ::testing::Values(HeldBy::Weight)));
INSTANTIATE_TEST_SUITE_P(TetrahedraUnderAWeight, Release,
                         ::testing::Combine(without_pulls, ::testing::Values(ElementKind::QuadraticTetrahedron),
                                            ::testing::Values(Integrator::Newton), ::testing::Values(HeldBy::Weight)));

/// Before, it is the equilibrium under a weight that stays; afterwards nothing of the weight is left.
TEST(Releases, TheWeightHangsUntilTheStringIsCut) {
  Released scene(bar(ElementKind::QuadraticTetrahedron), Integrator::Newton);
  scene.hang(0.05);
  const VectorX start = scene.positions_at(scene.theta, 0), end = scene.positions_at(scene.theta, last);
  Released loaded = scene, bare = scene;
  std::swap(loaded.options.weights, loaded.options.released_weights);
  bare.options.released_weights.clear();
  loaded.options.is_static = bare.options.is_static = true;
  const VectorX held = loaded.positions_at(loaded.theta, 0), sagging = bare.positions_at(bare.theta, 0);
  ASSERT_GT((held - sagging).cwiseAbs().maxCoeff(), 0.05) << "a weight worth hanging";
  EXPECT_LT((start - held).cwiseAbs().maxCoeff(), tolerance(1e-9));
  EXPECT_GT((end - start).cwiseAbs().maxCoeff(), 1e-3) << "it moves";
  scene.options.is_static = true;
  EXPECT_LT((scene.positions_at(scene.theta, 0) - sagging).cwiseAbs().maxCoeff(), tolerance(1e-9))
      << "at rest nothing is released";
  Released damped = scene;  // nearly critically
  damped.options.is_static = false;
  damped.options.times = {0.0, 2.0};
  damped.options.max_dt = 0.01;
  damped.theta[damped.layout.mass_damping] = 25.0;
  EXPECT_LT((damped.positions_at(damped.theta, 1) - sagging).cwiseAbs().maxCoeff(), 1e-4) << "it ends without it";
}

/// A cantilever under a weight at its end, small against its length: P L^3 / 3EI and shear; let go, it swings at
/// 1.8751^2 / 2 pi sqrt(EI / rho A L^4) (Euler and Bernoulli).
TEST(Releases, DeflectionAndFrequencyOfACantileverAreThoseOfBeams) {
  using namespace test::hanging;
  for (const auto& body : {quadratic_bar(20, 1), hex_bar(1)}) {
    Hanging scene(body);
    scene.options.is_static = false;
    scene.options.newmark_theta = 0.5;
    scene.theta.segment<3>(scene.layout.gravity) *= 0.01;
    const double E = scene.theta[scene.layout.youngs_moduli[0]], rho = scene.theta[scene.layout.density], nu = 0.3;
    const double I = std::pow(edge, 4) / 12.0, A = edge * edge, mass = 0.2;
    const double P = -mass * scene.layout.gravity.vector(scene.theta).z();
    const double frequency =
        std::pow(1.87510407, 2) / (2 * std::numbers::pi) * std::sqrt(E * I / (rho * A * std::pow(length, 4)));
    const double quarter = 0.25 / frequency;
    constexpr int frames = 48;
    scene.options.times.clear();
    for (int f = 0; f <= frames; ++f) scene.options.times.push_back(1.25 * quarter * f / frames);
    scene.options.max_dt = quarter;  // one step a frame
    scene.options.released_weights = {{Vector3(0.5 * length, 0.0, 0.0), mass}};
    // The share of the first mode, of which a clamped end's higher ones are free.
    VectorX mode(body->node_count());
    for (Eigen::Index n = 0; n < mode.size(); ++n) {
      constexpr double k = 1.87510407, sigma = 0.73409551;
      const double s = k * (body->nodes(n, 0) / length + 0.5);
      mode[n] = std::cosh(s) - std::cos(s) - sigma * (std::sinh(s) - std::sin(s));
    }
    Points along = Points::Zero(body->node_count(), 3), weights = along;
    along.col(2) = mode;
    body->add_mass_product(1.0, along, weights);
    Hanging bare(body);
    bare.theta = scene.theta;
    const Points sagging = bare.positions(bare.theta);
    std::vector<double> share;
    double deflection = 0.0;
    Simulation simulation(body, scene.options);
    const RolloutSummary summary = simulation.run(scene.theta, [&](int f, const State& state, auto) {
      const Points moved = state.x - sagging;
      if (f == 0) deflection = -bare.tip(sagging + moved).z() + bare.tip(sagging).z();
      share.push_back(weights.cwiseProduct(moved).sum());
      return true;
    });
    ASSERT_TRUE(summary.succeeded) << summary.failure;
    const double expected = P * std::pow(length, 3) / (3 * E * I) + P * length / (5.0 / 6.0 * E / (2 * (1 + nu)) * A);
    ASSERT_LT(expected, 0.03 * length) << "small deflections";
    EXPECT_NEAR(deflection / expected, 1.0, tolerance(0.02));
    int after = 1;
    while (after < frames && share[std::size_t(after)] * share[0] > 0.0) ++after;
    const double before = share[std::size_t(after) - 1], behind = share[std::size_t(after)];
    ASSERT_LT(behind * share[0], 0.0) << "it swings through where it rests";
    const double crossing = 1.25 * quarter / frames * (after - 1 + before / (before - behind));
    EXPECT_NEAR(quarter / crossing, 1.0, tolerance(0.02));
  }
}

TEST(Releases, WithoutAPullTheObjectStaysWhereItSags) {
  Released scene(bar(ElementKind::QuadraticTetrahedron), Integrator::Newton);
  scene.set_pulls(Vector3::Zero(), Vector3::Zero());
  const VectorX start = scene.positions_at(scene.theta, 0), end = scene.positions_at(scene.theta, last);
  EXPECT_GT((start - flat(scene.body->nodes)).cwiseAbs().maxCoeff(), 0.02) << "it sags";
  EXPECT_LT((end - start).cwiseAbs().maxCoeff(), tolerance(1e-8));
}

TEST(Releases, TheUnitOfAPullIsTheObjectsSize) {
  Released scene(bar(ElementKind::QuadraticTetrahedron), Integrator::Newton);
  scene.theta.segment<3>(scene.layout.gravity).setZero();
  scene.theta[scene.layout.poissons_ratio] = 0.3;
  for (const double modulus : {1e3, 1e7}) {
    scene.layout.set_moduli(scene.theta, modulus);
    scene.set_pulls({0, 1e-4, 0}, Vector3::Zero());
    const VectorX moved = scene.positions_at(scene.theta, 0) - flat(scene.body->nodes);
    const double farthest = as_points(moved).rowwise().norm().maxCoeff();
    EXPECT_NEAR(farthest, 1e-4 * scene.body->size(), tolerance(1e-3) * 1e-4 * scene.body->size()) << modulus << " Pa";
  }
}

/// The field of moduli in the words of a fit, by two control points, and in those of its model, by element and one
/// modulus: the pulls hold the object in the same pose.
TEST(Releases, ThePoseDoesNotDependOnHowTheFieldIsTold) {
  Released by_points(bar(ElementKind::Hexahedron), Integrator::Lagged);
  auto body = std::make_shared<Body>(*by_points.body);
  const Eigen::Index elements = body->element_count();
  const VectorX share = VectorX::LinSpaced(elements, 0.0, 1.0).array().square();  // the mean is not at the middle
  body->modulus.controls = 2;
  body->modulus.weights.resize(elements, 2);
  body->modulus.weights << 1.0 - share.array(), share;
  by_points.body = body;
  by_points.set_blocks({.moduli = 2, .pulls = test::released::pulls});
  constexpr double stiff = 6e5, soft = 1.5e5;
  by_points.theta[by_points.layout.youngs_moduli[0]] = stiff;
  by_points.theta[by_points.layout.youngs_moduli[1]] = soft;
  by_points.set_pulls({0.01, 0.1, 0.05}, {0.0, -0.03, 0.02});

  Released by_element(bar(ElementKind::Hexahedron), Integrator::Lagged);
  auto told = std::make_shared<Body>(*by_element.body);
  for (Eigen::Index e = 0; e < elements; ++e)
    told->modulus.relative[std::size_t(e)] = std::pow(soft / stiff, share[e]) * stiff / 1e5;
  by_element.body = told;
  by_element.layout.set_moduli(by_element.theta, 1e5);

  const VectorX pose = by_points.positions_at(by_points.theta, 0);
  ASSERT_GT((pose - flat(by_points.body->nodes)).cwiseAbs().maxCoeff(), 0.02) << "a pull worth holding";
  EXPECT_LT((pose - by_element.positions_at(by_element.theta, 0)).cwiseAbs().maxCoeff(), tolerance(1e-9));
}

TEST(Releases, TheStartDoesNotDependOnWhatWasSimulatedBefore) {
  const Released scene(bar(ElementKind::Hexahedron), Integrator::Lagged);
  Released elsewhere = scene;
  elsewhere.set_pulls({0.01, -0.6, -0.3}, Vector3::Zero());
  Simulation simulation(scene.body, scene.options);
  const auto start = [&](const VectorX& theta) {
    VectorX x;
    simulation.run(theta, [&](int, const State& state, auto) { return x = flat(state.x), false; });
    return x;
  };
  const VectorX first = start(scene.theta), other = start(elsewhere.theta);
  ASSERT_GT((first - other).cwiseAbs().maxCoeff(), 0.02);
  EXPECT_EQ(start(scene.theta), first);
}

TEST(Releases, AFreeObjectCannotBePulled) {
  Released scene(bar(ElementKind::Tetrahedron), Integrator::Newton);
  scene.options.holds.clear();
  EXPECT_THROW(Simulation(scene.body, scene.options), InputError);
}

/// About the pose that pulls hold, the scene's forces lack just those pulls, and a little more of them moves the nodes
/// as equilibria under more pulls do.
TEST(Compliance, WhatAPoseLacksIsWhatHoldsIt) {
  Released scene(bar(ElementKind::QuadraticTetrahedron), Integrator::Newton);
  const double length = test::hanging::length;
  scene.options.pull_points = {{Vector3(0.5 * length, 0.0, 0.0), Vector3::Zero()}, length};
  const Points pose = as_points(scene.positions_at(scene.theta, 0));
  const std::vector<int> held = held_nodes(*scene.body, scene.options.holds);
  Pull pull(scene.body, scene.options.pull_points, held, scene.options.blocks);
  pull.set_parameters(scene.theta);
  Points force = Points::Zero(pose.rows(), 3);
  pull.add_force(pose, force);

  Compliance compliance(scene.body, scene.options, scene.theta, pose);
  ASSERT_TRUE(compliance.is_ready());
  Points lacks = compliance.missing_forces() - force;
  for (const int node : held) lacks.row(node).setZero();
  EXPECT_LT(lacks.norm(), tolerance(1e-8) * force.norm());

  const VectorX moved = flat(compliance.displacements(force));
  const auto under_more = [&](double share) {
    VectorX theta = scene.theta;
    for (const ParameterHandle& block : scene.options.blocks.pulls) theta.segment<3>(block) *= 1.0 + share;
    return scene.positions_at(theta, 0);
  };
  EXPECT_LT(test::best_relative_error(under_more, moved, 0.1), tolerance(1e-6));
}

/// Pulls at points of the scan hold the same object in about the same pose on every mesh.
TEST(PullPoints, ThePoseHardlyDependsOnTheMesh) {
  const auto tip = [](int cells) {
    Released scene(test::hanging::hex_bar(cells), Integrator::Lagged);
    scene.options.pull_points = {{Vector3(0.0, 0.0, 0.0), Vector3(0.0, 0.0, 0.0)}, test::hanging::length};
    const Points& nodes = scene.body->nodes;
    Eigen::Index lowest = 0, highest = 0;
    nodes.col(0).minCoeff(&lowest), nodes.col(0).maxCoeff(&highest);
    const std::vector<Vector3> ends = {Vector3(nodes(lowest, 0), 0.0, 0.0), Vector3(nodes(highest, 0), 0.0, 0.0)};
    const int held = held_nodes(*scene.body, scene.options.holds).front();
    const bool low = std::abs(nodes(held, 0) - ends[0].x()) < std::abs(nodes(held, 0) - ends[1].x());
    const Vector3 end = low ? ends[1] : ends[0];
    scene.options.pull_points.at = {end, 0.5 * (ends[0] + ends[1])};
    const Points x = as_points(scene.positions_at(scene.theta, 0));
    const Embedding at(*scene.body, {end});
    return Vector3(at.position(0, x) - at.position(0, nodes));
  };
  const Vector3 coarse = tip(1), fine = tip(2);
  ASSERT_GT(fine.norm(), 0.05 * test::hanging::length) << "a pull worth holding";
  EXPECT_LT((coarse - fine).norm(), 0.05 * fine.norm());
}

TEST(PullPoints, LieFarFromWhatIsHeldAndFromEachOther) {
  const std::vector<Vector3> line = {Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(2, 0, 0), Vector3(3, 0, 0)};
  const auto points = far_points(line, {line[0]}, 2);
  EXPECT_EQ(points[0], line[3]);
  EXPECT_EQ(points[1], line[1]);  // the first of those that are as far
  EXPECT_THROW((void)far_points(line, {}, 1), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::release_test
