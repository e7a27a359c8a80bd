// Models beside the estimate: what they add to its uncertainty, and that they are resumed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "estimation/alternative.hpp"
#include "estimation/fit.hpp"
#include "estimation/judgement.hpp"
#include "support/dropped.hpp"
#include "support/interruption.hpp"
#include "support/sagging_bar.hpp"

namespace pliant::alternatives_test {
namespace {

const UncertaintyShare* share(const FitOutcome& outcome, const std::string& cause) {
  const auto it = std::ranges::find(outcome.uncertainty.budget, cause, &UncertaintyShare::cause);
  return it == outcome.uncertainty.budget.end() ? nullptr : &*it;
}

TEST(Alternatives, WidenWhatTheNoiseLeavesOpen) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  FitOptions options = test::quick_fit_of_bar();
  const FitOutcome with = fit({bar}, options);
  options.alternatives = false;
  const FitOutcome without = fit({bar}, options);
  EXPECT_EQ(with.theta, without.theta) << "they leave the estimate alone";
  ASSERT_EQ(without.uncertainty.budget.size(), 1u) << "noise";
  EXPECT_EQ(without.uncertainty.std, without.uncertainty.std_noise);
  EXPECT_EQ(with.uncertainty.std_noise, without.uncertainty.std_noise);
  double squares = 0.0;
  for (const UncertaintyShare& s : with.uncertainty.budget) squares += s.std[0] * s.std[0];
  EXPECT_NEAR(squares, with.uncertainty.std[0] * with.uncertainty.std[0], 1e-9 * squares);
  for (const char* cause : {"mesh", "mass"}) {
    ASSERT_NE(share(with, cause), nullptr) << cause;
    EXPECT_GT(share(with, cause)->std[0], 0.0) << cause;
  }
  // A bar sags by its weight over its modulus: a hundredth of the mass is a hundredth of the modulus.
  EXPECT_NEAR(share(with, "mass")->std[0], 0.01, 0.002);
}

TEST(Alternatives, CountWhatIsGivenAsWellAsTheCaptureStatesIt) {
  RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  const FitOptions options = test::quick_fit_of_bar();
  const FitOutcome unsaid = fit({bar}, options);
  bar.capture.scene.object.density_std = 0.03 * *bar.capture.scene.object.density;
  bar.capture.scene.world.gravity_std = 2.0 * judgement.given_gravity;
  const FitOutcome stated = fit({bar}, options);
  EXPECT_EQ(stated.theta, unsaid.theta) << "they leave the estimate alone";
  EXPECT_NEAR(share(stated, "mass")->std[0], 3.0 * share(unsaid, "mass")->std[0], 1e-4);
  const std::string gravity = "direction of gravity";
  EXPECT_NEAR(share(stated, gravity)->std[0], 2.0 * share(unsaid, gravity)->std[0],
              0.2 * share(stated, gravity)->std[0])
      << "as far as the sag itself does not tell it";
  EXPECT_EQ(share(unsaid, cause_scale), nullptr);
  bar.capture.scene.object.density_std = bar.capture.scene.world.gravity_std = 0.0;
  const FitOutcome exact = fit({bar}, options);
  EXPECT_EQ(share(exact, "mass"), nullptr);
  EXPECT_EQ(share(exact, gravity), nullptr);
}

/// The same recording in lengths that are a share longer than they were.
RecordedCapture stretched(RecordedCapture recorded, double factor) {
  Capture& capture = recorded.capture;
  for (Vector3& v : capture.scene.object.surface->vertices) v *= factor;
  for (FixedRegion& fixed : capture.scene.fixed) {
    auto& box = std::get<RegionBox>(fixed.region);
    box.min *= factor, box.max *= factor;
  }
  for (Plane& plane : capture.scene.planes) plane.point *= factor;
  *capture.clouds.front().noise *= factor;
  for (ObservedFrame& frame : recorded.observed) {
    for (Vector3& p : frame.points) p *= factor;
    for (float& noise : frame.noise) noise *= float(factor);
  }
  return recorded;
}

/// By what power of the lengths' scale Young's modulus changes between fits of both, and what the share says of it.
void expect_power_of_scale(RecordedCapture recorded, const FitOptions& options, double factor,
                           std::optional<double> expected = {}) {
  constexpr double little = 1e-5;  // of which no recording tells anything
  recorded.capture.scene.object.scale_std = little;
  const FitOutcome right = fit({recorded}, options), longer = fit({stretched(recorded, factor)}, options);
  ASSERT_NE(share(right, cause_scale), nullptr) << ::testing::PrintToString(right.notes);
  const double power = share(right, cause_scale)->std[0] / little;
  const double found =
      std::log(test::value(longer, "youngs_modulus") / test::value(right, "youngs_modulus")) / std::log(factor);
  EXPECT_NEAR(std::abs(found), power, 0.2 * power);
  EXPECT_NEAR(found, expected.value_or(found), 0.1);
}

TEST(ScaleOfLengths, OfWhatSagsHasThePowersOfItsDimensions) {
  RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  FitOptions options = test::quick_fit_of_bar();
  options.element = ElementKind::Hexahedron;  // tetrahedra of a longer object may be others
  expect_power_of_scale(bar, options, 1.03, 1.0);
  Object& object = bar.capture.scene.object;
  object.mass = *object.density * enclosed_volume(*object.surface);
  object.density.reset();
  expect_power_of_scale(bar, options, 1.03, -2.0);
}

/// Beyond its dimensions a swing that is seen too wide asks for another modulus.
TEST(ScaleOfLengths, OfWhatSwingsMovesTheEstimateAsTheShareSays) {
  test::Dropped held;
  held.change = [](Scene& scene) {
    scene.planes.clear();
    scene.fixed = {{RegionBox{Vector3(-1, -1, -1), Vector3(-0.04, 1, 1)}, {}}};
  };
  FitOptions options;
  options.span = 1.0, options.cells = options.coarse_cells = 6.0, options.control_points = 1, options.budget = 0.0;
  options.tracking = TrackingUse::Off, options.correct = false;
  for (const auto& [name, truth] :
       {std::pair("poissons_ratio", 0.3), {"mass_damping", 0.2}, {"stiffness_damping", 0.004}})
    options.parameters[name] = {VectorX::Constant(1, truth), false, {}};
  expect_power_of_scale(held.record(), options, 1.01);
}

TEST(Alternatives, CountWhatAScanMayErrBy) {
  RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  const FitOptions options = test::quick_fit_of_bar();
  const FitOutcome exact = fit({bar}, options);  // as the capture states
  EXPECT_EQ(share(exact, cause_scan), nullptr);
  EXPECT_EQ(exact.used.element, ElementKind::QuadraticTetrahedron);
  EXPECT_EQ(exact.used.control_points, 1);
  EXPECT_EQ(exact.used.material, MaterialKind::NeoHookean);
  EXPECT_EQ(exact.used.cells, exact.cells);
  EXPECT_EQ(exact.given.material, MaterialKind::Automatic);
  std::vector<double> std;
  for (const double noise : {0.0005, 0.001}) {
    bar.capture.scene.object.surface_noise = noise;
    const FitOutcome outcome = fit({bar}, options);
    EXPECT_EQ(outcome.theta, exact.theta) << "it leaves the estimate alone";
    ASSERT_NE(share(outcome, cause_scan), nullptr) << ::testing::PrintToString(outcome.notes);
    std.push_back(share(outcome, cause_scan)->std[0]);
    EXPECT_GT(outcome.uncertainty.std[0], exact.uncertainty.std[0]);
  }
  // Were all errors alike, a millimetre on either side of 50 would be 8 % of the modulus by the density and the sag,
  // q l^4 / (8 E I) with q of the thickness squared and I to the fourth power. Where it is held it is as it was
  // scanned, so over the first of eight elements, whose bending makes 41 % of the sag, half of that: 4.7 %. A common
  // error has half of the variance; smooth ones differ along the bar.
  EXPECT_GT(std[1], 0.9 * std::sqrt(0.5) * 0.047);
  EXPECT_LT(std[1], 0.08);
  EXPECT_NEAR(std[1], 2.0 * std[0], 0.2 * std[1]) << "to first order";
  EXPECT_LT(std[1], 8.0 * 0.001 / 0.05) << "both sides of 50 mm err, by the fourth power of the thickness at most";
  bar.capture.scene.object.surface_noise.reset();
  const FitOutcome unsaid = fit({bar}, options);
  ASSERT_NE(share(unsaid, cause_scan), nullptr);
  EXPECT_NEAR(share(unsaid, cause_scan)->std[0], std[1], 1e-5) << "0.25 % of 0.4 m are a millimetre";
}

TEST(Alternatives, CountHowUnevenAnObjectMayBe) {
  RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  const FitOptions options = test::quick_fit_of_bar();
  const FitOutcome even = fit({bar}, options);  // as the capture states
  EXPECT_EQ(share(even, cause_unevenness), nullptr);
  std::vector<double> std;
  for (const double varies : {0.05, 0.1}) {
    bar.capture.scene.object.stiffness_std = varies;
    const FitOutcome outcome = fit({bar}, options);
    EXPECT_EQ(outcome.theta, even.theta) << "it leaves the estimate alone";
    ASSERT_NE(share(outcome, cause_unevenness), nullptr) << ::testing::PrintToString(outcome.notes);
    std.push_back(share(outcome, cause_unevenness)->std[0]);
  }
  EXPECT_NEAR(std[1], 2.0 * std[0], 0.2 * std[1]) << "to first order";
  // How far the bar sags tells its stiffness near the clamp, by 4 (1 - x)^3 of what lies at the part x of its length:
  // of stiffness that is alike over a quarter of that, about two thirds of its deviation are left.
  EXPECT_GT(std[1], 0.3 * 0.1);
  EXPECT_LT(std[1], 1.2 * 0.1);
  bar.capture.scene.object.stiffness_std.reset();
  const FitOutcome unsaid = fit({bar}, options);
  ASSERT_NE(share(unsaid, cause_unevenness), nullptr);
  EXPECT_NEAR(share(unsaid, cause_unevenness)->std[0], judgement.unevenness / 0.1 * std[1], 0.1 * std[1]);
}

TEST(Alternatives, OfAMotionCountWhatAScanMayErrBy) {
  const std::string law = "law at large strain";
  RecordedCapture block = test::Dropped{}.record();
  for (ObservedFrame& frame : block.observed)  // beside which few steps come to their end
    for (float& noise : frame.noise) noise = 0.01F;
  FitOptions options;
  options.span = 1.0, options.cells = options.coarse_cells = 6.0, options.control_points = 1, options.budget = 0.0;
  options.tracking = TrackingUse::Off;
  for (const char* name : {"poissons_ratio", "mass_damping", "stiffness_damping", "contact_stiffness"})
    options.parameters[name].estimated = false;
  const FitOutcome exact = fit({block}, options);
  block.capture.scene.object.surface_noise = 0.004;
  const FitOutcome errs = fit({block}, options);
  ASSERT_NE(share(errs, cause_scan), nullptr) << ::testing::PrintToString(errs.notes);
  EXPECT_GT(share(errs, cause_scan)->std[0], 0.01);
  ASSERT_NE(share(exact, law), nullptr) << ::testing::PrintToString(exact.notes);
}

/// A hexahedron high: the bar is far too stiff for its mesh, and the noise is small beside that.
FitOptions one_hexahedron() {
  FitOptions options = test::quick_fit_of_bar();
  options.element = ElementKind::Hexahedron;
  return options;
}

TEST(Budget, IsSpentOnFinerMeshesWhereTheyMatter) {
  RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  for (float& noise : bar.observed.front().noise) noise = 0.01F;
  FitOptions options = one_hexahedron();
  const FitOutcome once = fit({bar}, options);
  ASSERT_NE(share(once, "mesh"), nullptr);
  ASSERT_GT(share(once, "mesh")->std[0], once.uncertainty.std_noise[0]);
  EXPECT_EQ(once.refinement.estimates.size(), 0u);
  options.budget = 10.0;
  const FitOutcome repeated = fit({bar}, options);
  ASSERT_GE(repeated.refinement.estimates.size(), 2u);
  EXPECT_DOUBLE_EQ(repeated.refinement.estimates[1].cells, 12.0);
  EXPECT_EQ(repeated.theta, repeated.refinement.estimates.back().theta);
  ASSERT_NE(share(repeated, "mesh"), nullptr);
  EXPECT_LT(share(repeated, "mesh")->std[0], 0.5 * repeated.uncertainty.std_noise[0]);
  EXPECT_LT(repeated.uncertainty.std[0], once.uncertainty.std[0]);
}

TEST(Budget, ThatIsTooSmallIsSaid) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  FitOptions options = one_hexahedron();
  options.budget = 1e-6;
  const FitOutcome outcome = fit({bar}, options);
  EXPECT_EQ(outcome.refinement.estimates.size(), 0u);
  EXPECT_THAT(outcome.notes, ::testing::Contains(::testing::HasSubstr("--budget")));
}

TEST(Budget, IsCountedNotTimed) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  FitOptions options = one_hexahedron();
  options.budget = 0.05;  // 3 s
  const FitOutcome quick = fit({bar}, options);
  FitMonitor slow;
  slow.on_event = [](const FitEvent&) { std::this_thread::sleep_for(std::chrono::milliseconds(200)); };
  const FitOutcome on_a_busy_machine = fit({bar}, options, slow);
  ASSERT_GE(quick.refinement.estimates.size(), 2u) << "there is room for a finer mesh";
  EXPECT_EQ(on_a_busy_machine.theta, quick.theta);
  EXPECT_EQ(on_a_busy_machine.refinement.estimates.size(), quick.refinement.estimates.size());
}

TEST(Budget, IsNotNeededWhereTheMeshHardlyMatters) {
  RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  for (float& noise : bar.observed.front().noise) noise = 0.05F;
  FitOptions options = one_hexahedron();
  options.budget = 10.0;
  const FitOutcome outcome = fit({bar}, options);
  EXPECT_EQ(outcome.refinement.estimates.size(), 0u);
  EXPECT_THAT(outcome.notes, ::testing::Not(::testing::Contains(::testing::HasSubstr("--budget"))));
}

TEST(Alternatives, GoOnAfterAnInterruption) {
  const RecordedCapture bar = test::sagging_bar(test::stiffness_of_bar);
  const FitOutcome undisturbed = fit({bar}, test::quick_fit_of_bar());
  const auto has_tried_one = [](const FitState& state) {
    return std::ranges::any_of(state.pass.done,
                               [](const StageRecord& r) { return r.id.kind == StageKind::Alternative; });
  };
  test::Interruption interruption(has_tried_one);
  const FitOutcome interrupted = fit({bar}, test::quick_fit_of_bar(), interruption.monitor());
  ASSERT_TRUE(interruption.came());
  EXPECT_TRUE(interrupted.interrupted);
  const FitOutcome resumed = fit({bar}, test::quick_fit_of_bar(), {}, interruption.left());
  EXPECT_EQ(resumed.theta, undisturbed.theta);
  ASSERT_EQ(resumed.uncertainty.budget.size(), undisturbed.uncertainty.budget.size());
  for (std::size_t i = 0; i < resumed.uncertainty.budget.size(); ++i) {
    EXPECT_EQ(resumed.uncertainty.budget[i].cause, undisturbed.uncertainty.budget[i].cause);
    EXPECT_NEAR(resumed.uncertainty.budget[i].std[0], undisturbed.uncertainty.budget[i].std[0],
                1e-6 * undisturbed.uncertainty.std[0])
        << resumed.uncertainty.budget[i].cause;
  }
}

}  // namespace
}  // namespace pliant::alternatives_test
