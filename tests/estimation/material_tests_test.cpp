#include "estimation/material_tests.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

#include "capture/curves.hpp"
#include "estimation/press_fit.hpp"
#include "motion/equilibrium.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"
#include "temporary_folder.hpp"

namespace pliant::material_tests_test {
namespace {

using test::tolerance;

MatrixX row(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::RowVectorXd>(values.data(), Eigen::Index(values.size()));
}
std::shared_ptr<const OgdenLaw> ogden(const std::vector<double>& parameters) {
  return std::make_shared<OgdenLaw>(row(parameters));
}

const std::vector<double> foam = {1500.0, 8.0, 0.2, 1500.0, -6.0, 0.2};
const std::vector<double> rubber = {3e5, 1.4, 0.4995, 2e3, -2.5, 0.4995, 1e3, 5.2, 0.4995};

/// One of every mode and measure, over moderate strains.
std::vector<MaterialTest> all_modes() {
  const std::vector<double> stretch = {0.7, 0.9, 1.02, 1.3, 1.6}, shear = {-0.4, -0.1, 0.05, 0.3};
  const std::vector<double> second = {1.2, 1.1, 0.95, 0.9, 1.4};
  using enum TestMode;
  using enum StressMeasure;
  std::vector<MaterialTest> tests = {{"uniaxial", Uniaxial, First, stretch, {}, {}},
                                     {"pure shear", PureShear, First, stretch, {}, {}},
                                     {"pure shear, other side", PureShear, Second, stretch, {}, {}},
                                     {"equibiaxial", Equibiaxial, First, stretch, {}, {}},
                                     {"biaxial", Biaxial, First, stretch, {}, second},
                                     {"biaxial, second", Biaxial, Second, stretch, {}, second},
                                     {"difference", Biaxial, CauchyDifference, stretch, {}, second},
                                     {"shear", SimpleShear, First, shear, {}, {}},
                                     {"shear after compression", SimpleShear, First, shear, {}, {}, 0.8},
                                     {"confined", ConfinedUniaxial, First, stretch, {}, {}}};
  for (MaterialTest& t : tests) t.stress.assign(t.stretch.size(), 1.0);
  return tests;
}

/// The stresses of a law in the place of measured ones.
MaterialTest seen_of(const MaterialLaw& law, MaterialTest test) {
  test.stress = predict_test(law, test);
  return test;
}
MaterialTest seen_of(const MaterialLaw& law, TestMode mode, double from, double to, int count) {
  MaterialTest test;
  test.name = "made", test.mode = mode;
  const VectorX at = VectorX::LinSpaced(count, from, to);
  test.stretch.assign(at.begin(), at.end());
  return seen_of(law, test);
}

TEST(MaterialTests, LeaveFreeFacesWithoutStress) {
  for (const auto& law : {ogden(foam), ogden(rubber)})
    for (const MaterialTest& t : all_modes()) {
      if (t.mode == TestMode::ConfinedUniaxial || t.mode == TestMode::SimpleShear) continue;
      for (std::size_t i = 0; i < t.stretch.size(); ++i) {
        const TestPoint point = solve_test(*law, 0, t, i);
        ASSERT_TRUE(point.found) << t.name;
        const double scale = tolerance(1e-9) * law->small_strain(0).youngs_modulus;
        EXPECT_NEAR(point.P(2, 2), 0.0, scale) << t.name;
        if (t.mode == TestMode::Uniaxial) {
          EXPECT_NEAR(point.P(1, 1), 0.0, scale);
        }
      }
    }
}

TEST(MaterialTests, OfALinearLawAreWhatABookSays) {
  const double E = 2e4, nu = 0.3;
  const LambdaAlpha p = lambda_alpha({E, nu});
  const LinearLaw law(row({p.lambda, p.alpha}));
  const MaterialTest uniaxial = seen_of(law, TestMode::Uniaxial, 0.6, 2.0, 7);
  const MaterialTest wide = seen_of(law, TestMode::PureShear, 0.6, 2.0, 7);
  for (std::size_t i = 0; i < uniaxial.stretch.size(); ++i) {
    EXPECT_NEAR(uniaxial.stress[i], E * (uniaxial.stretch[i] - 1.0), tolerance(1e-9) * E);
    EXPECT_NEAR(wide.stress[i], E / (1.0 - nu * nu) * (wide.stretch[i] - 1.0), tolerance(1e-9) * E);
  }
  // Its side would have to turn inside out.
  MaterialTest far = uniaxial;
  far.stretch = {6.0}, far.stress = {1.0};
  EXPECT_TRUE(std::isnan(predict_test(law, far)[0]));
}

TEST(MaterialTests, ChangeWithTheLawsParametersAsDerivativesSay) {
  for (const auto& parameters : {foam, rubber})
    for (const MaterialTest& t : all_modes()) {
      if (parameters == rubber && t.mode == TestMode::ConfinedUniaxial) continue;  // no rubber gives way so far
      for (std::size_t i = 0; i < t.stretch.size(); ++i) {
        const TestPoint point = solve_test(*ogden(parameters), 0, t, i, true);
        ASSERT_TRUE(point.found) << t.name;
        VectorX direction(Eigen::Index(parameters.size()));
        for (std::size_t k = 0; k < parameters.size(); ++k)
          direction[Eigen::Index(k)] =
              k % 3 == 2 ? 0.1 * (0.5 - parameters[k]) : (0.3 + 0.2 * double(k % 2)) * parameters[k];
        const auto along = [&](double s) {
          std::vector<double> moved = parameters;
          for (std::size_t k = 0; k < moved.size(); ++k) moved[k] += s * direction[Eigen::Index(k)];
          return VectorX::Constant(1, solve_test(*ogden(moved), 0, t, i).stress);
        };
        const VectorX derivative = VectorX::Constant(1, point.by_parameters.dot(direction));
        EXPECT_LT(test::best_relative_error(along, derivative, 1.0), tolerance(2e-5)) << t.name << " " << i;
      }
    }
}

TEST(MaterialTests, CostOfCurvesHasTheGradientThatDifferencesShow) {
  std::vector<MaterialTest> tests;
  const auto truth = ogden(foam);
  for (const MaterialTest& t : all_modes()) tests.push_back(seen_of(*truth, t));
  for (const int terms : {0, 1, 3}) {
    const LawLayout layout({1, terms});
    const ParameterSet parameters = law_parameters(layout, 5e3);
    std::vector<std::unique_ptr<Trial>> trials;
    for (const MaterialTest& t : tests)
      trials.push_back(std::make_unique<CurveTrial>(t, int(trials.size()), layout, 0.05, parameters));
    Objective objective(std::move(trials), parameters);
    VectorX p = objective.parameters().to_unconstrained(objective.parameters().reference());
    p.array() += 0.05;
    const CostEvaluation at = objective.linearise(p);
    ASSERT_TRUE(at.succeeded) << at.failure;
    for (Eigen::Index k = 0; k < p.size(); ++k) {
      const auto along = [&](double s) {
        return VectorX::Constant(1, objective.evaluate(p + s * VectorX::Unit(p.size(), k)).cost);
      };
      EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, at.gradient[k]), 1.0), tolerance(1e-6))
          << terms << " terms, " << objective.parameters().coordinate_names()[std::size_t(k)];
    }
  }
}

/// A capture of curves, whose stresses have a standard deviation of so much of each curve's greatest.
Capture capture_of(const test::TemporaryFolder& folder, const std::vector<MaterialTest>& tests, double noise) {
  Capture capture;
  capture.name = "specimen", capture.file = folder / "capture.toml";
  for (const MaterialTest& t : tests) {
    MaterialCurve& curve = capture.material_curves.emplace_back();
    curve.mode = t.mode, curve.measure = t.measure, curve.prestretch = t.prestretch;
    curve.curve = folder / ("curve-" + std::to_string(capture.material_curves.size()) + ".csv");
    write_stress_curve(curve.curve, {t.stretch, t.second, t.stress,
                                     std::vector<double>(t.stress.size(), noise * t.greatest_stress())});
  }
  return capture;
}

/// The law that `fit` makes of curves alone, without choices but for a Poisson's ratio that is known.
FitOutcome fitted(const std::vector<MaterialTest>& tests, double noise, std::optional<double> poissons_ratio = {}) {
  const test::TemporaryFolder folder;
  const Capture capture = capture_of(folder, tests, noise);
  FitOptions options;
  if (poissons_ratio) options.parameters["poissons_ratio"] = {VectorX::Constant(1, *poissons_ratio), false, {}};
  return fit_presses({&capture}, options);
}

TEST(MaterialTests, RecoverAFoamFromCurvesWithoutNoise) {
  const auto truth = ogden(foam);
  const FitOutcome fit = fitted(
      {seen_of(*truth, TestMode::Uniaxial, 0.5, 1.4, 30), seen_of(*truth, TestMode::ConfinedUniaxial, 0.6, 1.3, 30)},
      1e-4);
  ASSERT_TRUE(fit.law) << fit.reason;
  ASSERT_EQ(fit.law->layout.form().terms, 2);
  const MatrixX& table = std::dynamic_pointer_cast<const TabulatedLaw>(fit.law->law)->table();
  for (std::size_t k = 0; k < foam.size(); ++k)
    EXPECT_NEAR(table(0, Eigen::Index(k)) / foam[k], 1.0, tolerance(2e-3)) << k;
}

MaterialTest with_noise(MaterialTest test, double relative, unsigned seed) {
  double greatest = 0.0;
  for (const double stress : test.stress) greatest = std::max(greatest, std::abs(stress));
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (double& stress : test.stress) stress += relative * greatest * normal(random);
  return test;
}

/// Uniaxial tension determines terms of positive exponents, and is fitted by those; one of a negative exponent shows
/// only where a side is stretched, too.
TEST(MaterialTests, PredictModesThatWereNotFitted) {
  const std::vector<double> positive = {3e5, 1.4, 0.4995, 1e3, 5.2, 0.4995};
  for (const auto& parameters : {positive, rubber}) {
    const auto truth = ogden(parameters);
    const double noise = 1e-4, from = parameters == rubber ? 0.6 : 1.02;
    std::vector<MaterialTest> seen = {with_noise(seen_of(*truth, TestMode::Uniaxial, from, 6.0, 40), noise, 1)};
    if (parameters == rubber)
      seen.push_back(with_noise(seen_of(*truth, TestMode::Equibiaxial, 1.0, 3.0, 40), noise, 2));
    const FitOutcome fit = fitted(seen, noise, 0.4995);
    ASSERT_TRUE(fit.law) << fit.reason;
    EXPECT_EQ(fit.law->layout.form().terms, int(parameters.size()) / 3);
    for (const auto& [mode, to] : {std::pair{TestMode::PureShear, 4.0}, std::pair{TestMode::Equibiaxial, 2.5},
                                   std::pair{TestMode::SimpleShear, 1.0}}) {
      const MaterialTest other = seen_of(*truth, mode, mode == TestMode::SimpleShear ? 0.0 : 1.0, to, 20);
      EXPECT_LT(relative_rms(other, predict_test(*fit.law->law, other)), tolerance(1e-3));
    }
  }
}

TEST(MaterialTests, AddNoTermThatTheCurvesDoNotAskFor) {
  const auto truth = ogden({2e3, 4.0, 0.3});
  MaterialTest seen = seen_of(*truth, TestMode::Uniaxial, 0.7, 1.5, 40);
  for (std::size_t i = 0; i < seen.stress.size(); ++i) seen.stress[i] += 30.0 * std::sin(37.0 * double(i * i));
  const FitOutcome fit = fitted({seen}, 0.01, 0.3);
  ASSERT_TRUE(fit.law) << fit.reason;
  EXPECT_EQ(fit.law->layout.form().terms, 1);
  EXPECT_EQ(fit.law->tried.size(), 2u);
}

/// As fits of presses and motions are.
TEST(MaterialTests, AFitOfCurvesGoesOnWhereItWasInterrupted) {
  const auto truth = ogden(foam);
  const test::TemporaryFolder folder;
  const Capture capture = capture_of(
      folder,
      {seen_of(*truth, TestMode::Uniaxial, 0.5, 1.4, 30), seen_of(*truth, TestMode::ConfinedUniaxial, 0.6, 1.3, 30)},
      1e-3);
  const FitOutcome whole = fit_presses({&capture}, {});
  FitState kept;
  int states = 0;
  FitMonitor monitor;
  monitor.on_state = [&](const FitState& state) { kept = state, ++states; };
  monitor.interrupted = [&] { return states >= 12; };
  const FitOutcome part = fit_presses({&capture}, {}, monitor);
  EXPECT_TRUE(part.interrupted);
  const FitOutcome resumed = fit_presses({&capture}, {}, {}, kept);
  EXPECT_FALSE(resumed.interrupted);
  EXPECT_EQ(resumed.theta, whole.theta);
}

/// The mean nominal stress of a body by the forces that hold its boundary: sum f X^T / V.
Matrix3 mean_stress(Equilibrium& equilibrium, const Placement& placement) {
  const Body& body = equilibrium.body();
  Points forces = Points::Zero(body.node_count(), 3);
  (void)equilibrium.elasticity().evaluate(placement.nodes, false);
  equilibrium.elasticity().add_gradient(forces);
  return forces.transpose() * body.nodes / body.volume();
}

TEST(MaterialTests, AreThoseOfACubeOfTetrahedra) {
  const auto body = test::tet_body({0.1, 0.1, 0.1}, {3, 3, 3}, false);
  MatrixX q(body->element_count(), 6);
  for (Eigen::Index e = 0; e < q.rows(); ++e) q.row(e) = row(foam);
  const auto law = std::make_shared<OgdenLaw>(q);
  for (const MaterialTest& t : all_modes()) {
    const std::size_t i = 3;  // the greatest strain that the modes share
    const TestPoint point = solve_test(*law, 0, t, i);
    ASSERT_TRUE(point.found);
    // Faces that lead are held where they go; the others are free, but all are held where shear acts on them.
    const bool all = t.mode == TestMode::SimpleShear || t.mode == TestMode::ConfinedUniaxial;
    const bool along_y = t.mode != TestMode::Uniaxial;
    std::vector<int> held;
    for (int n = 0; n < body->node_count(); ++n) {
      const Vector3 at = body->nodes.row(n).cwiseAbs();
      if (at.x() > 0.0499 || (along_y && at.y() > 0.0499) || (all && at.z() > 0.0499)) held.push_back(n);
    }
    Equilibrium equilibrium(body, law, held, {});
    Placement placement = equilibrium.rest();
    for (const int n : held) placement.nodes.row(n) = body->nodes.row(n) * point.F.transpose();
    ASSERT_TRUE(equilibrium.solve(placement).converged) << t.name << equilibrium.failure();
    const Matrix3 P = mean_stress(equilibrium, placement);
    EXPECT_LT((P - point.P).norm(), tolerance(1e-7) * point.P.norm()) << t.name;
  }
}

TEST(MaterialTests, RefuseWhatIsNoCurve) {
  MaterialTest t = all_modes()[0];
  EXPECT_NO_THROW(check_test(t));
  t.stress.pop_back();
  EXPECT_THROW(check_test(t), std::invalid_argument);
  t = all_modes()[0], t.stretch[0] = -1.0;
  EXPECT_THROW(check_test(t), std::invalid_argument);
  t = all_modes()[4], t.second.clear();
  EXPECT_THROW(check_test(t), std::invalid_argument);
  const LawLayout layout({1, 1});
  EXPECT_THROW(CurveTrial(all_modes()[0], 0, layout, 0.0, law_parameters(layout, 1.0)), std::invalid_argument);
}

}  // namespace
}  // namespace pliant::material_tests_test
