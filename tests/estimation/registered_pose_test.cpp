// The pose from which an object is released, where it lies far from its scan.
#include "estimation/followed.hpp"
#include "estimation/optimiser.hpp"
#include "support/swinging.hpp"

namespace pliant::registered_pose_test {
namespace {

constexpr double noise = 1e-3;

/// A bar that hangs, is held aside by several of its widths, and let go: what was seen of its end is nearest to another
/// part of the scan, if to any.
struct PulledBar : ::testing::Test {
  static test::SwingOptions options() {
    test::SwingOptions o;
    o.pulls = {{0.4, 0.15, 0.0}, {-0.02, 0.02, 0.0}};
    o.frames = 5;
    return o;
  }
  static RecordedCapture recording(const test::Swing& swing) {
    test::Sensors sensors = three_sensors(swing, 48);
    sensors.noise = noise;
    test::SwingRecording seen(swing, sensors);
    for (std::size_t c = 0; c < seen.capture.depth.size(); ++c)
      seen.capture.depth[c].name = "sensor " + std::to_string(c);
    seen.capture.scene.object.density = swing.theta[swing.layout.density];
    seen.capture.scene.world.gravity = swing.theta.segment<3>(swing.layout.gravity);
    seen.capture.scene.fixed = {{RegionHalfSpace{{0.0, 0.0, -0.005}, {0.0, 0.0, 1.0}}, std::nullopt}};
    return {seen.capture, seen.observed};
  }
  static const test::Swing& swing() {
    static const test::Swing swing(options());
    return swing;
  }

  RecordedCapture recorded = recording(swing());
  FitOptions choices;
  const int last_held = swing().options.held - 1;
};

TEST_F(PulledBar, IsRegisteredWhereItWasHeld) {
  const auto pose = registered_pose(recorded, choices);
  ASSERT_TRUE(pose.has_value());
  ASSERT_EQ(pose->points.frames.size(), 1u) << "the last of the frames in which it was held";
  const auto& seen = pose->points.frames.at(last_held);
  EXPECT_GT(seen.size(), 100u);
  const Embedding marks(*swing().truth, pose->points.rest);
  const Points& there = swing().positions[std::size_t(last_held)];
  double error = 0.0, way = 0.0;
  for (const TrackObservation& mark : seen) {
    error += (mark.position - marks.position(mark.point, there)).norm() / double(seen.size());
    way += (mark.position - pose->points.rest[std::size_t(mark.point)]).norm() / double(seen.size());
  }
  EXPECT_GT(way, 0.05 * swing().size);
  EXPECT_LT(error, 0.05 * way);
}

TEST_F(PulledBar, HasNoPoseWhereItWasNotReleasedOrNotSeenOrIsFollowed) {
  const auto without = [&](const std::function<void(RecordedCapture&)>& change) {
    RecordedCapture other = recorded;
    change(other);
    return registered_pose(other, choices).has_value();
  };
  EXPECT_FALSE(without([](RecordedCapture& r) { r.capture.scene.initial.released = false; }));
  EXPECT_FALSE(without([](RecordedCapture& r) {
    r.capture.scene.initial.release_of = Weight{0.02, Vector3(0, 0, -0.6)};
  }));
  EXPECT_FALSE(without([](RecordedCapture& r) { r.followed = TrackedPoints{}; }));
  EXPECT_FALSE(without(
      [&](RecordedCapture& r) { std::erase_if(r.observed, [&](const auto& f) { return f.frame <= last_held; }); }));
  EXPECT_FALSE(without([](RecordedCapture& r) { r.capture.scene.fixed[0].displaced_to = RigidMotion(); }))
      << "what cannot be tracked has none";
  EXPECT_FALSE(registered_pose(recorded, choices, [] { return true; }).has_value()) << "interrupted at once";
}

/// How far a place is from a point of the bar's middle line, times its length.
double off(const Vector3& place, double height) { return std::abs(place.z() - height) / 0.6; }

TEST_F(PulledBar, IsHeldWhereAHandWas) {
  const auto pose = registered_pose(recorded, choices);
  ASSERT_TRUE(pose.has_value());
  ASSERT_EQ(pose->pulled_at.size(), 1u) << "the other pull is a twentieth of it";
  EXPECT_LT(off(pose->pulled_at[0], -0.6), 0.15);
  recorded.capture.scene.initial.pulled_at = pose->pulled_at;
  std::vector<std::string> notes;
  const Recordings recordings({recorded}, choices, notes);
  EXPECT_EQ(recordings.front().blocks.motion.pulls.size(), 1u);
  EXPECT_EQ(recordings.grid(8.0, 1.0).recording.front().simulation.pull_points.at, pose->pulled_at);
}

TEST_F(PulledBar, IsHeldInItsMiddleWhereItsEndHangsFreely) {
  test::SwingOptions in_the_middle = options();
  in_the_middle.pulls = {{0.0, 0.0, 0.0}, {0.3, 0.1, 0.0}};
  const auto pose = registered_pose(recording(test::Swing(in_the_middle)), choices);
  ASSERT_TRUE(pose.has_value());
  ASSERT_EQ(pose->pulled_at.size(), 1u);
  EXPECT_LT(off(pose->pulled_at[0], -0.3), 0.15);
}

TEST_F(PulledBar, IsHeldInTwoPlacesWhereOneIsNotEnough) {
  test::SwingOptions bent = options();
  bent.pulls = {{-0.4, 0.0, 0.0}, {0.6, 0.1, 0.0}};
  const RecordedCapture other = recording(test::Swing(bent));
  const auto pose = registered_pose(other, choices);
  ASSERT_TRUE(pose.has_value());
  EXPECT_GE(pose->pulled_at.size(), 2u);
  choices.pull_points = 1;
  EXPECT_EQ(registered_pose(other, choices)->pulled_at.size(), 1u) << "no more than are allowed";
}

/// What a fit makes of it.
struct FittedBar : PulledBar {
  FittedBar() {
    recorded.pose = registered_pose(recorded, choices)->points;
    choices.points_per_frame = 0;
    recordings = std::make_unique<Recordings>(std::vector{recorded}, choices, notes);
    grid = recordings->grid(12.0, 1.0);
    theta = recordings->parameters().reference();
    recordings->set_moduli(theta, VectorX::Constant(1, swing().options.youngs_modulus));
  }
  ParameterSet pulls_alone() const {
    ParameterSet set = recordings->parameters();
    for (const Parameter& p : recordings->parameters().parameters())
      set.set_estimated(p.name, p.name.starts_with("pull@"));
    set.set_reference(theta);
    return set;
  }
  Objective objective(const ParameterSet& parameters, const VectorX& pose_of, bool by_pose, int last_frame) const {
    return recordings->objective(grid, parameters,
                                 {0.12, [=](const Recording&) { return last_frame; }, pose_of, by_pose});
  }
  /// Pulls that hold the bar where it was registered.
  VectorX held() const {
    const ParameterSet pulls = pulls_alone();
    Objective o = objective(pulls, {}, true, 0);
    OptimiserOptions options;
    options.max_iterations = 24;
    const OptimiserSummary found = minimise(o, pulls.to_unconstrained(theta), options);
    EXPECT_TRUE(found.succeeded && found.converged) << found.reason;
    return pulls.to_theta(found.p);
  }

  std::vector<std::string> notes;
  std::unique_ptr<Recordings> recordings;
  Grid grid;
  VectorX theta;
};

TEST_F(FittedBar, IsHeldThereByPulls) {
  const VectorX found = held();
  ParameterSet pulls = pulls_alone();
  Objective by_surface = objective(pulls, {}, false, 0);
  const CostEvaluation before = by_surface.evaluate(pulls.to_unconstrained(theta)),
                       after = by_surface.evaluate(pulls.to_unconstrained(found));
  ASSERT_TRUE(before.succeeded && after.succeeded) << before.failure << after.failure;
  // The sensors' outliers are in the mean.
  const auto half_of = [](const CostEvaluation& e) {
    std::vector<float> distances = e.frames.front().distances;
    std::ranges::nth_element(distances, distances.begin() + std::ptrdiff_t(distances.size() / 2));
    return distances[distances.size() / 2];
  };
  EXPECT_GT(half_of(before), 20.0 * noise);
  EXPECT_LT(half_of(after), noise);
}

TEST_F(FittedBar, StartsInAPoseWhateverItsMaterial) {
  const VectorX found = held();
  ParameterSet parameters = pulls_alone();
  parameters.set_estimated("youngs_modulus", true);
  parameters.set_reference(found);
  const auto first_and_last_cost = [&](Objective o, const VectorX& at) {
    const CostEvaluation e = o.evaluate(parameters.to_unconstrained(at));
    EXPECT_TRUE(e.succeeded) << e.failure;
    return std::pair(e.frames.front().cost, e.frames.back().cost);
  };
  VectorX other = found;
  for (const ParameterHandle& pull : recordings->front().blocks.motion.pulls) other.segment<3>(pull).setZero();
  const auto [pose, last] = first_and_last_cost(objective(parameters, found, false, 3), found);
  EXPECT_NEAR(first_and_last_cost(objective(parameters, {}, false, 3), found).second, last, 1e-6 * last)
      << "the same motion with the same parameters";
  EXPECT_EQ(first_and_last_cost(objective(parameters, found, false, 3), other).second, last) << "pulls play no part";
  VectorX softer = found;
  recordings->set_moduli(softer, VectorX::Constant(1, 0.25 * swing().options.youngs_modulus));
  const auto [same_pose, slower] = first_and_last_cost(objective(parameters, found, false, 3), softer);
  EXPECT_EQ(same_pose, pose);
  EXPECT_GT(std::abs(slower / last - 1.0), 0.05) << "it swings otherwise";
}

}  // namespace
}  // namespace pliant::registered_pose_test
