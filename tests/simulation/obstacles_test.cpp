#include "simulation/obstacles.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.hpp"
#include "geometry/primitives.hpp"
#include "scene/obstacle.hpp"
#include "simulation/inner_bodies.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant::obstacles_test {
namespace {

/// A block about the origin whose lower side is 2 cm above the ground, at 50 Hz.
Scene block(int frames) {
  Scene scene;
  scene.object.surface = make_box(Vector3(0.12, 0.06, 0.06), 0.02);
  for (Vector3& v : scene.object.surface->vertices) v.y() += 0.05;
  scene.world.gravity = Vector3(0.0, -9.81, 0.0);
  scene.timing = evenly_timed(50.0, frames);
  return scene;
}

struct Motion {
  std::shared_ptr<const Body> body;
  std::vector<State> states;
  Vector3 middle(std::size_t frame) const { return states[frame].x.colwise().mean().transpose(); }
};

Motion run(const Scene& scene, ElementKind element = ElementKind::Hexahedron, double youngs_modulus = 3e4) {
  Resolution resolution;
  resolution.element = element, resolution.cells = 6.0;
  std::vector<Vector3> controls;
  Motion made;
  made.body = make_body_of(scene, *scene_distance(scene, resolution.band), resolution, controls);
  const MotionLayout blocks(load_counts(scene));
  VectorX theta = blocks.zero();
  blocks.set_moduli(theta, youngs_modulus);
  theta[blocks.poissons_ratio] = 0.3, theta[blocks.density] = 200.0;
  theta[blocks.mass_damping] = 2.0, theta[blocks.stiffness_damping] = 2e-3;
  theta.segment<3>(blocks.gravity) = *scene.world.gravity;
  theta.segment<3>(blocks.linear_velocity) = scene.initial.linear_velocity;
  set_obstacles(scene, blocks, theta);
  Simulation simulation(made.body, make_simulation(scene, *made.body, resolution, blocks, theta));
  const RolloutSummary summary = simulation.run(theta, [&](int, const State& state, auto) {
    made.states.push_back(state);
    return true;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return made;
}

KeyFrames<6>::Key key(double time, const Vector3& shift, const Vector3& turn) {
  KeyFrames<6>::Key key{time, {}};
  key.value << shift, turn;
  return key;
}

double farthest(const Motion& a, const Motion& b) {
  double farthest = 0.0;
  for (std::size_t k = 0; k < a.states.size(); ++k)
    farthest = std::max(farthest, (a.states[k].x - b.states[k].x).rowwise().norm().maxCoeff());
  return farthest;
}

/// What a table's top, a half-space and a plane are to what falls on them is the same, friction included.
TEST(SceneObstacles, ATableIsAPlaneToWhatFallsOnIt) {
  Scene scene = block(16);
  scene.initial.linear_velocity = Vector3(0.4, 0.0, 0.0);
  Scene on_table = scene, on_half_space = scene;
  scene.planes = {{Vector3::Zero(), Vector3::UnitY(), true, 0.3}};
  on_table.obstacles = {{ShapeBox{{-1, -1, -1}, {1, 0, 1}}, 0.3}};
  on_half_space.obstacles = {{ShapePlane{Vector3::Zero(), Vector3::UnitY()}, 0.3}};
  const Motion plane = run(scene);
  EXPECT_LT(plane.states.back().x.col(1).minCoeff(), 0.01) << "it came down";
  EXPECT_LT(farthest(plane, run(on_table)), 1e-9);
  EXPECT_LT(farthest(plane, run(on_half_space)), 1e-9);
  on_table.obstacles.front().friction = 0.0;
  EXPECT_GT(farthest(plane, run(on_table)), 1e-3) << "a smooth table lets it slide";
}

/// A moving table carries what lies on it, and a mesh of it does as well as the box.
TEST(SceneObstacles, ATableThatRisesCarriesTheObject) {
  Scene scene = block(51);
  RigidObstacle table{ShapeBox{{-0.2, -0.2, -0.2}, {0.2, 0.02, 0.2}}, 0.5};
  table.motion = {key(0.0, {0, 0, 0}, {0, 0, 0}), key(0.6, {0.03, 0.1, 0}, {0, 0, 0})};
  scene.obstacles = {table};
  const Motion by_box = run(scene);
  EXPECT_NEAR(by_box.middle(50).y() - by_box.middle(0).y(), 0.1, 0.004);
  EXPECT_NEAR(by_box.middle(50).x() - by_box.middle(0).x(), 0.03, 0.004) << "it rubs";
  scene.obstacles.front().shape = ShapeMesh{{}, surface_of(table)};
  EXPECT_LT(farthest(by_box, run(scene)), 0.004);
}

/// Whatever the elements are and however stiff they are, a led region goes where it is led and takes the rest along.
TEST(SceneObstacles, ALedRegionGoesWhereItIsLed) {
  Scene scene = block(51);
  scene.world.gravity = Vector3::Zero();
  const Vector3 shift(0.02, 0.03, -0.01), turn(0.0, 0.4, 0.3);
  scene.led = {{RegionBox{{-1, -1, -1}, {-0.04, 1, 1}},
                -infinite,
                infinite,
                {key(0.0, {0, 0, 0}, {0, 0, 0}), key(0.4, shift, turn)}}};
  for (const auto& [element, modulus] : {std::pair{ElementKind::Hexahedron, 3e4},
                                         {ElementKind::Hexahedron, 3e6},
                                         {ElementKind::QuadraticTetrahedron, 3e4}}) {
    const Motion led = run(scene, element, modulus);
    const std::vector<int> nodes =
        held_nodes(*led.body, held_regions({{scene.led[0].region, std::nullopt}}, *scene.object.surface));
    const RigidMotion there = motion_of(scene.led[0], *scene.object.surface).at(1.0);
    for (const int node : nodes)
      EXPECT_LT((led.states.back().x.row(node).transpose() - there(led.body->nodes.row(node).transpose())).norm(),
                1e-3);
    for (Eigen::Index n = 0; n < led.body->nodes.rows(); ++n)  // damped, and at rest again
      EXPECT_LT((led.states.back().x.row(n).transpose() - there(led.body->nodes.row(n).transpose())).norm(), 4e-3);
  }
}

/// Rods that are thinner than an element catch the object: no part of it passes between samples.
TEST(SceneObstacles, ThinRodsCatchTheObject) {
  Scene scene = block(26);
  scene.obstacles = {{ShapeCapsule{{-0.04, 0.0, -0.2}, {-0.04, 0.0, 0.2}, 0.006}},
                     {ShapeCapsule{{0.04, 0.0, -0.2}, {0.04, 0.0, 0.2}, 0.006}}};
  EXPECT_GT(run(scene).middle(25).y(), 0.02);
}

/// A clamp that stays where it is holds a bar as a fixed region does: it sags as far.
TEST(SceneObstacles, ALedRegionThatStaysIsAFixedOne) {
  for (const ElementKind element : {ElementKind::Hexahedron, ElementKind::QuadraticTetrahedron}) {
    Scene scene = block(2);
    scene.timing.is_static = true;
    const RegionBox end{{-1, -1, -1}, {-0.031, 1, 1}};  // within a cell
    Scene led = scene;
    scene.fixed = {{end, std::nullopt}}, led.led = {{end}};
    const Motion by_fixed = run(scene, element), by_led = run(led, element);
    const auto sag = [](const Motion& m) { return (m.body->nodes - m.states.back().x).col(1).maxCoeff(); };
    EXPECT_GT(sag(by_fixed), 2e-4);
    EXPECT_NEAR(sag(by_led), sag(by_fixed), 0.05 * sag(by_fixed)) << int(element);
  }
}

TEST(SceneObstacles, AClampTakesHoldAndLetsGo) {
  Scene scene = block(26);
  scene.led = {{RegionBox{{-1, -1, -1}, {1, 1, 1}}, -infinite, 0.2}};
  const Motion held = run(scene);
  EXPECT_LT((held.middle(10) - held.middle(0)).norm(), 1e-3);
  // A fall that mass damping of 2/s slows.
  EXPECT_NEAR(held.middle(20).y() - held.middle(10).y(), -9.81 / 2.0 * (0.2 - 0.5 * (1.0 - std::exp(-0.4))), 2e-3);
}

/// An object that is glued to a rigid body hangs from it; one that slides on a body lies on it.
TEST(SceneObstacles, RigidBodiesCarryWhatMoves) {
  for (const ElementKind element : {ElementKind::Hexahedron, ElementKind::QuadraticTetrahedron})
    for (const auto contact : {InnerBody::Contact::Glued, InnerBody::Contact::Sliding}) {
      Scene scene = block(31);
      TriangleMesh table = make_box(Vector3(0.3, 0.1, 0.3), 0.05);
      for (Vector3& v : table.vertices) v.y() -= 0.03;  // its top is the object's lower side
      scene.inner = {{table, {}, contact}};
      const Motion lying = run(scene, element);
      EXPECT_NEAR(lying.middle(30).y(), lying.middle(0).y(), 2e-3);
      EXPECT_GT(lying.states.back().x.col(1).minCoeff(), lying.states.front().x.col(1).minCoeff() - 1e-3);
      scene.world.gravity = Vector3(0.0, 9.81, 0.0);  // upside down
      const Motion hanging = run(scene, element);
      const double way = hanging.middle(30).y() - hanging.middle(0).y();
      EXPECT_TRUE(contact == InnerBody::Contact::Glued ? way < 3e-3 : way > 0.3) << way;
    }
}

TEST(SceneObstacles, ALedRegionHoldsAPartOfTheObject) {
  Scene scene = block(3);
  scene.led = {{RegionBox{{2, 2, 2}, {3, 3, 3}}}};
  EXPECT_THROW((void)run(scene), InputError);
}

}  // namespace
}  // namespace pliant::obstacles_test
