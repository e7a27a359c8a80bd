#include "output/track_output.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::track_output_test {
namespace {

using nlohmann::json;
using test::tolerance;

const Vector3 velocity(0.3, -0.1, 0.2);
constexpr double dt = 0.05;

/// Held in frame 2, then moving evenly; frames 0 and 1 show nothing.
Track evenly_moving() {
  Track track;
  track.body = test::tet_body({0.2, 0.1, 0.12}, {3, 2, 2}, false);
  for (int f = 2; f < 6; ++f) {
    TrackedFrame frame;
    frame.frame = f, frame.time = dt * f, frame.is_held = f == 2;
    frame.nodes = track.body->nodes.rowwise() + (dt * (f - 2) * velocity).transpose();
    frame.points = f == 4 ? 0 : 7;
    frame.confidence = f == 5 ? 0.1 : 1.0, frame.is_lost = f == 5;
    track.frames.push_back(frame);
  }
  track.lost_at = 5;
  return track;
}

TEST(TrackOutput, VelocitiesAreThoseOfTheWay) {
  const Track track = evenly_moving();
  const std::vector<State> states = states_of(track);
  ASSERT_EQ(states.size(), track.frames.size());
  EXPECT_EQ(states.front().v.norm(), 0.0) << "it was held";
  for (std::size_t i = 0; i < states.size(); ++i) {
    EXPECT_EQ(states[i].x, track.frames[i].nodes);
    if (i > 0) {
      EXPECT_LT((states[i].v.rowwise() - velocity.transpose()).cwiseAbs().maxCoeff(), tolerance(1e-13));
    }
  }
}

TEST(TrackOutput, FollowsPointsOfTheScan) {
  const std::vector<Vector3> rest = {{0.05, 0.02, -0.03}, {-0.1, 0.05, 0.06}};
  const std::vector<Points> paths = follow(evenly_moving(), rest, 8);
  ASSERT_EQ(paths.size(), 8U);
  for (int f = 0; f < 8; ++f)
    for (int i = 0; i < 2; ++i) {
      const Vector3 there = paths[std::size_t(f)].row(i);
      if (f < 2 || f > 5)
        EXPECT_TRUE(there.array().isNaN().all()) << f;
      else
        EXPECT_LT((there - rest[std::size_t(i)] - dt * (f - 2) * velocity).norm(), tolerance(1e-14)) << f;
    }
}

TEST(TrackOutput, JsonHoldsEveryFrame) {
  Track track = evenly_moving();
  Capture capture;
  capture.name = "even";
  const json found = json::parse(to_json(track, capture));
  EXPECT_EQ(found["format"], "track/1");
  EXPECT_EQ(found["capture"]["name"], "even");
  EXPECT_EQ(found["nodes"], track.body->node_count());
  EXPECT_EQ(found["lost_at"], 5);
  EXPECT_FALSE(found.contains("note"));
  ASSERT_EQ(found["frames"].size(), 4U);
  EXPECT_TRUE(found["frames"][0]["held"]);
  EXPECT_FALSE(found["frames"][1]["held"]);
  EXPECT_FALSE(found["frames"][2].contains("surface_rms")) << "no point, no distance";
  EXPECT_TRUE(found["frames"][1].contains("surface_rms"));
  EXPECT_TRUE(found["frames"][3]["lost"]);
  track.lost_at.reset();
  track.note = "stiff";
  EXPECT_TRUE(json::parse(to_json(track, capture))["lost_at"].is_null());
  EXPECT_EQ(json::parse(to_json(track, capture))["note"], "stiff");
}

}  // namespace
}  // namespace pliant::track_output_test
