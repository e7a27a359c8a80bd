#include "estimation/press_fit.hpp"

#include "base/error.hpp"
#include "estimation/fit_state.hpp"
#include "support/press_capture.hpp"
#include "temporary_folder.hpp"

namespace pliant {
namespace {

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

  static PressFitOptions of_two_zones() {
    PressFitOptions options;
    options.zones = 2;
    options.terms = 1;
    return options;
  }
  static void expect_same(const PressFitOutcome& resumed, const PressFitOutcome& whole) {
    ASSERT_TRUE(resumed.succeeded) << resumed.reason;
    EXPECT_EQ(resumed.cuts, whole.cuts);
    EXPECT_NEAR(resumed.evaluation.cost, whole.evaluation.cost, 1e-3 * whole.evaluation.cost);
  }

  const PressFitOptions two_zones = of_two_zones();
  TemporaryFolder folder;
  PressedBlock block{{5, 4, 5}};
  ZoneCut border{0, ZoneCut::By::Y, 1e-3};  // cells are 25 mm high
  std::shared_ptr<const MaterialLaw> law;
  Capture capture;
};

TEST_F(PressedLayers, AreFoundWithTheirLawsAndPredictAnotherPress) {
  const PressFitOutcome fit = fit_presses(capture, {});
  ASSERT_TRUE(fit.succeeded) << fit.reason;
  EXPECT_GE(fit.cuts.size(), 1u);
  ASSERT_EQ(fit.predictions.size(), 8u);
  for (const PressPrediction& p : fit.predictions) EXPECT_TRUE(p.succeeded) << p.failure;
  // The noise of a marker's place, 0.1 mm a coordinate, is 0.17 mm.
  EXPECT_NEAR(fit.predictions.back().marker_rms, 1.73e-4, 0.4e-4);
  EXPECT_NEAR(fit.noise, 1e-4, 0.2e-4);
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
  const PressFitOutcome fit = fit_presses(read_capture(capture.file), {});
  ASSERT_TRUE(fit.succeeded) << fit.reason;
  EXPECT_EQ(fit.layout.form().laws, 2);
  const Parameter* exponent = fit.parameters.find("exponent_1@top");
  ASSERT_TRUE(exponent);
  EXPECT_NEAR(fit.theta[exponent->at], -6.0, 1.5);
  EXPECT_NEAR(fit.theta[fit.parameters.find("youngs_modulus@top")->at], 5000.0, 300.0);
}

TEST_F(PressedLayers, AFitIsResumedWhereItWasInterrupted) {
  const PressFitOutcome whole = fit_presses(capture, two_zones);
  ASSERT_TRUE(whole.succeeded) << whole.reason;
  for (const char* stage : {"1 term", "2 zones"}) {
    PressFitState left;
    bool came = false;
    PressFitMonitor monitor;
    monitor.on_event = [&](const PressFitEvent& event) { came = came || event.stage == stage; };
    monitor.on_state = [&](const PressFitState& state) { left = state; };
    monitor.interrupted = [&] { return came; };
    const PressFitOutcome part = fit_presses(capture, two_zones, monitor);
    EXPECT_TRUE(part.interrupted);
    EXPECT_TRUE(part.predictions.empty());
    write_press_state(folder / "state.json", left, "key");
    int events = 0;
    monitor = {};
    monitor.on_event = [&](const PressFitEvent& event) { events += event.stage == "1 term"; };
    const PressFitOutcome resumed =
        fit_presses(capture, two_zones, monitor, read_press_state(folder / "state.json", "key"));
    EXPECT_EQ(events > 0, std::string(stage) == "1 term") << "what is done is not done again";
    expect_same(resumed, whole);
    EXPECT_LT((resumed.theta.array() / whole.theta.array() - 1.0).abs().maxCoeff(), 0.02);
  }
  EXPECT_THROW(read_press_state(folder / "state.json", "another key"), InputError);
}

TEST_F(PressedLayers, AnInterruptionWhileCutsMoveKeepsTheEstimate) {
  const PressFitOutcome whole = fit_presses(capture, two_zones);
  ASSERT_TRUE(whole.succeeded) << whole.reason;
  // The stage's iterations begin again for the second round, and then for the first cut that is tried elsewhere.
  int begun = 0;
  PressFitState left;
  PressFitMonitor monitor;
  monitor.on_event = [&](const PressFitEvent& e) { begun += e.stage == "2 zones" && e.iteration == 1; };
  monitor.on_state = [&](const PressFitState& state) { left = state; };
  monitor.interrupted = [&] { return begun == 3; };
  const PressFitOutcome part = fit_presses(capture, two_zones, monitor);
  ASSERT_TRUE(part.interrupted) << "no cut was tried elsewhere: the test would prove nothing";
  EXPECT_EQ(left.cuts.size(), 1u);
  EXPECT_GT(left.under_way.p.size(), 0);
  const PressFitOutcome resumed = fit_presses(capture, two_zones, {}, left);
  expect_same(resumed, whole);
}

TEST_F(PressedLayers, AreSampledPressByPress) {
  PressFitOptions options;
  options.material = MaterialKind::Sampled;
  const PressFitOutcome fit = fit_presses(capture, options);
  ASSERT_TRUE(fit.succeeded) << fit.reason;
  ASSERT_TRUE(fit.sampled);
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
  EXPECT_THROW(fit_presses(capture, {}), InputError);
  PressFitOptions options;
  options.zones = 3, options.control_points = 4;
  EXPECT_THAT(options.validate(), HasSubstr("cannot both"));
}

}  // namespace
}  // namespace pliant
