// Tracking and estimation in turns, against the fit of the points, on a bar that swings under its weight.
#include "estimation/tracking_loop.hpp"

#include <gmock/gmock.h>

#include <random>

#include "estimation/fit_config.hpp"
#include "estimation/fit_plan.hpp"
#include "estimation/followed.hpp"
#include "geometry/primitives.hpp"
#include "support/interruption.hpp"

namespace pliant::tracking_loop_test {
namespace {

using testing::HasSubstr;

constexpr double length = 0.4, edge = 0.05, modulus = 1.2e5, noise = 1.5e-3;
constexpr int frames = 30;

/// A bar along x, clamped at its low end, let go straight; half of its surface is seen as points. Made by the same
/// elements and law as it is fitted with, on a finer mesh with shorter steps: an inverse crime in part.
/// @param beyond  Young's modulus of the half that is not held [Pa]
RecordedCapture swinging_bar(int frames_seen = frames, double beyond = modulus) {
  RecordedCapture recorded;
  Capture& capture = recorded.capture;
  capture.name = "bar";
  capture.scene.object.surface = make_box(Vector3(length, edge, edge), 0.0125);
  capture.scene.object.surface_noise = 0.0;
  capture.scene.object.density = 300.0;
  capture.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
  for (int f = 0; f < frames_seen; ++f) capture.scene.timing.times.push_back(f / 30.0);
  capture.scene.fixed = {{RegionBox{Vector3(-1, -1, -1), Vector3(-0.5 * length + 1e-4, 1, 1)}, {}}};
  capture.clouds = {{{"cloud.ply"}, 1, noise}};
  capture.scene.regions = {{"beyond", RegionHalfSpace{Vector3::Zero(), Vector3::UnitX()}}};
  const auto [parameters, blocks] = default_parameters(capture, enclosed_volume(*capture.scene.object.surface), 2);
  VectorX theta = parameters.reference();
  theta[blocks.motion.youngs_moduli[0]] = modulus, theta[blocks.motion.youngs_moduli[1]] = beyond;
  theta[blocks.motion.mass_damping] = 0.4;
  theta[blocks.motion.stiffness_damping] = 4e-3;
  Resolution resolution;
  resolution.cells = 16.0, resolution.steps = 2.0;
  const Discretisation d = discretise(capture, capture_distance(capture, 0.2), resolution, blocks, theta);
  const Embedding embedding(*d.body, capture.scene.object.surface->vertices);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const RolloutSummary summary = Simulation(d.body, d.simulation).run(theta, [&](int frame, const State& state, auto) {
    const Points x = embedding.positions(state.x);
    ObservedFrame seen;
    seen.frame = frame;
    for (Eigen::Index v = 0; v < x.rows(); ++v) {
      if (capture.scene.object.surface->vertices[std::size_t(v)].z() < 0.0) continue;
      seen.points.push_back(Vector3(x.row(v)) + noise * Vector3(normal(random), normal(random), normal(random)));
      seen.noise.push_back(float(noise));
      seen.view.emplace_back(Vector3::Zero());
      seen.camera.push_back(-1);
      seen.pixel.push_back(-1);
    }
    recorded.observed.push_back(std::move(seen));
    return true;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  capture.scene.regions.clear();
  return recorded;
}

FitOptions quick(TrackingUse tracking) {
  FitOptions options;
  options.budget = 0.0;
  options.cells = options.coarse_cells = 8.0;
  options.parameters["poissons_ratio"].estimated = false;
  options.starts = 1;
  options.tracking = tracking;
  return options;
}

double found(const FitOutcome& outcome) { return outcome.theta[outcome.parameters.find("youngs_modulus")->at]; }

TEST(TrackingLoop, LeadsToTheModulusFromOneTenTimesOff) {
  for (const double wrong : {0.1, 10.0}) {
    FitOptions options = quick(TrackingUse::Loop);
    options.parameters["youngs_modulus"].start = VectorX::Constant(1, wrong * modulus);
    const FitOutcome outcome = fit({swinging_bar()}, options);
    ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
    ASSERT_TRUE(outcome.tracking.has_value());
    ASSERT_GE(outcome.tracking->rounds.size(), 2u) << "what was tracked with a wrong material is tracked again";
    EXPECT_EQ(outcome.tracking->rounds.front().youngs_modulus, wrong * modulus);
    EXPECT_FALSE(outcome.tracking->rounds.back().lost);
    EXPECT_LT(outcome.tracking->rounds.back().surface_rms, noise);
    EXPECT_NEAR(found(outcome) / modulus, 1.0, 0.1) << wrong;
    EXPECT_LT(outcome.evaluation.surface_rms(), 1.5 * noise) << "the agreement told is that with the points";
    EXPECT_GT(outcome.evaluation.surface_rms(), 0.5 * noise);
  }
}

TEST(TrackingLoop, FindsThatOneModulusIsNotEnough) {
  constexpr double soft = 0.3 * modulus;
  FitOptions options = quick(TrackingUse::Loop);
  options.control_points = FitOptions::automatic;
  const FitOutcome outcome = fit({swinging_bar(frames, soft)}, options);
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  const auto& moduli = outcome.recordings.front().discretisation.simulation.blocks.youngs_moduli;
  ASSERT_GT(moduli.size(), 1u);
  EXPECT_GT(outcome.fields.size(), 1u);
  // Moduli that blend cannot step, and nothing bends at the free end.
  EXPECT_NEAR(std::log(outcome.theta[moduli.front()] / modulus), 0.0, std::log(2.0));
  EXPECT_GT(outcome.theta[moduli.front()], 1.5 * outcome.theta[moduli.back()]);
  EXPECT_EQ(outcome.tracking->rounds.front().controls, int(moduli.size())) << "chosen in the first round";
  EXPECT_GE(outcome.tracking->rounds.size(), 2u) << "and tracked with what was found";
}

TEST(TrackingLoop, AndThePointsAreComparedByFramesLeftOut) {
  const FitOutcome outcome = fit({swinging_bar()}, quick(TrackingUse::Both));
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  ASSERT_TRUE(outcome.tracking.has_value());
  const TrackingOutcome& tracking = *outcome.tracking;
  ASSERT_TRUE(tracking.loop && tracking.direct);
  EXPECT_EQ(tracking.loop->frames, 6);
  EXPECT_EQ(tracking.keeps_loop, tracking.loop->cost < tracking.direct->cost);
  EXPECT_LT(tracking.direct->surface_rms, 1.5 * noise);
  EXPECT_THAT(outcome.notes.front(), HasSubstr("every 5th frame was left out"));
  EXPECT_THAT(outcome.notes.front(), HasSubstr(tracking.keeps_loop ? "tracked motion's was kept" : "points' was kept"));
  EXPECT_EQ(outcome.evaluation.frames.size(), std::size_t(frames)) << "all frames take part at last";
  ASSERT_EQ(tracking.tracks.size(), 1u);
  EXPECT_EQ(tracking.tracks.front()->frames.size(), std::size_t(frames));
  EXPECT_NEAR(found(outcome) / modulus, 1.0, 0.1);
}

/// Interrupted in every phase, written to a file and read back.
TEST(TrackingLoop, GoesOnAfterAnInterruptionToTheSameEnd) {
  const FitOptions options = quick(TrackingUse::Both);
  const RecordedCapture bar = swinging_bar();
  const FitOutcome undisturbed = fit({bar}, options);
  for (const char* stage : {"round 2: fine", "points: fine", "all frames: fine"}) {
    test::Interruption interruption(stage);
    const FitOutcome interrupted = fit({bar}, options, interruption.monitor());
    ASSERT_TRUE(interruption.came()) << stage;
    EXPECT_TRUE(interrupted.interrupted) << stage;
    const FitOutcome resumed = fit({bar}, options, {}, interruption.left());
    EXPECT_EQ(resumed.tracking->keeps_loop, undisturbed.tracking->keeps_loop) << stage;
    EXPECT_NEAR(found(resumed) / found(undisturbed), 1.0, 2e-3) << stage;
  }
}

constexpr int few = 10;  // frames

FitOptions quickest(TrackingUse tracking) {
  FitOptions options = quick(tracking);
  options.cells = options.coarse_cells = 5.0;
  options.tracking_rounds = 2;
  options.max_iterations = 6;
  options.parameters["youngs_modulus"].start = VectorX::Constant(1, 2.0 * modulus);
  return options;
}

TEST(TrackingLoop, GoesOnWhereAllRoundsWereDone) {
  const FitOptions options = quickest(TrackingUse::Loop);
  const RecordedCapture bar = swinging_bar(few);
  test::Interruption never;
  const FitOutcome undisturbed = fit({bar}, options, never.monitor());
  ASSERT_TRUE(undisturbed.evaluation.succeeded) << undisturbed.reason;
  FitState left = never.left();
  ASSERT_EQ(left.tracking->phase, FitState::Tracking::Phase::Direct);
  const FitOutcome resumed = fit({bar}, options, {}, std::move(left));
  ASSERT_TRUE(resumed.evaluation.succeeded) << resumed.reason;
  EXPECT_EQ(resumed.theta, undisturbed.theta);
  EXPECT_EQ(resumed.tracking->rounds.size(), undisturbed.tracking->rounds.size());
}

/// Half-followed recordings say nothing.
void expect_nothing(const FitOutcome& outcome) {
  EXPECT_TRUE(outcome.interrupted);
  EXPECT_FALSE(outcome.converged);
  EXPECT_EQ(outcome.reason, "interrupted");
  EXPECT_FALSE(outcome.evaluation.succeeded);
  EXPECT_EQ(outcome.theta.size(), 0);
  EXPECT_TRUE(outcome.tracking->tracks.empty());
}
void expect_best_so_far(const FitOutcome& outcome, const VectorX& theta, int frames_followed) {
  EXPECT_TRUE(outcome.interrupted);
  EXPECT_FALSE(outcome.converged);
  EXPECT_EQ(outcome.reason, "interrupted");
  EXPECT_TRUE(outcome.evaluation.succeeded);
  EXPECT_EQ(outcome.theta, theta);
  ASSERT_EQ(outcome.tracking->tracks.size(), 1u);
  EXPECT_EQ(int(outcome.tracking->tracks.front()->frames.size()), frames_followed);
}

FitMonitor interrupted_at_once() {
  FitMonitor monitor;
  monitor.interrupted = [] { return true; };
  return monitor;
}

TEST(TrackingLoop, InterruptedAsItFollowsEndsWithTheBestSoFar) {
  using Phase = FitState::Tracking::Phase;
  const FitOptions options = quickest(TrackingUse::Both);
  const RecordedCapture bar = swinging_bar(few);
  const auto after = [](std::size_t rounds, Phase phase) {
    return [=](const FitState& s) { return s.tracking->rounds.size() == rounds && s.tracking->phase == phase; };
  };
  expect_nothing(fit({bar}, options, interrupted_at_once()));
  {
    test::Interruption second(after(1, Phase::Loop));
    const FitOutcome outcome = fit({bar}, options, second.monitor());
    ASSERT_TRUE(second.came());
    const FitState left = second.left();
    expect_best_so_far(outcome, left.tracking->rounds.front().theta, few);
    expect_nothing(fit({bar}, options, interrupted_at_once(), left));
  }
  FitOptions one_round = options;
  one_round.tracking_rounds = 1;
  test::Interruption at_last(after(1, Phase::Last));
  const FitOutcome outcome = fit({bar}, one_round, at_last.monitor());
  ASSERT_TRUE(at_last.came());
  const FitState left = at_last.left();
  const auto& best = left.tracking->keeps_loop ? left.tracking->loop : left.tracking->direct;
  expect_best_so_far(outcome, estimate_of(*best)->theta, few);
  expect_nothing(fit({bar}, one_round, interrupted_at_once(), left));

  // The points were fitted before, and the rounds' estimate is looked for again to compare with.
  FitState points{*left.tracking->direct, {}, left.tracking, {}};
  points.tracking->phase = Phase::Direct, points.tracking->direct.reset();
  const FitOutcome direct = fit({bar}, one_round, interrupted_at_once(), points);
  EXPECT_TRUE(direct.interrupted);
  EXPECT_EQ(direct.theta, estimate_of(points.pass)->theta);
}

TEST(TrackingLoop, GoesOnUntilNoModulusChanges) {
  FitOptions options = quickest(TrackingUse::Loop);
  RecordedCapture bar = swinging_bar(few);
  bar.capture.scene.regions = {{"beyond", RegionHalfSpace{Vector3::Zero(), Vector3::UnitX()}}};
  constexpr double wrong = 5.0;
  options.parameters["youngs_modulus"] = {VectorX::Constant(1, modulus), false, {}};
  options.parameters["youngs_modulus@beyond"].start = VectorX::Constant(1, wrong * modulus);
  const FitOutcome outcome = fit({bar}, options);
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  const std::vector<TrackingRound>& rounds = outcome.tracking->rounds;
  ASSERT_EQ(rounds.size(), 2u) << "the modulus beyond has changed, though the first one has not";
  const ParameterLayout& layout = outcome.parameters.layout();
  double before = wrong * modulus;
  for (const TrackingRound& round : rounds) {
    EXPECT_EQ(round.theta[layout.at("youngs_modulus")], modulus);
    const double now = round.theta[layout.at("youngs_modulus@beyond")];
    EXPECT_NEAR(round.change, std::abs(std::log(now / before)), 1e-12);
    before = now;
  }
}

TEST(TrackingLoop, IsWhereItSuits) {
  RecordedCapture bar = swinging_bar();
  const FitOptions automatic = quick(TrackingUse::Automatic);
  EXPECT_TRUE(tracks({bar}, automatic));
  EXPECT_FALSE(tracks({bar}, {})) << "not unless it is asked for";
  EXPECT_FALSE(tracks({bar}, quick(TrackingUse::Off)));
  RecordedCapture still = bar;
  still.capture.scene.timing.is_static = true;
  EXPECT_FALSE(tracks({still}, automatic));
  EXPECT_TRUE(tracks({still}, quick(TrackingUse::Loop))) << "on request";
  RecordedCapture one_camera = bar;
  one_camera.capture.clouds.clear();
  one_camera.capture.depth.resize(1);
  EXPECT_FALSE(tracks({one_camera}, automatic));
  one_camera.capture.depth.resize(2);
  EXPECT_TRUE(tracks({one_camera}, automatic));
}

TEST(TrackingLoop, IsAKeyOfAFit) {
  FitOptions options;
  for (const char* use : {"off", "loop", "both", "auto"}) {
    set_fit_option(options, std::string("tracking=") + use);
    EXPECT_THAT(to_toml(options), HasSubstr("tracking = \"" + std::string(use) + "\""));
  }
  set_fit_option(options, "tracking_rounds=11");
  EXPECT_THAT(options.validate(), HasSubstr("tracking_rounds"));
}

TEST(SupportedPoints, AreThoseAboutWhichPointsWereSeen) {
  const RecordedCapture bar = swinging_bar();
  Track track;
  const auto distance = capture_distance(bar.capture, 0.2);
  Resolution resolution;
  resolution.cells = 8.0;
  const CaptureParameters p = default_parameters(bar.capture, enclosed_volume(*bar.capture.scene.object.surface));
  track.body = discretise(bar.capture, distance, resolution, p.blocks, p.set.reference()).body;
  track.marks = {Vector3(0.1, 0.0, 0.02), Vector3(-0.1, 0.01, 0.0)};
  TrackedFrame frame;
  frame.nodes = track.body->nodes.rowwise() + Eigen::RowVector3d(0.0, 0.5, 0.0);
  frame.points = 100, frame.surface_rms = 2e-3;
  frame.mark_points = {5, 0};
  track.frames = {frame, frame, frame};
  track.frames[1].frame = 1, track.frames[1].is_lost = true;
  track.frames[2].frame = 2, track.frames[2].points = 0;
  const TrackedPoints points = supported_points(track, length);
  EXPECT_EQ(points.rest.size(), 2u);
  ASSERT_EQ(points.frames.size(), 1u) << "lost and empty frames say nothing";
  ASSERT_EQ(points.frames.at(0).size(), 1u);
  const TrackObservation& seen = points.frames.at(0).front();
  EXPECT_EQ(seen.point, 0);
  EXPECT_EQ(seen.noise, 2e-3);
  EXPECT_LT((seen.position - (track.marks[0] + Vector3(0.0, 0.5, 0.0))).norm(), 1e-12);
}

}  // namespace
}  // namespace pliant::tracking_loop_test
