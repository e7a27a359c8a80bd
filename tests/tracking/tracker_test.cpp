// Recordings are made by the program itself: physics are the same as the tracker's (an inverse crime in that), mesh,
// elements, integrator and steps are others.
#include "tracking/tracker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "support/swinging.hpp"

namespace pliant::tracker_test {
namespace {

using test::Sensors;
using test::Swing;
using test::SwingRecording;
using testing::HasSubstr;

constexpr double one_percent = 0.01;  // mean error of the nodes over the object's size

const Swing& bar() {
  static const Swing swing{test::SwingOptions{}};
  return swing;
}

/// Three sensors that do not see the middle third of the bar.
Sensors sensors_of(const Swing& swing) {
  Sensors sensors = test::three_sensors(swing, 96);
  sensors.hidden = [shape = swing.options.shape](const Vector3& p) { return test::is_in_middle_third(shape, p); };
  return sensors;
}

SwingRecording recording() {
  static const SwingRecording recorded(bar(), sensors_of(bar()));
  return recorded;
}

void expect_followed(const Swing& swing, const Track& track, int from = 0) {
  ASSERT_EQ(int(track.frames.size()), swing.frame_count());
  for (const TrackedFrame& frame : track.frames)
    if (frame.frame >= from) {
      EXPECT_LT(swing.error(frame.frame, frame.nodes), one_percent) << "frame " << frame.frame;
      EXPECT_FALSE(frame.is_lost) << "frame " << frame.frame;
    }
}

TEST(Tracker, FollowsASwingingBarWhoseMiddleIsHidden) {
  const Swing& swing = bar();
  const SwingRecording recorded = recording();
  const Track track = recorded.track(swing);
  expect_followed(swing, track);
  EXPECT_FALSE(track.lost_at);
  EXPECT_TRUE(track.note.empty());
  EXPECT_GT(swing.fastest(), 0.04) << "it moves";
  EXPECT_GT(swing.error(0, swing.body->nodes), 5.0 * one_percent) << "it was not at rest when it was held";
  for (const TrackedFrame& frame : track.frames) {
    EXPECT_EQ(frame.is_held, swing.is_held(frame.frame));
    EXPECT_DOUBLE_EQ(frame.time, swing.time(frame.frame));
    EXPECT_EQ(frame.points, int(recorded.observed[std::size_t(frame.frame)].points.size()));
    EXPECT_EQ(frame.residuals.size(), std::size_t(frame.points));
    EXPECT_NEAR(frame.explained, 0.99, 0.015) << "one in a hundred is an outlier";
    EXPECT_NEAR(frame.surface_rms, 0.003, 0.001) << "the sensors' noise, less where a surface is steep";
    EXPECT_GT(frame.confidence, 0.9);
    EXPECT_LT(frame.supported, 0.85) << "of what could be seen a third is hidden";
    int on_marks = 0;
    for (const int points : frame.mark_points) on_marks += points;
    EXPECT_EQ(on_marks, int(std::lround(frame.explained * frame.points)));
  }
  EXPECT_EQ(track.frames.front().mark_points.size(), track.marks.size());
}

TEST(Tracker, FollowsMotionOfATenthOfTheSizeBetweenFrames) {
  test::SwingOptions options;
  options.youngs_modulus = 1.5e6;
  options.pulls.front() *= 1.6;
  options.frames = 9;
  const Swing swing(options);
  EXPECT_GT(swing.fastest(), 0.1);
  expect_followed(swing, SwingRecording(swing, sensors_of(swing)).track(swing));
}

/// Where the object is depends little on how stiff it is thought to be.
TEST(Tracker, FollowsWithAMaterialTenTimesTooHard) {
  VectorX theta = bar().theta;
  bar().layout.scale_moduli(theta, 10.0);
  expect_followed(bar(), recording().track(bar(), theta));
}

TEST(Tracker, FollowsALeafOfQuadraticTetrahedra) {
  test::SwingOptions options;
  options.shape = test::SwingShape::Leaf;
  options.youngs_modulus = 8e6;
  options.pulls = {{0.0, 0.02, 0.15}, {0.0, 0.0, -0.02}};
  options.true_cells = {10, 4, 1}, options.tracked_cells = {8, 3, 1};
  options.tracked_is_quadratic = true;
  options.frames = 7;
  options.spacing = 0.03;
  const Swing swing(options);
  EXPECT_GT(swing.fastest(), 0.04);
  expect_followed(swing, SwingRecording(swing, sensors_of(swing)).track(swing));
}

/// What is not seen for a frame is simulated; what is elsewhere for a frame draws nothing away.
TEST(Tracker, OutlastsFramesWithoutPointsAndFramesOfOutliers) {
  const Swing& swing = bar();
  SwingRecording recorded = recording();
  ObservedFrame& nothing = recorded.observed[5];
  nothing.points.clear(), nothing.noise.clear();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (Vector3& point : recorded.observed[8].points)
    point = Vector3(0.0, 0.0, -0.3) + 2.0 * swing.size * Vector3(uniform(random), uniform(random), uniform(random));
  const Track track = recorded.track(swing);
  ASSERT_EQ(int(track.frames.size()), swing.frame_count());
  EXPECT_EQ(track.frames[5].confidence, 0.0);
  EXPECT_FALSE(track.frames[5].is_lost) << "nothing says that it is elsewhere";
  EXPECT_LT(track.frames[8].explained, 0.3);
  EXPECT_TRUE(track.frames[8].is_lost);
  EXPECT_FALSE(track.lost_at) << "it is found again in the next";
  for (const int f : {4, 5, 6, 7, 9, 10, 11}) {
    EXPECT_LT(swing.error(f, track.frames[std::size_t(f)].nodes), one_percent) << "frame " << f;
    EXPECT_FALSE(track.frames[std::size_t(f)].is_lost) << "frame " << f;
  }
}

TEST(Tracker, SaysWhereTheObjectIsGone) {
  const Swing& swing = bar();
  SwingRecording recorded = recording();
  constexpr int gone = 6;
  for (std::size_t f = gone; f < recorded.observed.size(); ++f)
    for (Vector3& point : recorded.observed[f].points) point += Vector3(0.0, 2.5 * swing.size, 0.0);
  const Track track = recorded.track(swing);
  ASSERT_TRUE(track.lost_at);
  EXPECT_EQ(*track.lost_at, gone);
  for (const TrackedFrame& frame : track.frames) {
    EXPECT_EQ(frame.is_lost, frame.frame >= gone) << "frame " << frame.frame;
    EXPECT_TRUE(frame.nodes.allFinite());
  }
}

TEST(Tracker, FollowsMarkersAlone) {
  const Swing& swing = bar();
  SwingRecording recorded = recording();
  for (ObservedFrame& frame : recorded.observed) frame.points.clear(), frame.noise.clear();
  for (std::size_t v = 0; v < swing.surface.vertices.size(); v += swing.surface.vertices.size() / 15)
    recorded.markers.push_back(swing.surface.vertices[v]);
  const Embedding markers(*swing.truth, recorded.markers);
  std::mt19937 random(9);
  std::normal_distribution<double> noise(0.0, 5e-4);
  for (int f = 0; f < swing.frame_count(); ++f) {
    const Points there = markers.positions(swing.positions[std::size_t(f)]);
    for (int m = 0; m < markers.point_count(); ++m)
      if ((m + f) % 5 != 0)  // a marker may be missing
        recorded.seen_markers[f].push_back(
            {m, there.row(m).transpose() + Vector3(noise(random), noise(random), noise(random)), 5e-4});
  }
  const Track track = recorded.track(swing);
  expect_followed(swing, track);
  EXPECT_FALSE(track.lost_at);
  for (const TrackedFrame& frame : track.frames) {
    EXPECT_EQ(frame.points, 0);
    EXPECT_GE(frame.markers, 12);
    EXPECT_LT(frame.marker_rms, 0.005);
  }
}

/// A camera that is known says what it cannot see; a cloud's sensor is not known.
TEST(Tracker, KnowsWhatACameraCannotSee) {
  const Swing& swing = bar();
  Sensors sensors = test::three_sensors(swing, 96);
  sensors.cameras.resize(1);
  SwingRecording recorded(swing, sensors);
  const Track by_camera = recorded.track(swing);
  expect_followed(swing, by_camera);
  recorded.capture.clouds.emplace_back();
  const Track by_cloud = recorded.track(swing);
  EXPECT_EQ(by_cloud.times.visibility, 0.0);
  for (std::size_t f = 0; f < by_camera.frames.size(); ++f) {
    EXPECT_GT(by_camera.frames[f].supported, 0.85) << "what it could see it saw";
    EXPECT_LT(by_cloud.frames[f].supported, 0.7) << "the back was not seen, for all that is known";
  }
}

TEST(Tracker, IsTheSameForEveryNumberOfThreads) {
  const SwingRecording recorded = recording();
  const Track many = recorded.track(bar());
  const ThreadLimit one(1);
  const Track alone = recorded.track(bar());
  ASSERT_EQ(many.frames.size(), alone.frames.size());
  for (std::size_t f = 0; f < many.frames.size(); ++f) {
    EXPECT_EQ(many.frames[f].nodes, alone.frames[f].nodes) << f;
    EXPECT_EQ(many.frames[f].confidence, alone.frames[f].confidence) << f;
    EXPECT_EQ(many.frames[f].mark_points, alone.frames[f].mark_points) << f;
    EXPECT_EQ(many.frames[f].rounds, alone.frames[f].rounds) << f;
  }
}

TEST(Tracker, ComparesWithoutMoving) {
  const Swing& swing = bar();
  const Sensors sensors = sensors_of(swing);
  Tracker tracker(swing.body, swing.scene, swing.theta, swing.surface, sensors.cameras, {}, 900, sensors.noise);
  const Points rest = tracker.state().x;
  const TrackedFrame elsewhere = tracker.compare(sensors.see(swing, 0));
  EXPECT_EQ(tracker.state().x, rest);
  EXPECT_EQ(elsewhere.nodes, rest);
  tracker.set_state({swing.true_nodes(0), Points::Zero(rest.rows(), 3)});
  const TrackedFrame there = tracker.compare(sensors.see(swing, 0));
  EXPECT_GT(there.explained, 0.95);
  EXPECT_LT(elsewhere.explained, 0.8);
}

TEST(Tracker, StopsWhereItIsTold) {
  const SwingRecording recorded = recording();
  const Track track = pliant::track(recorded.capture, bar().body, bar().scene, bar().theta, recorded.observed, {}, {},
                                    {}, [](int done, int total) {
                                      EXPECT_EQ(total, bar().frame_count());
                                      return done < 3;
                                    });
  EXPECT_EQ(track.frames.size(), 3U);
}

TEST(Tracker, RefusesClampsThatMove) {
  SwingRecording recorded = recording();
  recorded.capture.scene.fixed.push_back({RegionSphere{Vector3::Zero(), 0.1}, RigidMotion{}});
  try {
    (void)recorded.track(bar());
    FAIL() << "it should not track";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("displaced_to"));
  }
}

TEST(Tracker, RefusesARecordingThatShowsNothing) {
  SwingRecording recorded = recording();
  for (ObservedFrame& frame : recorded.observed) frame.points.clear(), frame.noise.clear();
  EXPECT_THROW((void)recorded.track(bar()), InputError);
}

/// No load-free shape holds up so soft a scan: it is followed as scanned, and the user is told.
TEST(Tracker, NotesAScanThatSagsTooSoftly) {
  const Swing& swing = bar();
  Swing sagging = swing;
  sagging.scene.scan_sags = true;
  sagging.scene.hold_strongly = true;
  SwingRecording recorded = recording();
  recorded.observed.resize(3);
  recorded.capture.scene.timing.times.resize(3);
  VectorX theta = swing.theta;
  EXPECT_EQ(recorded.track(sagging, theta).note, "");
  swing.layout.set_moduli(theta, 50.0);
  const Track track = recorded.track(sagging, theta);
  EXPECT_THAT(track.note, HasSubstr("too soft"));
  EXPECT_THAT(track.note, HasSubstr("without gravity"));
  EXPECT_EQ(track.body, swing.body);
  for (const TrackedFrame& frame : track.frames)
    EXPECT_LT(swing.error(frame.frame, frame.nodes), 2.0 * one_percent) << "frame " << frame.frame;
}

}  // namespace
}  // namespace pliant::tracker_test
