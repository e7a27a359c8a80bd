#include "estimation/press_fit.hpp"

#include "base/error.hpp"
#include "estimation/alternative.hpp"
#include "input_errors.hpp"
#include "support/interruption.hpp"
#include "support/press_capture.hpp"
#include "temporary_folder.hpp"

namespace pliant::press_fit_test {
namespace {

using test::complaint_of;
using test::PressedBlock;
using test::TemporaryFolder;
using test::write_press_capture;
using testing::HasSubstr;

/// A soft layer that stiffens under pressure on a stiff one; markers err by 0.1 mm. Mesh and family of laws are those
/// of the fit: what is asked here is whether it finds its way.
struct PressedLayers : ::testing::Test {
  PressedLayers() {
    std::vector<std::pair<Vector3, Vector3>> presses = PressedBlock::presses();
    for (const auto& more : std::vector<std::pair<Vector3, Vector3>>{{{0.05, 0.05, 0.05}, {0.0, -20.0, 0.0}},
                                                                     {{-0.04, 0.05, -0.05}, {2.0, -8.0, 1.0}},
                                                                     {{0.1, -0.02, 0.04}, {-15.0, 0.0, 0.0}},
                                                                     {{0.0, 0.05, 0.02}, {0.0, -18.0, 2.0}}})
      presses.push_back(more);
    auto layered = std::make_shared<Body>(*block.body);
    layered->modulus = zone_field(block.body->modulus, zones_after(zone_coordinates(*block.body), {border}), 2);
    const LawLayout one({1, 1}), two({2, 1, 2});
    VectorX truth = with_zone(one, law_parameters(one, 12000.0).reference(), two, 0);
    truth[two.modulus(1)] = 5000.0;
    truth[two.exponent(0, 1)] = -6.0;
    law = press_law(*layered, two, truth);
    capture = read_capture(write_press_capture(folder.path(), block.scene(presses, law, 1e-4), 1));
  }

  static FitOptions of_two_zones() {
    FitOptions options;
    options.law_zones = 2;
    options.law_terms = 1;
    return options;
  }
  FitOutcome fitted(const FitOptions& options = {}, const FitMonitor& monitor = {}, FitState resume = {}) const {
    return fit({{capture, {}}}, options, monitor, std::move(resume));
  }
  static void expect_same(const FitOutcome& resumed, const FitOutcome& whole) {
    ASSERT_TRUE(resumed.evaluation.succeeded) << resumed.reason;
    EXPECT_EQ(resumed.law->cuts, whole.law->cuts);
    EXPECT_NEAR(resumed.evaluation.cost, whole.evaluation.cost, 1e-3 * whole.evaluation.cost);
  }

  const FitOptions two_zones = of_two_zones();
  TemporaryFolder folder;
  PressedBlock block{{5, 4, 5}};
  ZoneCut border{0, ZoneCut::By::Y, 1e-3};  // cells are 25 mm high
  std::shared_ptr<const MaterialLaw> law;
  Capture capture;
};

TEST_F(PressedLayers, AreFoundWithTheirLawsAndPredictAnotherPress) {
  const FitOutcome outcome = fitted();
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  ASSERT_TRUE(outcome.law);
  const LawOutcome& fit = *outcome.law;
  EXPECT_GE(fit.cuts.size(), 1u);
  ASSERT_EQ(fit.predictions.size(), 8u);
  for (const PressPrediction& p : fit.predictions) EXPECT_TRUE(p.succeeded) << p.failure;
  // The noise of a marker's place, 0.1 mm a coordinate, is 0.17 mm.
  EXPECT_NEAR(fit.predictions.back().marker_rms, 1.73e-4, 0.4e-4);
  EXPECT_NEAR(fit.noise.at_rest, 1e-4, 0.2e-4);
  int right = 0;  // the border may go by another row of elements' centres, or bend around the edges
  for (int e = 0; e < block.body->element_count(); ++e) {
    const double truth = law->small_strain(e).youngs_modulus;
    right += std::abs(fit.law->small_strain(e).youngs_modulus - truth) < 0.2 * truth;
  }
  EXPECT_GT(right, 0.85 * block.body->element_count());
}

TEST_F(PressedLayers, OfOneLawEachWhereTheCaptureNamesThem) {
  std::string text = read_file(capture.file);
  text += "[[region]]\nname = \"top\"\nbox = { min = [-1.0, 0.0, -1.0], max = [1.0, 1.0, 1.0] }\n";
  folder.write("capture.toml", text);
  capture = read_capture(capture.file);
  const FitOutcome fit = fitted();
  ASSERT_TRUE(fit.evaluation.succeeded) << fit.reason;
  EXPECT_EQ(fit.law->layout.form().laws, 2);
  const Parameter* exponent = fit.parameters.find("exponent_1@top");
  ASSERT_TRUE(exponent);
  EXPECT_NEAR(fit.theta[exponent->at], -6.0, 1.5);
  EXPECT_NEAR(fit.theta[fit.parameters.find("youngs_modulus@top")->at], 5000.0, 300.0);
}

TEST_F(PressedLayers, CountTheirMassAsWellAsItIsStated) {
  capture.scene.object.density = 3000.0;  // so that weight acts
  const auto share_of_mass = [&](std::optional<double> std) {
    capture.scene.object.density_std = std;
    const std::vector<UncertaintyShare> budget = fitted(two_zones).uncertainty.budget;
    const auto share = std::ranges::find(budget, cause_mass, &UncertaintyShare::cause);
    return share == budget.end() ? 0.0 : share->std[0];
  };
  const double usual = share_of_mass({});
  EXPECT_GT(usual, 0.0);
  EXPECT_NEAR(share_of_mass(90.0), 3.0 * usual, 0.3 * usual) << "3 % in the place of 1";
  EXPECT_EQ(share_of_mass(0.0), 0.0);
}

TEST_F(PressedLayers, AFitIsResumedWhereItWasInterrupted) {
  const FitOutcome whole = fitted(two_zones);
  ASSERT_TRUE(whole.evaluation.succeeded) << whole.reason;
  for (const char* stage : {"1 term", "2 zones"}) {
    test::Interruption interruption(stage);
    const FitOutcome part = fitted(two_zones, interruption.monitor());
    EXPECT_TRUE(part.interrupted);
    ASSERT_TRUE(part.law);
    EXPECT_TRUE(part.law->predictions.empty());
    int events = 0;
    FitMonitor monitor;
    monitor.on_event = [&](const FitEvent& event) { events += event.stage == "1 term"; };
    const FitOutcome resumed = fitted(two_zones, monitor, interruption.left());
    EXPECT_EQ(events > 0, std::string(stage) == "1 term") << "what is done is not done again";
    expect_same(resumed, whole);
    EXPECT_LT((resumed.theta.array() / whole.theta.array() - 1.0).abs().maxCoeff(), 0.02);
  }
}

TEST_F(PressedLayers, AnInterruptionWhileCutsMoveKeepsTheEstimate) {
  const FitOutcome whole = fitted(two_zones);
  ASSERT_TRUE(whole.evaluation.succeeded) << whole.reason;
  // The stage's iterations begin again for the second round, and then for the first cut that is tried elsewhere.
  int begun = 0;
  FitState left;
  FitMonitor monitor;
  monitor.on_event = [&](const FitEvent& e) { begun += e.stage == "2 zones" && e.iteration == 1; };
  monitor.on_state = [&](const FitState& state) { left = state; };
  monitor.interrupted = [&] { return begun == 3; };
  const FitOutcome part = fitted(two_zones, monitor);
  ASSERT_TRUE(part.interrupted) << "no cut was tried elsewhere: the test would prove nothing";
  ASSERT_FALSE(left.pass.done.empty());
  EXPECT_EQ(left.pass.done.back().id.kind, StageKind::Move);
  const FitOutcome resumed = fitted(two_zones, {}, left);
  expect_same(resumed, whole);
}

TEST_F(PressedLayers, AreSampledPressByPress) {
  FitOptions options;
  options.material = MaterialKind::Sampled;
  const FitOutcome outcome = fitted(options);
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  ASSERT_TRUE(outcome.law && outcome.law->sampled);
  const LawOutcome& fit = *outcome.law;
  EXPECT_EQ(fit.samples.size(), 7u);
  EXPECT_EQ(fit.law->name(), "sampled");
  const ObservedPress& unseen = fit.scene->presses.back();
  EXPECT_LT(fit.predictions.back().marker_rms, 0.1 * unseen.greatest_displacement);
}

TEST(PressFit, RefusesACaptureWithoutPressesToFit) {
  const TemporaryFolder folder;
  const PressedBlock block;
  const LawLayout layout({1, 1});
  const auto law = press_law(*block.body, layout, law_parameters(layout, 9000.0).reference());
  const Capture capture =
      read_capture(write_press_capture(folder.path(), block.scene({PressedBlock::presses()[0]}, law), 1));
  EXPECT_THAT(complaint_of([&] { (void)fit({{capture, {}}}, {}); }), HasSubstr("no static test is to be fitted"));
  FitOptions options;
  options.law_zones = 3, options.control_points = 4;
  EXPECT_THAT(options.validate(), HasSubstr("cannot both"));
}

/// Blocks of one material, each in a capture of its own; mesh and law are those of the fit.
struct PressedBlocks : ::testing::Test {
  Capture pressed(const char* name, const Eigen::Vector3i& cells, std::pair<int, int> presses, unsigned seed) const {
    const PressedBlock block(cells);
    const LawLayout layout({1, 1});
    const auto law = press_law(*block.body, layout, law_parameters(layout, modulus).reference());
    std::filesystem::create_directories(folder / name);
    const auto all = PressedBlock::presses();
    return read_capture(write_press_capture(
        folder / name, block.scene({all.begin() + presses.first, all.begin() + presses.second}, law, noise, seed), 0));
  }

  static constexpr double modulus = 9000.0, noise = 2e-4;
  TemporaryFolder folder;
  const RecordedCapture first{pressed("first", {5, 3, 5}, {0, 2}, 1), {}},
      second{pressed("second", {4, 3, 4}, {1, 3}, 2), {}}, third{pressed("third", {5, 4, 4}, {2, 4}, 3), {}};
};

TEST_F(PressedBlocks, OfOneMaterialAreFittedTogetherAndPredictOneThatIsHeldOut) {
  FitOptions options;
  options.law_terms = 1;
  const FitOutcome alone = fit({first}, options), both = fit({first, second}, options, {}, {}, third);
  ASSERT_TRUE(both.evaluation.succeeded) << both.reason;
  EXPECT_EQ(both.verdict.kind, Verdict::Kind::Explained);
  const auto at = [](const FitOutcome& o) { return o.theta[o.parameters.find("youngs_modulus")->at]; };
  EXPECT_NEAR(at(both) / modulus, 1.0, 0.02);
  EXPECT_LT(both.uncertainty.std_noise[0], 0.9 * alone.uncertainty.std_noise[0]) << "twice as many presses";
  ASSERT_EQ(both.recordings.size(), 2u);
  for (const RecordingOutcome& r : both.recordings) EXPECT_EQ(r.evaluation.frames.size(), 2u);
  EXPECT_NE(both.recordings[0].rest_body, both.recordings[1].rest_body);
  ASSERT_EQ(both.law->others.size(), 2u);
  EXPECT_EQ(both.law->scene->presses.front().name, "first: press 1");
  EXPECT_EQ(both.law->others.front().scene->presses.back().name, "second: press 2");
  const TestedObject& unseen = both.law->others.back();
  EXPECT_EQ(unseen.scene->presses.front().role, "test");
  ASSERT_EQ(unseen.predictions.size(), 2u);
  for (const PressPrediction& p : unseen.predictions) EXPECT_LT(p.marker_rms, 1.2 * std::sqrt(3.0) * noise);
  ASSERT_TRUE(both.held_out && both.held_out->evaluation.succeeded);
  EXPECT_EQ(both.held_out->evaluation.frames.size(), 2u);
  EXPECT_LT(both.held_out->evaluation.track_rms(), 1.2 * std::sqrt(3.0) * noise);
}

TEST_F(PressedBlocks, OfTwoMaterialsAreNotExplainedByOne) {
  RecordedCapture heavy = second;
  for (Press& press : heavy.capture.presses) press.force *= 2.0;  // as if twice as stiff
  FitOptions options;
  options.law_terms = 1;
  EXPECT_EQ(fit({first, heavy}, options).verdict.kind, Verdict::Kind::Unexplained);
}

TEST_F(PressedLayers, AreRefusedBesideWhatTheyCannotBeFittedWith) {
  const auto refusal = [&](const FitOptions& options, int captures = 1) {
    const std::vector<RecordedCapture> all(std::size_t(captures), RecordedCapture{capture, {}});
    return complaint_of([&] { (void)fit(all, options); });
  };
  const auto holding_out = [&](const Capture& held_out, const FitOptions& options) {
    return complaint_of([&] { (void)fit({{capture, {}}}, options, {}, {}, RecordedCapture{held_out, {}}); });
  };
  FitOptions sampled;
  sampled.material = MaterialKind::Sampled;
  EXPECT_THAT(refusal(sampled, 2), HasSubstr("several captures"));
  Capture moving = capture;
  moving.presses.clear();
  moving.scene.timing.times = {0.0, 0.1, 0.2};
  EXPECT_THAT(holding_out(moving, {}), HasSubstr("a motion, held out"));
  EXPECT_THAT(holding_out(capture, two_zones), HasSubstr("differs over the fitted object"));
  FitOptions hexahedra, refined, given;
  hexahedra.element = ElementKind::Hexahedron;
  EXPECT_THAT(refusal(hexahedra), HasSubstr("element=hexahedra"));
  refined.refine = 2;
  EXPECT_THAT(refusal(refined), HasSubstr("--refine"));
  given.parameters["youngs_modulus"].start = VectorX::Constant(1, 1e4);
  EXPECT_THAT(refusal(given), HasSubstr("single parameters"));
}

}  // namespace
}  // namespace pliant::press_fit_test
