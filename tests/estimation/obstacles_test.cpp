// What an object meets beside planes, and what leads it, takes part in fits. Recorded on the elements that they are
// fitted with (an inverse crime): what is shown is that nothing of the scene is lost on the way, and that derivatives
// are right.
#include <gtest/gtest.h>

#include "support/dropped.hpp"

namespace pliant::obstacles_test {
namespace {

FitOptions quick() {
  FitOptions options = test::six_cells();
  options.span = 1.0;
  return options;
}

KeyFrames<6>::Key key(double time, const Vector3& shift, const Vector3& turn) {
  KeyFrames<6>::Key key{time, {}};
  key.value << shift, turn;
  return key;
}

/// A block falls on a table, and a ball that moves pushes it: both rub, by how much nobody said.
TEST(Obstacles, ABlockThatFallsOnATableAndIsPushedByABallIsFitted) {
  test::Dropped dropped{.cells = 6.0};
  dropped.change = [](Scene& scene) {
    scene.planes.clear();
    scene.obstacles = {{ShapeBox{{-0.5, -0.2, -0.5}, {0.5, 0.03, 0.5}}, 0.45},
                       {ShapeBall{{0.3, 0.1, 0.0}, 0.06}, 0.45}};
    scene.obstacles[1].motion = {key(0.15, {0, 0, 0}, {0, 0, 0}), key(0.45, {-0.18, 0, 0}, {0, 0, 0})};
  };
  RecordedCapture recorded = dropped.record();
  for (RigidObstacle& obstacle : recorded.capture.scene.obstacles)
    obstacle.friction = 0.0, obstacle.knows_friction = false;
  const FitOutcome outcome = fit({recorded}, quick());
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_NEAR(test::value(outcome, "youngs_modulus"), dropped.youngs_modulus, 0.04 * dropped.youngs_modulus);
  EXPECT_NEAR(test::value(outcome, "obstacle_friction"), 0.45, 0.05);
  EXPECT_TRUE(outcome.parameters.find("obstacle_friction_2")->estimated);
  // Where nothing pushes it stays where it came down.
  recorded.capture.scene.obstacles.pop_back();
  EXPECT_GT(fit({recorded}, quick()).evaluation.cost, 2.0 * outcome.evaluation.cost);
}

/// A clamp at one end shakes the block: its stiffness shows in how the rest follows.
TEST(Obstacles, ABlockThatAClampShakesIsFitted) {
  test::Dropped dropped{.cells = 6.0};
  dropped.change = [](Scene& scene) {
    scene.planes.clear();
    scene.led = {{RegionSphere{{-0.1, 0.14, 0.0}, 0.06},
                  -infinite,
                  infinite,
                  {key(0.0, {0, 0, 0}, {0, 0, 0}), key(0.12, {0.03, 0.02, 0.0}, {0.0, 0.2, 0.0}),
                   key(0.24, {-0.03, 0.0, 0.02}, {0.0, 0.0, 0.3}), key(0.4, {0.02, -0.01, 0.0}, {0.2, 0.0, 0.0})}}};
  };
  const RecordedCapture recorded = dropped.record();
  const FitOutcome outcome = fit({recorded}, quick());
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_NEAR(test::value(outcome, "youngs_modulus"), dropped.youngs_modulus, 0.04 * dropped.youngs_modulus);
}

/// A ball pushes a block that slides on a rigid core.
TEST(Obstacles, ABlockThatSlidesOnARigidCoreIsFitted) {
  test::Dropped dropped{.cells = 6.0};
  dropped.change = [&](Scene& scene) {
    scene.planes.clear();
    TriangleMesh core = make_sphere(0.035, 3);
    for (Vector3& v : core.vertices) v += Vector3(0.0, 0.19, 0.0);
    TriangleMesh& surface = *scene.object.surface;
    const int first = int(surface.vertices.size());
    surface.vertices.insert(surface.vertices.end(), core.vertices.begin(), core.vertices.end());
    for (const auto& [a, b, c] : core.triangles) surface.triangles.push_back({first + a, first + c, first + b});
    scene.inner = {{core, {}, InnerBody::Contact::Sliding, true}};
    scene.obstacles = {{ShapeBall{{0.3, 0.21, 0.0}, 0.06}}};
    scene.obstacles[0].motion = {key(0.0, {0, 0, 0}, {0, 0, 0}), key(0.3, {-0.19, 0, 0}, {0, 0, 0})};
  };
  const FitOutcome outcome = fit({dropped.record()}, quick());
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_NEAR(test::value(outcome, "youngs_modulus"), dropped.youngs_modulus, 0.04 * dropped.youngs_modulus);
}

}  // namespace
}  // namespace pliant::obstacles_test
