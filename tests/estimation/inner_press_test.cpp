// Static tests of an object that slides on a rigid body under it.
#include "estimation/gradient_check.hpp"
#include "estimation/grip_trial.hpp"
#include "estimation/indentation_trial.hpp"
#include "estimation/press_objective.hpp"
#include "support/presses.hpp"
#include "support/tolerance.hpp"

namespace pliant::inner_press_test {
namespace {

using test::tolerance;

constexpr double modulus = 8000.0, exponent = -5.0, ratio = 0.25;

/// A block clamped at one side that lies on a slide, pressed, indented and pulled along.
struct OnASlide : ::testing::Test {
  OnASlide() {
    theta = law_parameters(layout, modulus).reference();
    theta[layout.exponent(0)] = exponent, theta[layout.poissons_ratio()] = ratio;
    law = press_law(*block.body, layout, theta);
    scene = std::make_shared<PressScene>(block.scene({}, law));
    scene->held.clear();
    auto tests = std::make_shared<StaticTests>();
    ObservedGrip& grip = tests->grips.emplace_back();
    for (int n = 0; n < block.body->node_count(); ++n) {
      if (block.body->nodes(n, 0) < -0.0999) scene->held.push_back(n);
      if (block.body->nodes(n, 0) > 0.0999) grip.nodes.push_back(n);
    }
    scene->sliding = {rigid_smooth_grid(slide())};
    press({0.02, 0.05, 0.01}, {2.0, -15.0, 1.0});
    indent(*tests);
    pull(grip);
    scene->tests = tests;
  }

  /// A hill under the block that reaches up to its floor, with a radius of 0.5 m.
  static SignedDistance slide() {
    return {Box{{-0.15, -0.12, -0.15}, {0.15, 0.0, 0.15}}, 0.004,
            [](const Vector3& p) { return (p - Vector3(0.0, -0.55, 0.0)).norm() - 0.5; }};
  }

  void press(const Vector3& centre, const Vector3& force) {
    Press facts;
    facts.force = force, facts.contact_centre = centre, facts.contact_radius = 0.03;
    scene->facts.push_back(facts);
    std::vector<Vector3> markers;
    for (double x = -0.06; x < 0.09; x += 0.04)
      for (double z = -0.08; z < 0.09; z += 0.04) markers.emplace_back(x, 0.05, z);
    scene->presses.push_back({"press", "fit", force, markers, markers, false, 0.01});
    PressedBody body(*scene, 0, law, mean_modulus(*block.body, *law));
    ASSERT_TRUE(body.solve().converged) << body.equilibrium().failure();
    EXPECT_GT(body.equilibrium().contact_force(1, body.placement()).y(), 1.0) << "the slide carries";
    for (std::size_t m = 0; m < markers.size(); ++m)
      scene->presses.back().loaded[m] = body.points().row(Eigen::Index(m)).transpose();
  }

  void indent(StaticTests& tests) {
    ObservedIndentation& test = tests.indentations.emplace_back();
    test.name = "site", test.role = "fit";
    test.probe = {ProbeKind::Ball, {0.03, 0.05, 0.0}, 0.03, Vector3(0.0, -1.0, 0.0)};
    test.curve.depths = {0.004, 0.008};
    IndentedBody body(*scene, test, law, mean_modulus(*block.body, *law));
    for (std::size_t d = 0; d < 2; ++d) {
      ASSERT_TRUE(body.solve(d)) << body.failure();
      test.curve.forces.push_back(body.force(d)), test.curve.stds.push_back(0.05);
    }
  }

  void pull(ObservedGrip& test) {
    test.name = "end", test.role = "fit";
    test.displacement = {0.01, -0.006, 0.0};
    test.has_force = true, test.direction = Vector3(0.6, -0.8, 0.0), test.force_std = 0.1;
    test.rest = {{0.05, 0.05, 0.0}, {0.0, 0.05, 0.05}}, test.markers_std = 1e-4, test.seen.setIdentity();
    test.loaded.assign(2, Vector3::Zero());
    GrippedBody body(*scene, test, law);
    ASSERT_TRUE(body.solve()) << body.failure();
    test.force = body.force();
    for (Eigen::Index m = 0; m < 2; ++m) test.loaded[std::size_t(m)] = body.markers().row(m).transpose();
    PressScene loose = *scene;
    loose.sliding.clear();
    GrippedBody alone(loose, test, law);
    ASSERT_TRUE(alone.solve()) << alone.failure();
    EXPECT_GT(std::abs(test.force - alone.force()), 5.0 * test.force_std) << "the slide presses against the grip";
  }

  test::PressedBlock block;
  LawLayout layout{LawForm{1, 1}};
  VectorX theta;
  std::shared_ptr<const MaterialLaw> law;
  std::shared_ptr<PressScene> scene;
};

TEST_F(OnASlide, DerivativesAgreeWithDifferences) {
  ParameterSet set = law_parameters(layout, 1.3 * modulus);
  PressObjective objective(scene, {0}, layout, set, {{1e-4}, 6.0});
  const GradientCheck check = check_gradient(objective.cost(), set.to_unconstrained(set.reference()));
  ASSERT_TRUE(check.succeeded) << check.failure;
  EXPECT_TRUE(check.agrees()) << describe(check);
  for (const CheckedDerivative& d : check.derivatives) {
    EXPECT_EQ(d.verdict, CheckedDerivative::Verdict::Agree) << describe(check);
    EXPECT_GT(std::abs(d.by_tangents), 1e-3 * d.scale) << d.name;
  }
}

TEST_F(OnASlide, TheTruthFitsAndWithoutTheSlideItDoesNot) {
  const auto cost = [&](std::shared_ptr<const PressScene> of) {
    ParameterSet set = law_parameters(layout, modulus);
    set.set_reference(theta);
    PressObjective objective(of, {0}, layout, set, {{1e-4}, 6.0});
    const CostEvaluation evaluation = objective.evaluate(set.to_unconstrained(theta));
    EXPECT_TRUE(evaluation.succeeded) << evaluation.failure;
    EXPECT_EQ(evaluation.frames.size(), 4u);  // a press, two depths, a grip
    double sum = 0.0;                         // without what priors add
    for (const FrameFit& frame : evaluation.frames) sum += frame.cost;
    return sum;
  };
  EXPECT_LT(cost(scene), tolerance(1e-4));
  auto loose = std::make_shared<PressScene>(*scene);
  loose->sliding.clear();
  EXPECT_GT(cost(loose), 1e2);
}

}  // namespace
}  // namespace pliant::inner_press_test
