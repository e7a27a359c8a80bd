#include "situation/situation.hpp"

#include <fstream>

#include "input_errors.hpp"
#include "situation/situation_scene.hpp"
#include "support/models.hpp"
#include "temporary_folder.hpp"

namespace pliant::situation_test {
namespace {

using test::complaint_of;
using test::TemporaryFolder;
using testing::HasSubstr;

using test::block;
constexpr double edge = test::block_edge;

struct Folder : TemporaryFolder {
  Situation read(const std::string& text) const {
    const auto file = path() / "situation.toml";
    std::ofstream(file) << "format = \"situation/1\"\n" << text;
    return read_situation(file);
  }
};

struct Motion {
  std::vector<State> states;
  std::shared_ptr<const Body> body;
  Vector3 middle(std::size_t frame) const { return states[frame].x.colwise().mean().transpose(); }
};
Motion run(const Model& model, const Situation& situation, int copy = 0) {
  const SituationScene scene = make_scene(model, situation, copy);
  Motion motion{{}, scene.body};
  Simulation simulation(scene.body, scene.simulation);
  const RolloutSummary summary = simulation.run(scene.theta, [&](int, const State& state, auto) {
    motion.states.push_back(state);
    return true;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return motion;
}

TEST(Situation, ReadsEverything) {
  const Folder folder;
  const Situation s = folder.read(R"(
duration = 2.5
frame_rate = 40
held = false
gravity = [ { time = 0, value = [0, -9.81, 0] }, { time = 1, value = [0, 0, -9.81] } ]
[initial]
shift = [0, 0.2, 0]
turn_deg = [0, 0, 90]
linear_velocity = [1, 2, 3]
[[plane]]
point = [0, 0, 0]
normal = [0, 1, 0]
friction = 0.4
[wind]
velocity = [3, 0, 0]
gusts = { intensity = 0.3, length = 2, seed = 5 }
[[rain]]
rate = 500
diameter = 0.004
[[force]]
at = [0.1, 0, 0]
radius = 0.02
over_time = [ { time = 0, force = [0, 0, 0] }, { time = 1, force = [0, 1, 0] } ]
[[hand]]
at = [-0.1, 0, 0]
from = 0.5
until = 1.0
path = [ { time = 0.5, at = [-0.1, 0.2, 0] } ]
[[led]]
box = { min = [-1, -1, -1], max = [-0.05, 1, 1] }
motion = [ { time = 0, shift = [0, 0, 0] }, { time = 1, shift = [0, 0.1, 0], turn_deg = [0, 90, 0] } ]
[[obstacle]]
ball = { centre = [0, -0.2, 0], radius = 0.1 }
friction = 0.3
[[copy]]
shift = [0.5, 0, 0]
delay = 3
)");
  EXPECT_EQ(s.duration, 2.5);
  EXPECT_FALSE(s.keeps_held);
  ASSERT_EQ(s.gravity.size(), 2u);
  EXPECT_NEAR((s.pose.rotation * Vector3::UnitX() - Vector3::UnitY()).norm(), 0.0, 1e-12);
  EXPECT_EQ(s.planes.value().front().friction, 0.4);
  EXPECT_EQ(s.wind.value().seed, 5u);
  EXPECT_EQ(s.rains.at(0).until, 2.5);
  EXPECT_EQ(s.forces.at(0).force.at(1).value, Vector3(0, 1, 0));
  EXPECT_EQ(s.hands.at(0).until, 1.0);
  EXPECT_NEAR(s.led.at(0).motion.at(1).value[4], 1.5707963, 1e-6);
  EXPECT_EQ(std::get<ShapeBall>(s.obstacles.value().at(0).shape).radius, 0.1);
  EXPECT_EQ(s.copies.at(0).delay, 3.0);
}

TEST(Situation, EveryMistakeIsNamedWithItsPlace) {
  const Folder folder;
  const std::string said = complaint_of([&] {
    (void)folder.read(R"(duration = -1
[wind]
speed = 3
[[hand]]
at = [0, 0]
from = 2
until = 1
[[obstacle]]
friction = 0.2
[[led]]
box = { min = [0, 0, 0], max = [1, 1, 1] }
motion = [ { time = 1 }, { time = 0 } ]
)");
  });
  for (const char* part : {"situation.toml:2", "duration", "velocity", "speed", "a hand without", "three numbers",
                           "`until` is 1 s", "`motion` and `path`", "of 0 shapes", "times that increase"})
    EXPECT_THAT(said, HasSubstr(part));
}

TEST(Situation, AFreeObjectFallsFromItsPose) {
  const Folder folder;
  const Motion fall = run(block(false), folder.read("duration = 0.1\nframe_rate = 100\n[initial]\nshift = [0.3, 2, "
                                                    "0]\nturn_deg = [0, 0, 90]\nlinear_velocity = [1, 0, 0]\n"));
  ASSERT_EQ(fall.states.size(), 11u);
  EXPECT_LT((fall.middle(0) - Vector3(0.3, 2.0, 0.0)).norm(), 1e-12);
  const Vector3 extent = fall.states[0].x.colwise().maxCoeff() - fall.states[0].x.colwise().minCoeff();
  EXPECT_NEAR(extent.y(), 0.2, 1e-9);
  const double decay = 0.5, t = 0.1;  // v' = g - decay v, from rest and from 1 m/s
  EXPECT_NEAR(fall.middle(10).x(), 0.3 + (1.0 - std::exp(-decay * t)) / decay, 1e-5);
  EXPECT_NEAR(fall.middle(10).y(), 2.0 - 9.81 / decay * (t - (1.0 - std::exp(-decay * t)) / decay), 1e-4);
}

TEST(Situation, AHeldObjectStartsSettled) {
  const Folder folder;
  const Motion still = run(block(true), folder.read("duration = 0.2\n"));
  const double sag = (still.states.front().x - still.body->nodes).cwiseAbs().maxCoeff();
  EXPECT_GT(sag, 1e-4);
  EXPECT_LT((still.states.back().x - still.states.front().x).cwiseAbs().maxCoeff(), 1e-3 * sag);
  const std::string said =
      complaint_of([&] { (void)make_scene(block(true), folder.read("[initial]\nshift = [0, 1, 0]\n")); });
  EXPECT_THAT(said, HasSubstr("held"));
}

TEST(Situation, WindCarriesAway) {
  const Folder folder;
  const std::string text =
      "duration = 0.4\nframe_rate = 50\ngravity = [ { time = 0, value = [0, 0, 0] } ]\n[initial]\nshift = [0, 1, 0]\n";
  const Motion calm = run(block(false), folder.read(text));
  const Motion windy = run(block(false), folder.read(text + "[wind]\nvelocity = [0, 0, 10]\n"));
  EXPECT_LT((calm.middle(20) - calm.middle(0)).norm(), 1e-12);
  // 0.5 rho C A v^2 / m on the long side for 0.4 s, nearly at rest.
  const double a = 0.5 * 1.2 * 1.2 * 0.2 * edge * 100.0 / (500.0 * windy.body->volume());
  EXPECT_NEAR(windy.middle(20).z(), 0.5 * a * 0.16, 0.15 * 0.5 * a * 0.16);
}

TEST(Situation, GravityTurns) {
  const Folder folder;
  const Motion turned =
      run(block(false), folder.read("duration = 0.4\nframe_rate = 50\ngravity = [ { time = 0, value = [0, 0, 0] }, { "
                                    "time = 0.2, value = [0, 0, 5] } ]\n[initial]\nshift = [0, 5, 0]\n"));
  // The cubic's mean is a half: v(0.2) = 0.5, then 5 m/s^2, less mass damping.
  EXPECT_NEAR(turned.states[20].v.col(2).mean(), 1.5, 0.2);
  EXPECT_LT(std::abs(turned.states[20].v.col(1).mean()), 1e-5);  // the solver's tolerance
}

/// A hand lifts the block off the floor, a led region turns it, a ball pushes it aside.
TEST(Situation, HandsRegionsAndObstaclesMoveTheObject) {
  const Folder folder;
  const Motion lifted = run(block(false), folder.read(R"(
duration = 1.0
[[hand]]
at = [0, 0.025, 0]
radius = 0.05
stiffness = 400
motion = [ { time = 0.1, shift = [0, 0, 0] }, { time = 0.7, shift = [0, 0.3, 0] } ]
)"));
  EXPECT_NEAR(lifted.middle(30).y(), 0.3 - 0.25 * 9.81 / 400.0, 0.02);
  const Motion led = run(block(true), folder.read(R"(
held = false
duration = 0.6
[[led]]
box = { min = [-0.2, -0.2, -0.2], max = [-0.05, 0.2, 0.2] }
motion = [ { time = 0, shift = [0, 0, 0] }, { time = 0.5, shift = [0, 0.2, 0], turn_deg = [0, 90, 0] } ]
)"));
  EXPECT_NEAR(led.states.back().x.col(2).minCoeff(), -0.19, 0.03);  // what pointed along x points along -z
  EXPECT_NEAR(led.middle(led.states.size() - 1).y(), 0.2, 0.05);
  const Motion pushed = run(block(false), folder.read(R"(
duration = 0.5
gravity = [ { time = 0, value = [0, 0, 0] } ]
[[obstacle]]
ball = { centre = [0, 0, -0.2], radius = 0.1 }
motion = [ { time = 0, shift = [0, 0, 0] }, { time = 0.4, shift = [0, 0, 0.2] } ]
)"));
  EXPECT_GT(pushed.middle(pushed.states.size() - 1).z(), 0.1);
}

TEST(Situation, PlacesBesideTheObjectAreRefused) {
  const Folder folder;
  for (const char* text :
       {"[[hand]]\nat = [3, 0, 0]\nmotion = [ { time = 0 } ]\n", "[[force]]\nat = [3, 0, 0]\nforce = [0, 1, 0]\n",
        "[[led]]\nsphere = { centre = [3, 0, 0], radius = 0.1 }\n"}) {
    const std::string said = complaint_of([&] { (void)make_scene(block(false), folder.read(text)); });
    EXPECT_THAT(said, HasSubstr("surface.ply")) << text;
  }
}

}  // namespace
}  // namespace pliant::situation_test
