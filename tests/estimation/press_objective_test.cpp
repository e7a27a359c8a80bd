#include "estimation/press_objective.hpp"

#include "estimation/optimiser.hpp"
#include "support/derivatives.hpp"
#include "support/presses.hpp"
#include "support/tolerance.hpp"

namespace pliant::press_objective_test {
namespace {

using test::tolerance;

/// Two halves of different stiffness along x.
std::shared_ptr<const Body> with_halves(const Body& body) {
  auto copy = std::make_shared<Body>(body);
  copy->modulus.controls = 2;
  copy->modulus.weights = MatrixX::Zero(body.element_count(), 2);
  for (int e = 0; e < body.element_count(); ++e) {
    double x = 0.0;
    for (const int n : body.element(e)) x += 0.25 * body.nodes(n, 0);
    const double share = std::clamp(0.5 + 5.0 * x, 0.0, 1.0);
    copy->modulus.weights.row(e) << 1.0 - share, share;
  }
  return copy;
}

struct Presses : ::testing::TestWithParam<LawForm> {
  Presses() {
    test::PressedBlock block;
    block.body = with_halves(*block.body);
    set = law_parameters(layout, 9000.0);
    truth = set.reference();
    truth[layout.modulus(1)] = 14000.0;
    for (int law = 0; law < form.laws; ++law)
      for (int term = 0; term < std::max(1, form.terms); ++term)
        truth[layout.poissons_ratio(term, law)] = form.own_ratios ? 0.2 + 0.1 * term + 0.05 * law : 0.2;
    scene = std::make_shared<PressScene>(
        block.scene(test::PressedBlock::presses(), press_law(*block.body, layout, truth), 1e-4));
  }
  PressObjective objective(double outlier_scale = 5.0) const {
    return {scene, {0, 1, 2, 3}, layout, set, {1e-4, outlier_scale}};
  }
  const LawForm form = GetParam();
  LawLayout layout{form};
  ParameterSet set;
  VectorX truth;
  std::shared_ptr<const PressScene> scene;
};

TEST_P(Presses, GradientMatchesCentralDifferences) {
  PressObjective cost = objective();
  const VectorX p = set.to_unconstrained(set.reference());
  const CostEvaluation at = cost.linearise(p);
  ASSERT_TRUE(at.succeeded) << at.failure;
  for (Eigen::Index k = 0; k < p.size(); ++k) {
    const auto along = [&](double h) {
      const CostEvaluation e = cost.evaluate(p + h * VectorX::Unit(p.size(), k));
      EXPECT_TRUE(e.succeeded) << e.failure;
      return VectorX::Constant(1, e.cost);
    };
    EXPECT_LT(test::best_relative_error(along, at.gradient.segment(k, 1), 0.1), tolerance(1e-5)) << k;
  }
}

TEST_P(Presses, GradientByTheAdjointIsThatByTangents) {
  PressObjective cost = objective();
  const VectorX p = set.to_unconstrained(set.reference());
  const CostEvaluation tangents = cost.linearise(p), adjoint = cost.cost().gradient(p);
  ASSERT_TRUE(tangents.succeeded && adjoint.succeeded) << tangents.failure << adjoint.failure;
  ASSERT_GT(tangents.gradient.norm(), 1.0);
  EXPECT_LT((adjoint.gradient - tangents.gradient).norm(), tolerance(1e-6) * tangents.gradient.norm());
}

/// What is guessed from derivatives shortens the way to an equilibrium, and leads to the same one, near and far from
/// where they were taken.
TEST_P(Presses, SetOutFromWhereDerivativesLead) {
  const auto material = std::make_shared<PressedMaterial>(scene->body, layout);
  const auto trial = [&] { return PressTrial(scene, 0, material, set.reference(), {{1e-4}, 5.0}); };
  PressTrial led = trial(), unled = trial();
  const VectorX p = set.to_unconstrained(set.reference());
  const VectorX towards = VectorX::Constant(p.size(), 1.0);
  const MatrixX none(set.reference().size(), 0);
  const auto theta = [&](double share) { return set.to_theta(p + share * towards); };
  ASSERT_TRUE(led.run(theta(0.0), set.jacobian(p)).succeeded);
  ASSERT_TRUE(unled.run(theta(0.0), none).succeeded);
  for (const double share : {0.01, 1.0, 0.1}) {
    ASSERT_TRUE(led.run(theta(share), none).succeeded && unled.run(theta(share), none).succeeded) << share;
    EXPECT_LT((led.residuals() - unled.residuals()).norm(), 1e-7 * unled.displacements().norm()) << share;
    if (share == 0.01) {
      EXPECT_LT(led.iterations(), unled.iterations());
    }
  }
  ASSERT_TRUE(led.run(theta(0.1), none).succeeded);
  EXPECT_EQ(led.iterations(), 0) << "it is there";
}

TEST(LinearisedEquilibria, LeadAsFarAsTheyAreTrusted) {
  const Points nodes = Points::Constant(2, 3, 1.0), change = Points::Constant(3, 3, 0.5);
  LinearisedEquilibrium linearised;
  const Eigen::Vector2d theta(1.0, 2.0);
  EXPECT_FALSE(linearised.at(0, theta, 1.0)) << "there is none yet";
  linearised.set(0, theta, {nodes, Points::Zero(1, 3)}, {1}, {change});
  const auto there = linearised.at(0, theta + Eigen::Vector2d(7.0, 0.01), 1.0);
  ASSERT_TRUE(there);
  EXPECT_NEAR(there->nodes(1, 2), 1.005, 1e-15);
  EXPECT_NEAR(there->translations(0, 0), 0.005, 1e-15);
  EXPECT_FALSE(linearised.at(0, theta + Eigen::Vector2d(0.0, 0.1), 1.0)) << "0.05 of the size";
  EXPECT_FALSE(linearised.at(1, theta, 1.0)) << "of another form";
  linearised.set(0, theta, {nodes, Points::Zero(1, 3)}, {}, {});
  EXPECT_FALSE(linearised.at(0, theta, 1.0)) << "no numbers";
}

/// A trial that begins where another one of the press has ended finds the same, in fewer iterations.
TEST_P(Presses, SetOutFromAnotherTrialsPlacement) {
  const auto material = std::make_shared<PressedMaterial>(scene->body, layout);
  const VectorX& theta = set.reference();
  const MatrixX none(theta.size(), 0);
  const MarkerNoise noise{1e-4};
  PressTrial first(scene, 0, material, theta, {noise, 5.0});
  EXPECT_EQ(first.placements().front().nodes.size(), 0);
  ASSERT_TRUE(first.run(theta, none).succeeded);
  const Placement placement = first.placements().front();
  PressTrial second(scene, 0, material, theta, {noise, 5.0}, 0, &placement);
  ASSERT_TRUE(second.run(theta, none).succeeded);
  EXPECT_GT(first.iterations(), 1);
  EXPECT_EQ(second.iterations(), 0);
  EXPECT_LT((first.residuals() - second.residuals()).norm(), 1e-7 * first.displacements().norm());
  PressObjective before = objective();
  ASSERT_TRUE(before.evaluate(set.to_unconstrained(theta)).succeeded);
  EXPECT_EQ(before.placements().size(), 4U);
  EXPECT_GT(before.placements().back().front().nodes.size(), 0);
}

TEST_P(Presses, NoiseThatGrowsGoesByWhereTheLawHasThePoints) {
  PressObjective cost(scene, {0, 1, 2, 3}, layout, set, {{1e-4, 0.05}, 5.0});
  const VectorX p = set.to_unconstrained(set.reference());
  ASSERT_TRUE(cost.evaluate(p).succeeded);
  EXPECT_GT(cost.typical_deviation(), 1.05e-4);
  EXPECT_GT(cost.weighed_squares(), 0.0);
  // Where all deviations are the same, squares are weighed by nothing.
  double squares = 0.0;
  for (const double r : cost.residuals()) squares += r * r;
  cost.set_options({1e-4, 5.0});
  EXPECT_NEAR(cost.weighed_squares(), squares, 1e-9 * squares);
  EXPECT_NEAR(cost.typical_deviation(), 1e-4, 1e-12);
  cost.set_options({{1e-4, 0.05}, 5.0});
  const CostEvaluation at = cost.linearise(p), adjoint = cost.cost().gradient(p);
  ASSERT_TRUE(at.succeeded && adjoint.succeeded) << at.failure << adjoint.failure;
  EXPECT_LT((adjoint.gradient - at.gradient).norm(), tolerance(1e-6) * at.gradient.norm());
  const auto along = [&](double h) {
    return VectorX::Constant(1, cost.evaluate(p + h * VectorX::Unit(p.size(), 0)).cost);
  };
  EXPECT_LT(test::best_relative_error(along, at.gradient.segment(0, 1), 0.1), tolerance(1e-5));
}

TEST_P(Presses, StatedDeviationsWeighCoordinatesAgainstEachOther) {
  std::vector<ObservedPress> stated = scene->presses;
  ASSERT_TRUE(stated[0].has_probe);
  const std::size_t markers = stated[0].rest.size() - 1;
  stated[0].weights.assign(3 * markers, 2e-4);
  stated[0].weights[4] = 1e-3;
  stated[0].weights[5] = std::numeric_limits<double>::quiet_NaN();
  weigh_by_stated_deviations(stated);
  EXPECT_DOUBLE_EQ(stated[0].weight(0), 1.0);
  EXPECT_DOUBLE_EQ(stated[0].weight(4), 5.0);
  EXPECT_DOUBLE_EQ(stated[0].weight(5), 1.0) << "not stated";
  EXPECT_DOUBLE_EQ(stated[0].weight(3 * markers), 1.0) << "the probe's";
  EXPECT_DOUBLE_EQ(stated[1].weight(4), 1.0);
}

TEST_P(Presses, GaussNewtonMatrixIsThatOfTheResidualsDerivatives) {
  PressObjective cost = objective(1e9);  // no loss: the matrix is J^T J
  const VectorX p = set.to_unconstrained(set.reference());
  const CostEvaluation at = cost.linearise(p);
  const auto residuals = [&](const VectorX& q) {
    EXPECT_TRUE(cost.evaluate(q).succeeded);
    const std::vector<double> r = cost.residuals();
    return VectorX(Eigen::Map<const VectorX>(r.data(), Eigen::Index(r.size())) / 1e-4);
  };
  MatrixX J;
  const double h = 1e-4;
  for (Eigen::Index k = 0; k < p.size(); ++k) {
    const VectorX column =
        (residuals(p + h * VectorX::Unit(p.size(), k)) - residuals(p - h * VectorX::Unit(p.size(), k))) / (2 * h);
    J.conservativeResize(column.size(), p.size());
    J.col(k) = column;
  }
  MatrixX expected = J.transpose() * J, curvature;
  VectorX gradient;
  set.prior(p, &gradient, &curvature);
  expected += curvature;
  EXPECT_LT((at.gauss_newton - expected).norm(), tolerance(1e-5) * expected.norm());
}

TEST_P(Presses, TruthIsFoundFromElsewhere) {
  PressObjective cost = objective();
  OptimiserOptions options;
  options.max_iterations = 40;
  const OptimiserSummary s = minimise(cost.cost(), set.to_unconstrained(set.reference()), options);
  ASSERT_TRUE(s.succeeded) << s.reason;
  const VectorX theta = set.to_theta(s.p);
  EXPECT_LT(s.evaluation.cost, cost.evaluate(set.to_unconstrained(truth)).cost + 1.0);
  if (form.laws > 1) return;  // four presses do not tell two laws apart
  // The law itself and the mesh are those of the recording; 0.1 mm of noise on a hundred markers.
  EXPECT_NEAR(theta[layout.modulus(0)], truth[layout.modulus(0)], 0.03 * truth[layout.modulus(0)]);
  EXPECT_NEAR(theta[layout.modulus(1)], truth[layout.modulus(1)], 0.03 * truth[layout.modulus(1)]);
  if (!form.own_ratios) {
    EXPECT_NEAR(theta[layout.poissons_ratio()], 0.2, 0.02);
  }
}

TEST_P(Presses, AWrongMarkerHardlyMoves) {
  auto spoilt = std::make_shared<PressScene>(*scene);
  spoilt->presses[1].loaded[3] += Vector3(0.03, 0.0, 0.02);
  PressObjective cost(spoilt, {0, 1, 2, 3}, layout, set, {1e-4, 5.0});
  const OptimiserSummary s = minimise(cost.cost(), set.to_unconstrained(truth), {});
  ASSERT_TRUE(s.succeeded) << s.reason;
  EXPECT_NEAR(set.to_theta(s.p)[layout.modulus(0)], truth[layout.modulus(0)], 0.03 * truth[layout.modulus(0)]);
}

INSTANTIATE_TEST_SUITE_P(Laws, Presses,
                         ::testing::Values(LawForm{2, 0}, LawForm{2, 1}, LawForm{2, 2}, LawForm{2, 2, 1, true},
                                           LawForm{2, 0, 2}, LawForm{2, 2, 2, true}, LawForm{2, 2, 2}),
                         [](const auto& c) {
                           const LawForm& l = c.param;
                           return (l.terms == 0 ? "Linear" : "Ogden" + std::to_string(l.terms)) +
                                  (l.laws > 1 ? "OfZones" : "") + (l.own_ratios ? "Apart" : "");
                         });

TEST(PressLaw, TableFollowsThetaAsItsDerivativeSays) {
  const test::PressedBlock block;
  auto body = std::make_shared<Body>(*with_halves(*block.body));
  for (const LawForm& form : {LawForm{2, 0, 2}, LawForm{2, 1}, LawForm{2, 3}, LawForm{2, 3, 2, true}}) {
    const LawLayout layout(form);
    VectorX theta = law_parameters(layout, 7000.0).reference();
    for (Eigen::Index i = 1; i < theta.size(); ++i) theta[i] *= 1.0 + 0.03 * double(i % 5);
    const int e = 40;  // both controls have a share in it
    ASSERT_GT(body->modulus.weights.row(e).minCoeff(), 0.05);
    const MatrixX by_theta = law_parameters_by_theta(*body, layout, theta, e);
    for (Eigen::Index i = 0; i < theta.size(); ++i) {
      const auto along = [&](double h) -> VectorX {
        VectorX moved = theta;
        moved[i] += h * std::abs(theta[i]);
        return press_law(*body, layout, moved)->table().row(e).transpose();
      };
      EXPECT_LT(test::best_relative_error(along, std::abs(theta[i]) * by_theta.col(i), 1e-2), 1e-7) << i;
    }
  }
}

TEST(PressLaw, HasTheModulusOfItsThetaAtRest) {
  const auto body = test::PressedBlock().body;
  const LawLayout layout({1, 3, 1, true});
  const ParameterSet set = law_parameters(layout, 7000.0);
  VectorX theta = set.reference();
  theta[layout.poissons_ratio(1)] = 0.05;
  theta[layout.poissons_ratio(2)] = 0.45;
  EXPECT_NEAR(press_law(*body, layout, theta)->small_strain(0).youngs_modulus, 7000.0, 1e-8);
}

TEST(PressScene, StartsFromAPunchOnAHalfSpace) {
  const test::PressedBlock block;
  const LawLayout layout({1, 1});
  const ParameterSet set = law_parameters(layout, 9000.0);
  const PressScene scene = block.scene(test::PressedBlock::presses(), press_law(*block.body, layout, set.reference()));
  EXPECT_GT(punch_modulus(scene, 0.3), 3000.0);
  EXPECT_LT(punch_modulus(scene, 0.3), 27000.0);
}

TEST(PressScene, MarkersTellTheirNoiseByThemselves) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const double noise : {0.0, 2e-4, 1e-3}) {
    ObservedPress press{"press 1", "fit", Vector3::UnitY(), {}, {}, false, 0.01};
    for (double a = -0.1; a < 0.1; a += 0.01)
      for (double b = -0.1; b < 0.1; b += 0.01) {
        const Vector3 at(a, 0.05, b), moved(0.1 * b, -0.01 * std::exp(-(a * a + b * b) / 0.005), 0.05 * a);
        press.rest.push_back(at);
        press.loaded.push_back(at + moved + noise * Vector3(normal(random), normal(random), normal(random)));
      }
    EXPECT_NEAR(marker_noise(press), noise, 0.1 * noise + 5e-5);
  }
}

TEST(PressObjective, FailsInWordsWithThePress) {
  const test::PressedBlock block;
  const LawLayout layout({1, 1});
  const ParameterSet set = law_parameters(layout, 9000.0);
  auto scene = std::make_shared<PressScene>(
      block.scene(test::PressedBlock::presses(), press_law(*block.body, layout, set.reference())));
  scene->facts[2].force.y() = std::numeric_limits<double>::quiet_NaN();
  PressObjective cost(scene, {1, 2}, layout, set, {1e-4, 5.0});
  const CostEvaluation e = cost.evaluate(set.to_unconstrained(set.reference()));
  EXPECT_FALSE(e.succeeded);
  EXPECT_THAT(e.failure, ::testing::HasSubstr("press 3"));
}

}  // namespace
}  // namespace pliant::press_objective_test
