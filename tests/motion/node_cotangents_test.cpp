// Derivatives of a motion by its nodes: where they start, how fast, and where they are stress-free.
#include "motion/simulation.hpp"
#include "support/derivatives.hpp"
#include "support/released.hpp"
#include "support/scenes.hpp"
#include "support/tolerance.hpp"

namespace pliant::node_cotangents_test {
namespace {

using test::tolerance;

constexpr int last = 3;

/// A weighted sum of positions in two frames, and its derivatives.
double weighted(Simulation& simulation, const VectorX& theta, const Points& weight) {
  double sum = 0.0;
  const RolloutSummary summary = simulation.run(theta, [&](int f, const State& state, auto) {
    if (f % 2 == 1) sum += weight.cwiseProduct(state.x).sum();
    return f < last;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return sum;
}

NodeCotangents cotangents(Simulation& simulation, const VectorX& theta, const Points& weight, bool with_reference) {
  NodeCotangents nodes;
  nodes.with_reference = with_reference;
  VectorX gradient;
  const auto summary = simulation.run_adjoint(
      theta, last, [](int, const State&) { return true; },
      [&](int f, const State&, Points& bar) {
        if (f % 2 == 1) bar += weight;
      },
      gradient, &nodes);
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return nodes;
}

VectorX as_vector(double value) { return VectorX::Constant(1, value); }

class Start : public ::testing::TestWithParam<Integrator> {};

TEST_P(Start, PositionsAndVelocitiesMatchCentralDifferences) {
  test::TorusScene scene = test::torus_scene(0.04, last + 1);
  scene.options.integrator = GetParam();
  scene.options.newton.tolerance = 1e-13;
  Simulation simulation(scene.body, scene.options);
  const Points rest = scene.body->reference_positions(), weight = test::deformed(rest, 0.3);
  const Points bent = test::deformed(rest, 0.02), spin = 5.0 * test::deformed(rest, 0.2);
  simulation.set_start(bent, spin);
  const NodeCotangents nodes = cotangents(simulation, scene.theta, weight, false);
  EXPECT_EQ(nodes.reference.rows(), 0);

  const Points direction = test::deformed(rest, 0.7);
  const auto by_position = [&](double h) {
    simulation.set_start(bent + h * direction, spin);
    return as_vector(weighted(simulation, scene.theta, weight));
  };
  EXPECT_LT(test::best_relative_error(by_position, as_vector(nodes.start.cwiseProduct(direction).sum()), 0.1),
            tolerance(1e-6));
  const auto by_velocity = [&](double h) {
    simulation.set_start(bent, spin + h * direction);
    return as_vector(weighted(simulation, scene.theta, weight));
  };
  EXPECT_LT(
      test::best_relative_error(by_velocity, as_vector(nodes.start_velocities.cwiseProduct(direction).sum()), 1.0),
      tolerance(1e-6));
}

INSTANTIATE_TEST_SUITE_P(NodeCotangents, Start, ::testing::Values(Integrator::Lagged, Integrator::Newton));

TEST(NodeCotangents, VelocitiesOfNodesAddToThoseOfTheWhole) {
  const test::TorusScene scene = test::torus_scene(0.04, last + 1);
  Simulation simulation(scene.body, scene.options);
  const Points weight = test::deformed(scene.body->reference_positions(), 0.3);
  const double as_a_whole = weighted(simulation, scene.theta, weight);
  VectorX theta = scene.theta;
  theta.segment<3>(scene.layout.linear_velocity).setZero();
  const Vector3 velocity = scene.layout.linear_velocity.vector(scene.theta);
  simulation.set_start({}, velocity.transpose().replicate(scene.body->node_count(), 1));
  EXPECT_NEAR(weighted(simulation, theta, weight), as_a_whole, 1e-12 * std::abs(as_a_whole));
}

TEST(NodeCotangents, AStartOfAnotherBodyIsRefused) {
  const test::TorusScene scene = test::torus_scene(0.04, last + 1);
  Simulation simulation(scene.body, scene.options);
  EXPECT_THROW(simulation.set_start(Points::Zero(3, 3), {}), std::invalid_argument);
  EXPECT_THROW(simulation.set_start({}, Points::Zero(3, 3)), std::invalid_argument);
  EXPECT_EQ(simulation.options().start.rows(), 0) << "and what was there stays";
}

/// A bar that is held, pulled aside and let go, or at rest under its weight.
struct Bar : test::released::Released {
  Bar(ElementKind kind, Integrator integrator, bool is_static, StiffnessDamping damping = StiffnessDamping::KelvinVoigt,
      ElasticLaw law = ElasticLaw::NeoHookean)
      : Released(test::released::bar(kind), integrator) {
    options.material.elastic = law;
    options.material.damping = damping;
    options.is_static = is_static;
    if (is_static) set_blocks({});
  }
};

class Reference
    : public ::testing::TestWithParam<std::tuple<ElementKind, Integrator, bool, StiffnessDamping, ElasticLaw>> {};

TEST_P(Reference, MatchesCentralDifferences) {
  const auto [kind, integrator, is_static, damping, law] = GetParam();
  Bar scene(kind, integrator, is_static, damping, law);
  const Points rest = scene.body->reference_positions(), weight = test::deformed(rest, 0.3);
  const Points direction = test::deformed(rest, 0.7);
  Simulation simulation(scene.body, scene.options);
  const NodeCotangents nodes = cotangents(simulation, scene.theta, weight, true);
  ASSERT_EQ(nodes.reference.rows(), rest.rows());
  const auto along = [&](double h) {
    simulation.set_reference(rest + h * direction);
    return as_vector(weighted(simulation, scene.theta, weight));
  };
  EXPECT_LT(test::best_relative_error(along, as_vector(nodes.reference.cwiseProduct(direction).sum()), 0.01),
            tolerance(1e-6));
}

INSTANTIATE_TEST_SUITE_P(
    NodeCotangents, Reference,
    ::testing::Combine(::testing::Values(ElementKind::Tetrahedron, ElementKind::QuadraticTetrahedron),
                       ::testing::Values(Integrator::Lagged, Integrator::Newton), ::testing::Bool(),
                       ::testing::Values(StiffnessDamping::Rayleigh, StiffnessDamping::KelvinVoigt),
                       ::testing::Values(ElasticLaw::Corotated, ElasticLaw::NeoHookean)));

TEST(NodeCotangents, AReferenceThatIsSetIsThatOfABodyWithIt) {
  Bar scene(ElementKind::QuadraticTetrahedron, Integrator::Lagged, false);
  scene.set_blocks({});
  const Points rest = scene.body->reference_positions(), weight = test::deformed(rest, 0.3);
  const Points reference = rest + 1e-3 * test::deformed(rest, 0.7);
  Simulation simulation(scene.body, scene.options);
  const double without = weighted(simulation, scene.theta, weight);
  simulation.set_reference(reference);
  Simulation other(std::make_shared<Body>(with_reference(*scene.body, reference)), scene.options);
  const double with = weighted(simulation, scene.theta, weight);
  EXPECT_NEAR(with, weighted(other, scene.theta, weight), 1e-11 * std::abs(with));
  EXPECT_GT(std::abs(with - without), 1e-6 * std::abs(with));
}

TEST(NodeCotangents, ReferenceOfHexahedraIsRefused) {
  const test::TorusScene scene = test::torus_scene(0.04, last + 1);
  Simulation simulation(scene.body, scene.options);
  NodeCotangents nodes;
  nodes.with_reference = true;
  VectorX gradient;
  EXPECT_THROW(simulation.run_adjoint(
                   scene.theta, last, [](int, const State&) { return true; }, [](int, const State&, Points&) {},
                   gradient, &nodes),
               std::invalid_argument);
  EXPECT_THROW(simulation.set_reference(scene.body->reference_positions()), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::node_cotangents_test
