#include "simulation/scene_simulation.hpp"

#include "geometry/primitives.hpp"

namespace pliant::scene_simulation_test {
namespace {

Scene bar() {
  Scene scene;
  scene.object.surface = make_box(Vector3(0.2, 0.05, 0.05), 0.025);
  scene.timing = evenly_timed(50.0, 3);
  return scene;
}

Body body_of(const Scene& scene) {
  Resolution resolution;
  resolution.cells = 4.0;
  std::vector<Vector3> controls;
  return *make_body_of(scene, *scene_distance(scene, 0.15), resolution, controls);
}

const MotionLayout blocks;

VectorX parameters() {
  VectorX theta = blocks.zero();
  theta[blocks.density] = 1000.0;
  theta.segment<3>(blocks.gravity) = Vector3(0, 0, -9.81);
  return theta;
}

TEST(SceneSimulation, RegionsHaveAModulusEach) {
  Scene scene = bar();
  EXPECT_EQ(body_of(scene).modulus.controls, 1);
  scene.regions = {{"far", RegionHalfSpace{Vector3::Zero(), Vector3::UnitX()}}};
  EXPECT_EQ(body_of(scene).modulus.controls, 2);
  EXPECT_TRUE(region_tests(scene)[0](Vector3(0.01, 0, 0)));
  EXPECT_FALSE(region_tests(scene)[0](Vector3(-0.01, 0, 0)));
}

TEST(SceneSimulation, ListedVerticesHoldWhatIsAroundThem) {
  Scene scene = bar();
  scene.fixed = {{RegionVertices{{0}}, std::nullopt}};
  const Vector3 corner = scene.object.surface->vertices[0];
  const std::vector<Hold> holds = held_regions(scene);
  ASSERT_EQ(holds.size(), 1u);
  EXPECT_TRUE(holds[0].contains(corner + Vector3::Constant(1e-3)));
  EXPECT_FALSE(holds[0].contains(-corner));
}

TEST(SceneSimulation, PullsHoldOnlyWhatIsReleasedFromAnUnknownPose) {
  Scene scene = bar();
  Resolution resolution;
  resolution.pulls = 3;
  EXPECT_EQ(pull_count(scene, resolution), 0);
  scene.initial.released = true;
  EXPECT_EQ(pull_count(scene, resolution), 3);
  scene.initial.pulls = {Vector3::Zero()};
  EXPECT_EQ(pull_count(scene, resolution), 1) << "as many as are known";
  scene.initial.release_of = Weight{0.1, Vector3::Zero()};
  EXPECT_EQ(pull_count(scene, resolution), 0);
}

TEST(SceneSimulation, WeightsHangOrAreReleased) {
  Scene scene = bar();
  scene.weights = {{0.1, {0.1, 0, 0}}};
  scene.initial.release_of = Weight{0.2, {0.1, 0, 0}};
  const Body body = body_of(scene);
  EXPECT_TRUE(make_simulation(scene, body, {}, blocks, parameters()).released_weights.empty());
  scene.initial.released = true;
  const SimulationOptions s = make_simulation(scene, body, {}, blocks, parameters());
  ASSERT_EQ(s.weights.size(), 1u);
  ASSERT_EQ(s.released_weights.size(), 1u);
  EXPECT_EQ(s.released_weights[0].mass, 0.2);
}

TEST(SceneSimulation, FinerStepsAreShorter) {
  const Scene scene = bar();
  const Body body = body_of(scene);
  Resolution fine;
  fine.steps = 2.0;
  EXPECT_EQ(make_simulation(scene, body, {}, blocks, parameters()).max_dt,
            2.0 * make_simulation(scene, body, fine, blocks, parameters()).max_dt);
}

}  // namespace
}  // namespace pliant::scene_simulation_test
