#include "estimation/static_tests.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "estimation/gradient_check.hpp"
#include "estimation/judgement.hpp"
#include "estimation/press_fit.hpp"
#include "estimation/start_objective.hpp"
#include "input_errors.hpp"
#include "support/curve_capture.hpp"
#include "support/thread_ranks.hpp"
#include "support/tolerance.hpp"
#include "temporary_folder.hpp"

namespace pliant::static_tests_test {
namespace {

using test::CurveCapture;
using test::CurveKinds;
using test::tolerance;

constexpr double modulus = 8000.0, exponent = -5.0, ratio = 0.25;

/// Ogden's law of one term, everywhere.
struct Truth {
  Truth() {
    theta = law_parameters(layout, modulus).reference();
    theta[layout.exponent(0)] = exponent;
    theta[layout.poissons_ratio()] = ratio;
  }
  std::shared_ptr<const MaterialLaw> law() const { return press_law(*block.body, layout, theta); }
  std::shared_ptr<const MaterialLaw> element_law() const { return press_law(*unit_element(), layout, theta); }
  test::PressedBlock block;
  LawLayout layout{{1, 1}};
  VectorX theta;
};

Capture written(const test::TemporaryFolder& folder, double noise, const CurveKinds& kinds) {
  const Truth truth;
  const CurveCapture made(folder.path(), truth.law(), truth.element_law(), noise, kinds);
  return read_capture(folder.path());
}

class OfEachKind : public ::testing::TestWithParam<CurveKinds> {};

TEST_P(OfEachKind, DerivativesAgreeWithDifferences) {
  const test::TemporaryFolder folder;
  std::vector<RecordedCapture> recordings;
  recordings.push_back({written(folder, 0.02, GetParam()), {}});
  FitOptions options;
  const StartObjective start = start_objective(std::move(recordings), options);
  ASSERT_EQ(start.p.size(), 3);
  const GradientCheck check = check_gradient(*start.cost, start.p);
  ASSERT_TRUE(check.succeeded) << check.failure;
  EXPECT_TRUE(check.agrees()) << describe(check);
  for (const CheckedDerivative& d : check.derivatives) {
    EXPECT_EQ(d.verdict, CheckedDerivative::Verdict::Agree) << describe(check);
    EXPECT_GT(std::abs(d.by_tangents), 1e-3 * d.scale) << d.name;
    EXPECT_GT(d.scale, 0.0) << d.name;
  }
}

TEST_P(OfEachKind, KnownTruthIsFoundWithinWhatIsStated) {
  const test::TemporaryFolder folder;
  const Capture capture = written(folder, 0.01, GetParam());
  FitOptions options;
  options.law_terms = 1, options.law_zones = 1, options.control_points = 1;
  const FitOutcome found = fit_presses({&capture}, options);
  ASSERT_TRUE(found.law) << found.reason;
  ASSERT_TRUE(found.evaluation.succeeded) << found.reason;
  EXPECT_TRUE(found.converged) << found.reason;
  const LawLayout& layout = found.law->layout;
  EXPECT_EQ(layout.form().terms, 1);
  const double std = found.std[found.parameters.coordinate(layout.modulus(0))];
  EXPECT_GT(std, 1e-4);
  EXPECT_LT(std, 0.3);
  EXPECT_NEAR(std::log(found.theta[layout.modulus(0)] / modulus), 0.0, tolerance(3.0) * std);
  const double exponent_std = 4.0 * found.std[found.parameters.coordinate(layout.exponent(0))];
  EXPECT_NEAR(found.theta[layout.exponent(0)], exponent, tolerance(3.0) * exponent_std);
  for (const CurvePrediction& curve : predict_curves(*found.law->scene, found.law->law)) {
    EXPECT_EQ(curve.failure, "") << curve.name;
    EXPECT_LT(curve.relative_rms(), tolerance(0.05)) << curve_sentence(curve);
    EXPECT_EQ(curve.depth_offset.has_value(), GetParam().contact_error > 0.0) << curve_sentence(curve);
    EXPECT_NEAR(curve.depth_offset.value_or(0.0), GetParam().contact_error, tolerance(5e-4)) << curve_sentence(curve);
    ASSERT_TRUE(curve.strained) << curve.name;
    EXPECT_GT(curve.strained->greatest_strain, 1e-3) << curve.name;
    if (curve.kind != "material curve") continue;
    const double rest = curve.abscissa == "shear" ? 0.0 : 1.0;
    double greatest = 0.0;
    for (const double at : curve.at) greatest = std::max(greatest, std::abs(at - rest));
    EXPECT_EQ(curve.strained->greatest_strain, greatest) << curve.name;
    EXPECT_EQ(curve.strained->median_strain, greatest) << "a specimen is strained alike";
  }
}

std::string name_of(const ::testing::TestParamInfo<CurveKinds>& kinds) {
  return kinds.param.contact_error > 0.0 ? "Contacts"
         : !kinds.param.grips            ? "Indentations"
         : !kinds.param.curves           ? "Grips"
                                         : "All";
}

INSTANTIATE_TEST_SUITE_P(Tests, OfEachKind,
                         ::testing::Values(CurveKinds{.grips = false, .curves = false},
                                           CurveKinds{.grips = false, .curves = false, .contact_error = 1e-3},
                                           CurveKinds{.indentations = false, .curves = false}, CurveKinds{}),
                         name_of);

TEST(StaticTests, CurvesAloneNeedNoShape) {
  const test::TemporaryFolder folder;
  const Capture capture = written(folder, 0.005, {.indentations = false, .grips = false, .has_shape = false});
  EXPECT_TRUE(is_of_material_curves(capture));
  const FitOutcome found = fit_presses({&capture}, {});
  ASSERT_TRUE(found.law) << found.reason;
  ASSERT_TRUE(found.evaluation.succeeded) << found.reason;
  EXPECT_NEAR(found.law->law->small_strain(0).youngs_modulus / modulus, 1.0, tolerance(0.03));
  EXPECT_NEAR(found.law->law->small_strain(0).poissons_ratio, ratio, tolerance(0.03));
  const auto predicted = predict_curves(*found.law->scene, found.law->law);
  ASSERT_EQ(predicted.size(), 3u);
  EXPECT_EQ(predicted[2].role, "test");
  EXPECT_EQ(predicted[2].abscissa, "shear");
  EXPECT_LT(predicted[2].relative_rms(), tolerance(0.05));
  EXPECT_EQ(found.used.material, MaterialKind::Ogden);
  EXPECT_EQ(found.used.law_terms, found.law->layout.form().terms);
}

/// As those of presses do: the same law is wrong by as much, however it is loaded.
TEST(StaticTests, IntervalsOfCurvesCountTheFormOfTheLaw) {
  const test::TemporaryFolder folder;
  const Capture capture = written(folder, 0.005, {.indentations = false, .grips = false, .has_shape = false});
  FitOptions options;
  const FitOutcome with = fit_presses({&capture}, options);
  options.alternatives = false;
  const FitOutcome without = fit_presses({&capture}, options);
  ASSERT_TRUE(with.law && without.law);
  EXPECT_EQ(with.theta, without.theta);
  const int at = with.parameters.coordinate(with.law->layout.modulus(0));
  EXPECT_GE(with.std[at], judgement.test_floor_youngs_modulus);
  EXPECT_LT(without.std[at], judgement.test_floor_youngs_modulus);
}

TEST(StaticTests, AGivenPoissonsRatioStays) {
  const test::TemporaryFolder folder;
  const Capture capture = written(folder, 0.01, {.grips = false, .curves = false});
  FitOptions options;
  options.law_terms = 1, options.law_zones = 1, options.control_points = 1;
  options.parameters["poissons_ratio"] = {VectorX::Constant(1, ratio), false, {}};
  const FitOutcome found = fit_presses({&capture}, options);
  ASSERT_TRUE(found.law) << found.reason;
  ASSERT_TRUE(found.evaluation.succeeded) << found.reason;
  EXPECT_EQ(found.theta[found.law->layout.poissons_ratio()], ratio);
  EXPECT_EQ(found.parameters.dimension(), 2);
}

TEST(StaticTests, ALawThatMissesForcesLeavesThemUnexplained) {
  const test::TemporaryFolder folder;
  const Capture capture = written(folder, 0.002, CurveKinds{});
  FitOptions options;
  options.law_zones = 1, options.control_points = 1, options.alternatives = false;
  options.law_terms = 1;
  EXPECT_EQ(fit_presses({&capture}, options).verdict.kind, Verdict::Kind::Explained);
  options.material = MaterialKind::Linear, options.law_terms = 0;
  const FitOutcome linear = fit_presses({&capture}, options);
  EXPECT_EQ(linear.verdict.kind, Verdict::Kind::Unexplained);
  EXPECT_THAT(linear.verdict.reasons, ::testing::Contains(::testing::HasSubstr("The model misses")));
}

TEST(StaticTests, ForcesOfGripsCountForTheChoiceOfALaw) {
  const test::TemporaryFolder folder;
  const Capture capture = written(folder, 0.01, {.indentations = false, .curves = false});
  FitOptions options;
  options.law_zones = 1, options.control_points = 1, options.alternatives = false;
  const FitOutcome found = fit_presses({&capture}, options);
  ASSERT_TRUE(found.law) << found.reason;
  ASSERT_EQ(found.law->tried.size(), 2U);
  const TriedLaw& two_terms = found.law->tried.back();
  EXPECT_EQ(two_terms.form.terms, 2);
  EXPECT_TRUE(std::isfinite(two_terms.evidence)) << two_terms.evidence;
  EXPECT_FALSE(two_terms.kept) << "one term made them";
}

TEST(StaticTests, GuessesComeNearWhereTheFormulaHolds) {
  const test::TemporaryFolder folder;
  const Capture capture = written(folder, 0.0, {});
  const Truth truth;
  const StaticTests tests = observe_static_tests(capture, *truth.block.body);
  EXPECT_TRUE(tests.any_to_fit());
  const std::vector<double> moduli = guessed_moduli(tests, *truth.block.body, ratio);
  // The first two of five depths of each of two indentations, one grip, ten stretches; those of tests are not asked.
  EXPECT_EQ(moduli.size(), 2u * 2u + 1u + 10u);
  for (const double guess : moduli) {
    EXPECT_GT(guess, 0.1 * modulus);
    EXPECT_LT(guess, 10.0 * modulus);
  }
}

TEST(StaticTests, FormsOfALawThatCurvesCannotHaveAreRefused) {
  const test::TemporaryFolder folder;
  const Capture capture = written(folder, 0.01, {.indentations = false, .grips = false, .has_shape = false});
  const auto complaint = [&](const std::function<void(FitOptions&)>& choose) {
    FitOptions options;
    choose(options);
    return test::complaint_of([&] { (void)fit_presses({&capture}, options); });
  };
  using ::testing::HasSubstr;
  EXPECT_THAT(complaint([](FitOptions& o) { o.material = MaterialKind::Sampled; }), HasSubstr("no press"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.material = MaterialKind::NeoHookean, o.law_terms = 2; }),
              HasSubstr("law_terms"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.law_zones = 2; }), HasSubstr("one material"));
  EXPECT_THAT(complaint([](FitOptions& o) { o.control_points = 3; }), HasSubstr("one material"));
}

TEST(StaticTests, ACaptureWithNothingToFitIsRefused) {
  const test::TemporaryFolder folder;
  Capture capture = written(folder, 0.01, {.grips = false, .curves = false});
  for (Indentation& test : capture.indentations) test.role = "test";
  EXPECT_THROW((void)fit_presses({&capture}, {}), InputError);
}

TEST(StaticTests, SeveralProcessesAreRefused) {
  const test::TemporaryFolder folder;
  RecordedCapture recording;
  recording.capture = written(folder, 0.01, {.indentations = false, .grips = false, .has_shape = false});
  FitMonitor monitor;
  monitor.processes = std::make_shared<ProcessGroup>(test::ThreadRank::make(2).front());
  EXPECT_THROW((void)fit({recording, recording}, {}, monitor, {}, {}), InputError);
}

}  // namespace
}  // namespace pliant::static_tests_test
