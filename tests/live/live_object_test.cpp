#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "elasticity/sampled_law.hpp"
#include "live/live_motion.hpp"
#include "live/live_page.hpp"
#include "live/live_press.hpp"
#include "motion/fixed_regions.hpp"
#include "simulation/law_table.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/scene_simulation.hpp"
#include "support/models.hpp"

namespace pliant::live_object_test {
namespace {

LiveMotion object_of(const Model& model) { return LiveMotion(decode(encode(live_data(model)))); }
LivePress press_of(const Model& model) { return LivePress(decode(encode(live_data(model)))); }

/// The triangle of the surface whose middle is nearest.
int triangle_at(const LiveObject& live, const Vector3& place) {
  const TriangleMesh& surface = live.data().surface;
  int best = 0;
  double least = infinite;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    Vector3 middle = Vector3::Zero();
    for (const int v : surface.triangles[t]) middle += surface.vertices[std::size_t(v)] / 3.0;
    if ((middle - place).norm() < least) least = (middle - place).norm(), best = int(t);
  }
  return best;
}

double difference(const Points& a, const Points& b) { return (a - b).cwiseAbs().maxCoeff(); }

TEST(LiveData, ComesBackAsItWas) {
  for (const bool held : {false, true}) {
    Model model = test::block(held);
    model.scene.weights = {{0.1, {0.1, 0.0, 0.0}}};
    LiveData data = live_data(model);
    data.samples = {{data.theta, {}}, {2.0 * data.theta, {}}};
    const std::string bytes = encode(data);
    EXPECT_EQ(encode(decode(bytes)), bytes);
    for (const std::size_t cut : {std::size_t(0), std::size_t(5), std::size_t(40), bytes.size() / 2, bytes.size() - 1})
      EXPECT_THROW((void)decode(std::string_view(bytes).substr(0, cut)), std::runtime_error) << cut;
    EXPECT_THROW((void)decode(bytes + "x"), std::runtime_error);
  }
}

TEST(LiveData, LawsComeBackToo) {
  LiveData data = live_data(test::pressed_block());
  ASSERT_TRUE(data.is_pressed);
  data.tests = {{{0.05, 0.025, 0.0}, 0.01, {0.0, -1.0, 0.0}}};
  const int elements = data.material.law()->element_count();
  const MatrixX numbers = Eigen::RowVector2d(3.0, 1.0).replicate(elements, 1);
  data.samples = {{data.theta, std::make_shared<LinearLaw>(numbers)},
                  {data.theta, std::make_shared<NeoHookeanLaw>(numbers)},
                  {data.theta, std::make_shared<SampledLaw>(std::make_shared<LinearLaw>(numbers),
                                                            std::vector<StressSamples>(std::size_t(elements)))}};
  const std::string bytes = encode(data);
  EXPECT_EQ(encode(decode(bytes)), bytes);
  const LiveData back = decode(bytes);
  EXPECT_EQ(back.material.law()->name(), "ogden");
  EXPECT_EQ(back.samples[0].law->name(), "linear");
  EXPECT_EQ(back.samples[1].law->name(), "neo_hookean");
  EXPECT_EQ(back.samples[2].law->name(), "sampled");
  EXPECT_NEAR(back.material.law()->small_strain(3).youngs_modulus, data.material.law()->small_strain(3).youngs_modulus,
              1e-6);
  data.material.elastic = std::make_shared<LinearLaw>(numbers.topRows(2));
  EXPECT_THROW(LivePress(decode(encode(data))), std::runtime_error) << "a law of another number of elements";
}

/// A page moves the object as the program does.
TEST(LiveObject, StepsAsTheProgramDoes) {
  Model model = test::block(false);
  model.scene.initial.linear_velocity = Vector3(0.4, 0.5, 0.1);
  model.scene.initial.angular_velocity = Vector3(3.0, 0.0, 6.0);
  LiveMotion live = object_of(model);
  live.start_as_recorded();
  Scene scene = model.scene;
  const double dt = live.step_length();
  scene.timing.times.clear();
  for (int frame = 0; frame <= 100; ++frame) scene.timing.times.push_back(frame * dt);
  const ModelScene made = make_scene(model, scene, scene_distance(scene, Resolution{}.band), {}, true);
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

/// Longer steps for a page that shall keep up with time: much the same bounce, and the program's own steps again
/// afterwards.
TEST(LiveObject, LongerStepsMoveItMuchTheSame) {
  Model model = test::block(false);
  model.scene.initial.linear_velocity = Vector3(0.4, 0.5, 0.1);
  const auto middle_after = [&](double pace) {
    LiveMotion live = object_of(model);
    live.start_as_recorded();
    live.set_pace(pace);
    EXPECT_NEAR(live.step_length(), pace * object_of(model).step_length(), 1e-12);
    while (live.time() < 0.4 - 1e-9) EXPECT_TRUE(live.step());
    return Vector3(live.state().x.colwise().mean().transpose());
  };
  const Vector3 fine = middle_after(1.0);
  const double way = (fine - object_of(model).body().centre_of_mass()).norm();
  EXPECT_GT(way, 0.1);
  EXPECT_LT((middle_after(2.0) - fine).norm(), 0.1 * way);
  EXPECT_THROW(object_of(model).set_pace(0.5), std::invalid_argument);
}

TEST(LiveObject, AHeldOneStartsAtRestAndStaysThere) {
  LiveMotion live = object_of(test::block(true));
  const Points first = live.state().x;
  EXPECT_GT(difference(first, live.body().nodes), 1e-4);
  for (int step = 0; step < 50; ++step) ASSERT_TRUE(live.step());
  EXPECT_LT(difference(live.state().x, first), 1e-3 * difference(first, live.body().nodes));
}

/// Grabbed in mid-air, it hangs from the hand; let go, it leaves with the pull's energy.
TEST(LiveObject, IsCaughtAndLetGo) {
  Model model = test::block(false);
  model.scene.planes.clear();
  LiveMotion live = object_of(model);
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
  LiveMotion live = object_of(model);
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
  const int top = triangle_at(live, {0.0, 0.025, 0.0});
  for (const LiveProbe kind : {LiveProbe::Ball, LiveProbe::Disc, LiveProbe::Capsule, LiveProbe::BondedDisc}) {
    live.touch(kind, top, {0.3, 0.3, 0.4}, 0.02, {0.0, 0.0, 0.02});
    live.move_probe({0.0, -0.005, 0.0});
    EXPECT_LT(moved(20).y(), -2e-4) << int(kind);
    live.lift();
    live.reset();
  }
  live.reset();
  live.push({1.0, 0.0, 0.0});
  EXPECT_NEAR(moved(10).x(), 10 * live.step_length(), 0.05 * 10 * live.step_length());
}

TEST(LiveObject, FieldsAreThoseOfItsElements) {
  Model model = test::block(true);
  LiveMotion live = object_of(model);
  for (const float value : live.field(LiveField::Modulus)) EXPECT_NEAR(value, 2e5, 1.0);
  const std::vector<float> stress = live.field(LiveField::VonMises);
  for (const float value : stress) ASSERT_TRUE(std::isfinite(value));
  const auto& vertices = live.data().surface.vertices;
  float at_root = 0.0f, at_tip = 0.0f;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (std::abs(vertices[v].x() + 0.05) < 0.02) at_root = std::max(at_root, stress[v]);
    if (vertices[v].x() > 0.09) at_tip = std::max(at_tip, stress[v]);
  }
  EXPECT_GT(at_root, 3.0f * at_tip);
  for (const float value : live.field(LiveField::Displacement)) EXPECT_LT(value, 0.1f);
}

TEST(LiveObject, SamplesOfThePosteriorReplaceTheEstimate) {
  LiveData data = live_data(test::block(true));
  VectorX soft = data.theta;
  soft[live_blocks(data.planes).youngs_moduli[0]] *= 0.5;
  data.samples = {{soft, {}}};
  LiveMotion live(std::move(data));
  live.set_sample(0);
  EXPECT_NEAR(live.field(LiveField::Modulus).front(), 1e5, 1.0);
  live.set_sample(-1);
  EXPECT_NEAR(live.field(LiveField::Modulus).front(), 2e5, 1.0);
}

constexpr int most_equilibria = 100;

void settle(LivePress& live) {
  for (int i = 0; i < most_equilibria && !live.is_settled(); ++i) ASSERT_TRUE(live.step());
  ASSERT_TRUE(live.is_settled());
}

/// What a page finds is what `pliant press` finds.
TEST(LivePress, FindsTheEquilibriaOfTheProgram) {
  const Model model = test::pressed_block();
  LivePress live = press_of(model);
  const int top = triangle_at(live, {0.06, 0.025, 0.0});
  live.touch(LiveProbe::Ball, top, {1.0 / 3, 1.0 / 3, 1.0 / 3}, 0.02, Vector3::Zero());
  live.move_probe({0.0, -0.008, 0.0});
  settle(live);
  EXPECT_LT((live.probe_way() - Vector3(0.0, -0.008, 0.0)).norm(), 1e-12);
  const auto body = model_body(model);
  Vector3 at = Vector3::Zero();
  for (const int v : live.data().surface.triangles[std::size_t(top)])
    at += live.data().surface.vertices[std::size_t(v)] / 3.0;
  ProbeOptions probe{ProbeKind::Ball, at, 0.02, Vector3(0.0, -1.0, 0.0)};
  PressSession session(body, law_of(model, *body), probe, {held_nodes(*body, held_regions(model.scene)), {}});
  ASSERT_TRUE(session.move_to({0.0, -0.008, 0.0}).converged);
  EXPECT_LT(session.force().y(), -0.05);
  EXPECT_LT((live.probe_force() - session.force()).norm(), 1e-4 * session.force().norm());
  EXPECT_LT(difference(live.nodes(), session.nodes()), 1e-5 * body->size());
  live.lift();
  EXPECT_LT(difference(live.nodes(), body->nodes), 1e-6 * body->size()) << "it comes back";
  EXPECT_EQ(live.probe_force(), Vector3(Vector3::Zero()));
}

TEST(LivePress, IsPulledByTheHandAndComesBack) {
  LivePress live = press_of(test::pressed_block());
  live.grab(triangle_at(live, {0.1, 0.0, 0.0}), {0.3, 0.3, 0.4}, 0.015);
  const Vector3 place = live.hand().value().second;
  live.move_hand(place + Vector3(0.0, 0.03, 0.0));
  settle(live);
  EXPECT_GT(live.hand_force().y(), 0.01);
  EXPECT_LT((live.hand().value().first - live.hand().value().second).norm(), 1e-9);
  const double pull = live.hand_force().norm();
  live.set_material(2.0, 1.0);
  settle(live);
  EXPECT_NEAR(live.hand_force().norm(), 2.0 * pull, 0.01 * pull) << "twice as stiff";
  live.let_go();
  EXPECT_FALSE(live.hand());
  EXPECT_LT(difference(live.nodes(), live.body().nodes), 1e-6 * live.body().size());
}

TEST(LivePress, PressesAsRecorded) {
  LiveData data = live_data(test::pressed_block());
  const Vector3 force(0.3, -2.0, 0.1);
  data.tests = {{{0.06, 0.025, 0.0}, 0.015, force}};
  LivePress live(std::move(data));
  live.press_as_recorded(0);
  settle(live);
  EXPECT_LT((live.probe_force() - force).norm(), 1e-4 * force.norm());
  EXPECT_LT(live.probe_way().y(), -1e-4);
  EXPECT_THROW(live.press_as_recorded(1), std::out_of_range);
}

TEST(LivePress, WhereNothingIsFoundItStays) {
  LiveData data = live_data(test::pressed_block());
  data.tests = {{{0.06, 0.025, 0.0}, 0.015, {0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}}};
  LivePress live(std::move(data));
  live.press_as_recorded(0);
  bool is_found = true;
  for (int i = 0; i < most_equilibria && !live.is_settled(); ++i) is_found = live.step();
  EXPECT_FALSE(is_found);
  EXPECT_TRUE(live.is_settled());
  EXPECT_TRUE(live.nodes().allFinite());
  live.lift();
  EXPECT_LT(difference(live.nodes(), live.body().nodes), 1e-6 * live.body().size());
  EXPECT_TRUE(live.step());
}

TEST(LivePress, GravitySagsIt) {
  Model model = test::pressed_block();
  model.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
  LivePress live = press_of(model);
  const Points sagging = live.nodes();
  EXPECT_LT(sagging.col(1).mean(), live.body().nodes.col(1).mean() - 1e-5);
  live.set_gravity(Vector3::Zero());
  settle(live);
  EXPECT_LT(difference(live.nodes(), live.body().nodes), 1e-6 * live.body().size());
  live.set_gravity({0.0, -9.81, 0.0});
  settle(live);
  EXPECT_LT(difference(live.nodes(), sagging), 1e-5 * live.body().size());
}

TEST(LivePress, FieldsTellDeviationAndStiffening) {
  LivePress live = press_of(test::pressed_block());
  const double rest = live.law()->small_strain(0).youngs_modulus;
  for (const float value : live.field(LiveField::Deviation)) EXPECT_NEAR(value, 0.1 * rest, 1e-3 * rest);
  for (const float value : live.field(LiveField::ModulusAtStrain)) EXPECT_NEAR(value, rest, 1e-3 * rest);
  live.grab(triangle_at(live, {0.1, 0.0, 0.0}), {0.3, 0.3, 0.4}, 0.03);
  live.move_hand(live.hand().value().second + Vector3(0.04, 0.0, 0.0));
  settle(live);
  const std::vector<float> stretched = live.field(LiveField::ModulusAtStrain);
  EXPECT_GT(*std::ranges::max_element(stretched), 1.3 * rest) << "an exponent of six stiffens when it is stretched";
}

TEST(LivePress, SamplesHaveTheirOwnLaw) {
  LiveData data = live_data(test::pressed_block());
  data.samples = {{data.theta, scaled_law(data.material.law(), 0.5)}};
  LivePress live(std::move(data));
  const double E = live.law()->small_strain(0).youngs_modulus;
  live.set_sample(0);
  EXPECT_NEAR(live.law()->small_strain(0).youngs_modulus, 0.5 * E, 1e-9 * E);
  live.set_sample(-1);
  EXPECT_NEAR(live.law()->small_strain(0).youngs_modulus, E, 1e-9 * E);
}

}  // namespace
}  // namespace pliant::live_object_test
