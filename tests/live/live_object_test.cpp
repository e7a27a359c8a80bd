#include "live/live_object.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "live/live_page.hpp"
#include "simulation/scene_simulation.hpp"
#include "support/models.hpp"

namespace pliant::live_object_test {
namespace {

LiveObject object_of(const Model& model) { return LiveObject(decode(encode(live_data(model)))); }

double difference(const Points& a, const Points& b) { return (a - b).cwiseAbs().maxCoeff(); }

TEST(LiveData, ComesBackAsItWas) {
  for (const bool held : {false, true}) {
    Model model = test::block(held);
    model.scene.weights = {{0.1, {0.1, 0.0, 0.0}}};
    LiveData data = live_data(model);
    data.samples = {data.theta, 2.0 * data.theta};
    const std::string bytes = encode(data);
    EXPECT_EQ(encode(decode(bytes)), bytes);
    for (const std::size_t cut : {std::size_t(0), std::size_t(5), std::size_t(40), bytes.size() / 2, bytes.size() - 1})
      EXPECT_THROW((void)decode(std::string_view(bytes).substr(0, cut)), std::runtime_error) << cut;
    EXPECT_THROW((void)decode(bytes + "x"), std::runtime_error);
  }
}

/// A page moves the object as the program does.
TEST(LiveObject, StepsAsTheProgramDoes) {
  Model model = test::block(false);
  model.scene.initial.linear_velocity = Vector3(0.4, 0.5, 0.1);
  model.scene.initial.angular_velocity = Vector3(3.0, 0.0, 6.0);
  LiveObject live = object_of(model);
  live.start_as_recorded();
  Scene scene = model.scene;
  const double dt = live.step_length();
  scene.timing.times.clear();
  for (int frame = 0; frame <= 100; ++frame) scene.timing.times.push_back(frame * dt);
  const ModelScene made = make_scene(model, scene, scene_distance(scene, Resolution{}.band), {}, {.wind = true});
  double worst = 0.0, moved = 0.0;
  (void)Simulation(made.body, made.simulation).run(made.theta, [&](int frame, const State& state, auto) {
    if (frame > 0) {
      EXPECT_TRUE(live.step());
    }
    worst = std::max(worst, difference(live.state().x, state.x));
    moved = std::max(moved, difference(state.x, made.body->nodes));
    return true;
  });
  EXPECT_GT(moved, 0.05);  // it has bounced
  EXPECT_LT(worst, 1e-9 * made.body->size());
}

TEST(LiveObject, AHeldOneStartsAtRestAndStaysThere) {
  LiveObject live = object_of(test::block(true));
  const Points first = live.state().x;
  EXPECT_GT(difference(first, live.body().nodes), 1e-4);
  for (int step = 0; step < 50; ++step) ASSERT_TRUE(live.step());
  EXPECT_LT(difference(live.state().x, first), 1e-3 * difference(first, live.body().nodes));
}

/// Grabbed in mid-air, it hangs from the hand; let go, it leaves with the pull's energy.
TEST(LiveObject, IsCaughtAndLetGo) {
  Model model = test::block(false);
  model.scene.planes.clear();
  LiveObject live = object_of(model);
  live.start_as_recorded();
  for (int step = 0; step < 20; ++step) ASSERT_TRUE(live.step());
  const double falling = live.kinetic_energy();
  EXPECT_GT(falling, 0.0);
  live.grab(0, {0.3, 0.3, 0.4}, 0.03);
  const Vector3 place = live.hand().value().second;
  live.set_material(1.0, 30.0);
  for (int step = 0; step < 1500; ++step) ASSERT_TRUE(live.step());
  const double weight = 9.81 * 500.0 * live.body().volume();
  EXPECT_NEAR(live.hand_force().y(), weight, 0.15 * weight);
  EXPECT_NEAR(live.hand().value().first.y(), place.y() - 0.1 * live.body().size(), 0.03 * live.body().size());
  live.set_material(1.0, 1.0);
  live.set_gravity(Vector3::Zero());
  const Vector3 held = live.hand().value().first;
  live.move_hand(held + Vector3(0.0, 0.1, 0.0));
  ASSERT_TRUE(live.step());
  const double force = live.hand_force().norm();
  EXPECT_NEAR(force, 10.0 * weight / live.body().size() * 0.1, 0.1 * force);
  for (int step = 0; step < 5; ++step) ASSERT_TRUE(live.step());
  live.let_go();
  EXPECT_FALSE(live.hand());
  const double energy = live.kinetic_energy();
  EXPECT_GT(energy, 0.0);
  for (int step = 0; step < 5; ++step) ASSERT_TRUE(live.step());
  EXPECT_NEAR(live.kinetic_energy(), energy, 0.2 * energy);
}

TEST(LiveObject, WindRainProbeAndPushMoveIt) {
  Model model = test::block(false);
  model.scene.planes.clear();
  LiveObject live = object_of(model);
  live.set_gravity(Vector3::Zero());
  const auto moved = [&](int steps) {
    const Vector3 before = live.state().x.colwise().mean().transpose();
    for (int step = 0; step < steps; ++step) EXPECT_TRUE(live.step());
    return Vector3(live.state().x.colwise().mean().transpose() - before);
  };
  EXPECT_LT(moved(10).norm(), 1e-9);
  live.set_wind({0.0, 0.0, 15.0}, 0.0);
  EXPECT_GT(moved(50).z(), 1e-3);
  live.set_wind(Vector3::Zero(), 0.0);
  live.reset();
  live.set_rain(2e5, 0.004);
  EXPECT_LT(moved(50).y(), -1e-3);
  EXPECT_FALSE(live.drops().empty());
  live.set_rain(0.0, 0.004);
  live.reset();
  live.set_probe({0.0, 0.06, 0.0}, {0.0, 0.05, 0.0}, 0.03);
  EXPECT_LT(moved(20).y(), -2e-4);
  live.set_probe(Vector3::Zero(), Vector3::Zero(), 0.0);
  live.reset();
  live.push({1.0, 0.0, 0.0});
  EXPECT_NEAR(moved(10).x(), 10 * live.step_length(), 0.05 * 10 * live.step_length());
}

TEST(LiveObject, FieldsAreThoseOfItsElements) {
  Model model = test::block(true);
  LiveObject live = object_of(model);
  for (const float value : live.field(LiveObject::Field::Modulus)) EXPECT_NEAR(value, 2e5, 1.0);
  const std::vector<float> stress = live.field(LiveObject::Field::VonMises);
  const auto& vertices = live.data().surface.vertices;
  float at_root = 0.0f, at_tip = 0.0f;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (std::abs(vertices[v].x() + 0.05) < 0.02) at_root = std::max(at_root, stress[v]);
    if (vertices[v].x() > 0.09) at_tip = std::max(at_tip, stress[v]);
  }
  EXPECT_GT(at_root, 3.0f * at_tip);
  for (const float value : live.field(LiveObject::Field::Displacement)) EXPECT_LT(value, 0.1f);
}

TEST(LiveObject, SamplesOfThePosteriorReplaceTheEstimate) {
  LiveData data = live_data(test::block(true));
  VectorX soft = data.theta;
  soft[live_blocks(data.planes).youngs_moduli[0]] *= 0.5;
  data.samples = {soft};
  LiveObject live(std::move(data));
  live.set_sample(0);
  EXPECT_NEAR(live.field(LiveObject::Field::Modulus).front(), 1e5, 1.0);
  live.set_sample(-1);
  EXPECT_NEAR(live.field(LiveObject::Field::Modulus).front(), 2e5, 1.0);
}

}  // namespace
}  // namespace pliant::live_object_test
