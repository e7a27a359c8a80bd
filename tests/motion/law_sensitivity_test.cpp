// Bodies of a material law in motion: derivatives of whole simulations by the law's numbers and all else.
#include "motion/simulation.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::law_sensitivity_test {
namespace {

using test::tolerance;

constexpr int last = 1;

enum class Start { Thrown, Pulled, Sagging };

/// A bar of 0.2 x 0.05 x 0.05 m that is held at one end: thrown along and across, or pulled aside and let go; its scan
/// may err. A stiffer one was scanned as it sags, and is thrown from there.
struct LawScene {
  LawScene(const LawForm& form, bool quadratic, Start start, Integrator integrator = Integrator::Newton)
      : body(test::tet_body({0.2, 0.05, 0.05}, {3, 1, 1}, quadratic, 0.0)) {
    for (int f = 0; f <= last; ++f) options.times.push_back(0.01 * f);
    options.max_dt = 0.005;
    options.newton.tolerance = 1e-13;
    options.integrator = integrator;
    if (integrator == Integrator::Lagged) options.solver.tolerance = options.solver.derivative_tolerance = 1e-12;
    options.holds = {Hold{[](const Vector3& p) { return p.x() < -0.0999; }}};
    options.shape = {{Vector3(0.1, 0.01, 0.0)}, 0.01, 0.1};
    MotionBlocks blocks = add_motion_blocks(layout, {.pulls = start == Start::Pulled ? 1 : 0, .scan_corrections = 1});
    options.material.elastic = LawLayout::of_motion(layout, blocks, form);
    options.blocks = blocks;
    theta = VectorX::Zero(layout.size());
    options.scan_sags = start == Start::Sagging;
    blocks.set_moduli(theta, options.scan_sags ? 5e4 : 2e4);
    theta[blocks.poissons_ratio] = 0.3;
    theta[blocks.mass_damping] = 0.5;
    theta[blocks.stiffness_damping] = 0.003;
    theta[blocks.density] = 100.0;
    theta.segment<3>(blocks.gravity) = Vector3(0.5, -9.7, 0.3);
    theta.segment<3>(blocks.linear_velocity) = Vector3(1.0, 1.5, -0.5);
    theta.segment<3>(blocks.scan_corrections[0]) = Vector3(0.2, -0.4, 0.3);
    if (start == Start::Pulled) theta.segment<3>(blocks.pulls[0]) = Vector3(0.02, 0.15, 0.05);
    for (int i = 0; i < form.terms; ++i) {
      theta[options.material.law_layout()->exponent(i)] = i == 0 ? 8.0 : -5.0;
      if (i > 0) theta[options.material.law_layout()->stiffness_ratio(i)] = 0.7;
      if (i > 0) theta[options.material.law_layout()->poissons_ratio(i)] = 0.2;
    }
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
  std::shared_ptr<const Body> body;
  ParameterLayout layout;
  SimulationOptions options;
  VectorX theta;
};

struct Form {
  const char* name;
  LawForm form;
  friend void PrintTo(const Form& f, std::ostream* out) { *out << f.name; }
};
const Form linear{"Linear", {1, 0}}, neo_hookean{"NeoHookean", {1, 0, 1, false, ElasticLaw::NeoHookean}},
    ogden{"Ogden", {1, 1}}, two_terms{"OgdenOfTwoTerms", {1, 2, 1, true}};

/// The law, the elements, the start, the integrator.
class LawSensitivity : public ::testing::TestWithParam<std::tuple<Form, bool, Start, Integrator>> {
 protected:
  LawScene scene{std::get<0>(GetParam()).form, std::get<1>(GetParam()), std::get<2>(GetParam()),
                 std::get<3>(GetParam())};
  /// All numbers of the law and some that meet it in other terms, each changed by as much as it is.
  std::vector<VectorX> directions() const {
    const MotionBlocks& blocks = scene.options.blocks;
    std::vector<ParameterHandle> handles = scene.options.material.law_layout()->all();
    handles.insert(handles.end(),
                   {blocks.stiffness_damping, blocks.density, blocks.linear_velocity, blocks.scan_corrections[0]});
    if (scene.options.scan_sags) handles.push_back(blocks.gravity);
    handles.insert(handles.end(), blocks.pulls.begin(), blocks.pulls.end());
    std::vector<VectorX> all;
    for (const ParameterHandle& at : handles)
      all.push_back(scene.theta[at] * VectorX::Unit(scene.theta.size(), at.first));
    return all;
  }
};

TEST_P(LawSensitivity, TangentsMatchCentralDifferences) {
  const std::vector<VectorX> all = directions();
  MatrixX columns(scene.theta.size(), Eigen::Index(all.size()));
  for (std::size_t c = 0; c < all.size(); ++c) columns.col(Eigen::Index(c)) = all[c];
  Simulation simulation(scene.body, scene.options);
  std::vector<VectorX> tangents;
  const auto summary =
      simulation.run(scene.theta, columns, last, [&](int f, const State&, std::span<const State> changes) {
        if (f == last)
          for (const State& change : changes) tangents.push_back(flat(change.x));
        return true;
      });
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  ASSERT_EQ(tangents.size(), all.size());
  for (std::size_t c = 0; c < all.size(); ++c) {
    ASSERT_GT(tangents[c].norm(), 1e-9) << "theta[" << c << "] has no effect: the test would prove nothing";
    const auto along = [&](double h) { return scene.positions_at(scene.theta + h * all[c], last); };
    // Bottom of the V between the differences' h^2 and the solver's tolerance / h.
    EXPECT_LT(test::best_relative_error(along, tangents[c], 0.1, 6), tolerance(1e-6)) << all[c].transpose();
  }
}

TEST_P(LawSensitivity, AdjointMatchesTangents) {
  Simulation simulation(scene.body, scene.options);
  const Points weight = test::deformed(scene.body->reference_positions(), 0.3);
  const std::vector<VectorX> all = directions();
  MatrixX columns(scene.theta.size(), Eigen::Index(all.size()));
  for (std::size_t c = 0; c < all.size(); ++c) columns.col(Eigen::Index(c)) = all[c];
  VectorX by_tangents = VectorX::Zero(columns.cols()), gradient;
  (void)simulation.run(scene.theta, columns, last, [&](int, const State&, std::span<const State> changes) {
    for (std::size_t c = 0; c < changes.size(); ++c)
      by_tangents[Eigen::Index(c)] += weight.cwiseProduct(changes[c].x).sum();
    return true;
  });
  const auto summary = simulation.run_adjoint(
      scene.theta, last, [](int, const State&) { return true; }, [&](int, const State&, Points& bar) { bar += weight; },
      gradient);
  ASSERT_TRUE(summary.succeeded) << summary.failure;
  // What lies between the two are the tolerances of the linear solvers, 1e-12, over several steps.
  for (Eigen::Index c = 0; c < columns.cols(); ++c)
    EXPECT_NEAR(gradient.dot(columns.col(c)), by_tangents[c], tolerance(1e-8) * std::abs(by_tangents[c])) << c;
}

INSTANTIATE_TEST_SUITE_P(Laws, LawSensitivity,
                         ::testing::Combine(::testing::Values(linear, neo_hookean, ogden, two_terms),
                                            ::testing::Values(false), ::testing::Values(Start::Thrown),
                                            ::testing::Values(Integrator::Newton)),
                         [](const auto& c) { return std::string(std::get<0>(c.param).name); });
INSTANTIATE_TEST_SUITE_P(OfQuadraticElements, LawSensitivity,
                         ::testing::Combine(::testing::Values(neo_hookean, two_terms), ::testing::Values(true),
                                            ::testing::Values(Start::Thrown), ::testing::Values(Integrator::Newton)),
                         [](const auto& c) { return std::string(std::get<0>(c.param).name); });
INSTANTIATE_TEST_SUITE_P(Released, LawSensitivity,
                         ::testing::Combine(::testing::Values(neo_hookean, two_terms), ::testing::Values(false),
                                            ::testing::Values(Start::Pulled), ::testing::Values(Integrator::Newton)),
                         [](const auto& c) { return std::string(std::get<0>(c.param).name); });

INSTANTIATE_TEST_SUITE_P(ScannedSagging, LawSensitivity,
                         ::testing::Combine(::testing::Values(linear, neo_hookean, two_terms), ::testing::Values(false),
                                            ::testing::Values(Start::Sagging), ::testing::Values(Integrator::Newton)),
                         [](const auto& c) { return std::string(std::get<0>(c.param).name); });
INSTANTIATE_TEST_SUITE_P(QuadraticScannedSagging, LawSensitivity,
                         ::testing::Combine(::testing::Values(neo_hookean, two_terms), ::testing::Values(true),
                                            ::testing::Values(Start::Sagging), ::testing::Values(Integrator::Newton)),
                         [](const auto& c) { return std::string(std::get<0>(c.param).name); });

std::string name_of(Start start) {
  return start == Start::Thrown ? "Thrown" : start == Start::Pulled ? "Pulled" : "Sagging";
}
INSTANTIATE_TEST_SUITE_P(OfPredictedSteps, LawSensitivity,
                         ::testing::Combine(::testing::Values(neo_hookean, two_terms), ::testing::Values(true),
                                            ::testing::Values(Start::Thrown, Start::Pulled, Start::Sagging),
                                            ::testing::Values(Integrator::Lagged)),
                         [](const auto& c) { return std::get<0>(c.param).name + name_of(std::get<2>(c.param)); });

/// The thrown bar of the linear law moves as corotated elasticity has it, whose rotations are one an element: the same
/// for linear tetrahedra without stiffness damping.
TEST(LawSimulation, OfTheLinearLawIsThatOfCorotatedElasticity) {
  LawScene scene(linear.form, false, Start::Thrown);
  scene.theta[scene.options.blocks.stiffness_damping] = 0.0;
  const VectorX by_law = scene.positions_at(scene.theta, last), rest = scene.positions_at(scene.theta, 0);
  scene.options.material.elastic = ElasticLaw::Corotated;
  scene.options.integrator = Integrator::Newton;
  const VectorX corotated = scene.positions_at(scene.theta, last);
  EXPECT_LT((by_law - corotated).norm(), tolerance(1e-9) * (corotated - rest).norm());
}

TEST(LawSimulation, TakesALawAsItIsOrOutOfTheParameters) {
  LawScene scene(two_terms.form, false, Start::Thrown);
  const VectorX by_parameters = scene.positions_at(scene.theta, last);
  scene.options.material.elastic = law_at(*scene.body, *scene.options.material.law_layout(), scene.theta);
  EXPECT_EQ((scene.positions_at(scene.theta, last) - by_parameters).norm(), 0.0);
}

/// Without a velocity a body stays where its scan has it, whatever law holds it up; with less to hold it it does not.
TEST(LawSimulation, AScanThatSagsIsAnEquilibriumOfEveryLaw) {
  for (const Form& form : {linear, neo_hookean, ogden, two_terms})
    for (const bool quadratic : {false, true}) {
      LawScene scene(form.form, quadratic, Start::Sagging);
      const MotionBlocks& blocks = scene.options.blocks;
      scene.theta.segment<3>(blocks.linear_velocity).setZero();
      scene.theta.segment<3>(blocks.scan_corrections[0]).setZero();
      const VectorX there = scene.positions_at(scene.theta, last);
      EXPECT_LT((there - flat(scene.body->nodes)).cwiseAbs().maxCoeff(), tolerance(1e-9)) << form.name;
      const auto free = Simulation(scene.body, scene.options).rest_body(scene.theta);
      EXPECT_GT((free->nodes - scene.body->nodes).rowwise().norm().maxCoeff(), 4e-3) << form.name;
    }
}

/// An element turned inside out within a step is a reason to back off, or to say so: never forces of another state.
TEST(LawSimulation, SaysSoWhereAStepWouldTurnElementsInsideOut) {
  LawScene scene(ogden.form, false, Start::Thrown);
  scene.theta.segment<3>(scene.options.blocks.linear_velocity) = Vector3(-1e5, 0.0, 0.0);
  Simulation simulation(scene.body, scene.options);
  const RolloutSummary summary = simulation.run(scene.theta, [](int, const State&, auto) { return true; });
  EXPECT_FALSE(summary.succeeded);
  EXPECT_NE(summary.failure.find("Newton"), std::string::npos) << summary.failure;
}

}  // namespace
}  // namespace pliant::law_sensitivity_test
