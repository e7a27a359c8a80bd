#include "batch_motion/motion_batch.hpp"

#include <functional>
#include <stdexcept>

#include "batch_scenes.hpp"
#include "support/tolerance.hpp"

namespace pliant::motion_batch_test {
namespace {

using test::BatchScene;
using test::tolerance;

/// How far a member's motion and that of the program's own stepper are apart, in units of the way of the farthest node.
double relative_difference(const BatchScene& scene, int steps, double solver_tolerance) {
  BatchScene own = scene;
  own.options.tolerance = solver_tolerance;
  MotionBatch batch(own.body, own.options, 3);
  std::vector<BatchMember> members;
  for (int k = 0; k < 3; ++k) {
    members.push_back(own.other(3 * k));
    batch.set_member(k, members.back());
  }
  std::vector<BatchRun> runs;
  const std::vector<State> end = test::ends(batch, steps, &runs);
  double largest = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_TRUE(runs[k].succeeded);
    EXPECT_EQ(runs[k].steps, steps);
    EXPECT_GT(runs[k].solver_iterations, 0);
    const std::vector<State> truth = test::simulated(own, members[k], steps, 1e-13);
    const double way = test::farthest(truth.back().x, truth.front().x);
    const double speed = truth.back().v.rowwise().norm().maxCoeff();
    EXPECT_GT(way, 0.05 * own.body->size());
    largest = std::max(
        {largest, test::farthest(end[k].x, truth.back().x) / way, test::farthest(end[k].v, truth.back().v) / speed});
  }
  return largest;
}

// A step's error is at most about the tolerance times the condition of its matrix, some thousands; softly damped
// motions carry it along.
constexpr double steps_amplify = 1e3;

TEST(MotionBatch, HexahedraInContactMoveAsTheStepperHasThem) {
  const BatchScene torus = test::batch_torus(0.03);
  EXPECT_LT(relative_difference(torus, 40, 1e-11), tolerance(steps_amplify * 1e-11));
  EXPECT_LT(relative_difference(torus, 40, 1e-6), tolerance(steps_amplify * 1e-6));
}

TEST(MotionBatch, HexahedraFeelTheirPlane) {  // or the test above would show nothing of contact
  BatchScene torus = test::batch_torus(0.03);
  MotionBatch batch(torus.body, torus.options, 2);
  batch.set_member(0, torus.member);
  torus.member.plane_point.y() = -10.0;
  batch.set_member(1, torus.member);
  const std::vector<State> end = test::ends(batch, 40);
  EXPECT_GT(test::farthest(end[0].x, end[1].x), 0.1 * torus.body->size());
}

TEST(MotionBatch, HeldTetrahedraMoveAsTheStepperHasThem) {
  const BatchScene bar = test::batch_bar({12, 3, 3});
  EXPECT_LT(relative_difference(bar, 40, 1e-11), tolerance(steps_amplify * 1e-11));
  EXPECT_LT(relative_difference(bar, 40, 1e-6), tolerance(steps_amplify * 1e-6));
}

TEST(MotionBatch, QuadraticPenaltyActsAsTheSteppers) {
  BatchScene torus = test::batch_torus(0.04);
  torus.options.contact.onset = Penalty::Onset::Quadratic;
  torus.options.contact.smoothing = 2e-3;
  EXPECT_LT(relative_difference(torus, 30, 1e-11), tolerance(steps_amplify * 1e-11));
}

/// A member alone and beside ten others.
void expect_same_alone(const BatchScene& scene, int steps) {
  constexpr int members = 11;
  MotionBatch together(scene.body, scene.options, members);
  for (int k = 0; k < members; ++k) together.set_member(k, scene.other(k));
  std::vector<BatchRun> runs;
  const std::vector<State> all = test::ends(together, steps, &runs);
  for (const int k : {0, 5, 9, 10}) {
    MotionBatch alone(scene.body, scene.options, 1);
    alone.set_member(0, scene.other(k));
    std::vector<BatchRun> run;
    const State end = test::ends(alone, steps, &run).front();
    const auto i = std::size_t(k);
    EXPECT_EQ(end.x, all[i].x) << k;
    EXPECT_EQ(end.v, all[i].v) << k;
    EXPECT_EQ(run.front().solver_iterations, runs[i].solver_iterations) << k;
  }
  EXPECT_NE(all[0].x, all[1].x);
  EXPECT_NE(runs[0].solver_iterations, runs[10].solver_iterations);  // some were frozen while others went on
}

TEST(MotionBatch, AMemberDoesNotDependOnThoseBesideIt) {
  expect_same_alone(test::batch_torus(0.04), 20);
  expect_same_alone(test::batch_bar({8, 2, 2}), 20);
}

TEST(MotionBatch, RunsAgainAlike) {
  const BatchScene torus = test::batch_torus(0.05);
  MotionBatch batch(torus.body, torus.options, 2);
  for (int k = 0; k < 2; ++k) batch.set_member(k, torus.other(k));
  const std::vector<State> first = test::ends(batch, 15), again = test::ends(batch, 15);
  EXPECT_EQ(first[1].x, again[1].x);
}

TEST(MotionBatch, AMemberThatFailsStaysWhereItIsAndLeavesOthersAlone) {
  BatchScene bar = test::batch_bar({8, 2, 2});
  bar.options.max_iterations = 60;
  MotionBatch batch(bar.body, bar.options, 2);
  batch.set_member(0, bar.member);
  BatchMember stiff = bar.member;
  stiff.youngs_modulus = 1e12;
  batch.set_member(1, stiff);
  std::vector<BatchRun> runs;
  const std::vector<State> end = test::ends(batch, 5, &runs);
  EXPECT_TRUE(runs[0].succeeded);
  EXPECT_FALSE(runs[1].succeeded);
  EXPECT_EQ(runs[1].steps, 0);
  EXPECT_EQ(end[1].x, stiff.start.x);
  MotionBatch alone(bar.body, bar.options, 1);
  alone.set_member(0, bar.member);
  EXPECT_EQ(test::ends(alone, 5).front().x, end[0].x);
}

TEST(MotionBatch, FreeFallIsExact) {
  for (const bool is_torus : {true, false}) {
    BatchScene scene = is_torus ? test::batch_torus(0.05) : test::batch_bar({4, 2, 2});
    scene.options.held.clear();
    scene.options.with_plane = false;
    scene.options.newmark_theta = 0.5;
    scene.options.tolerance = 1e-12;
    scene.member.mass_damping = 0.0;
    const Vector3 v(0.3, 1.0, -0.2);
    scene.member.start.v = Points::Zero(scene.body->node_count(), 3).rowwise() + v.transpose();
    MotionBatch batch(scene.body, scene.options, 1);
    batch.set_member(0, scene.member);
    constexpr int steps = 30;
    const State end = test::ends(batch, steps).front();
    const double t = steps * scene.options.dt;
    const Vector3 way = t * v + 0.5 * t * t * scene.member.gravity, speed = v + t * scene.member.gravity;
    EXPECT_LT(test::farthest(end.x, scene.member.start.x.rowwise() + way.transpose()), tolerance(1e-10) * way.norm());
    EXPECT_LT((end.v.rowwise() - speed.transpose()).rowwise().norm().maxCoeff(), tolerance(1e-10) * speed.norm());
  }
}

TEST(MotionBatch, RelativeModuliScaleElements) {
  BatchScene bar = test::batch_bar({8, 2, 2});
  bar.options.relative_moduli.assign(std::size_t(bar.body->element_count()), 2.0);
  MotionBatch doubled(bar.body, bar.options, 1);
  doubled.set_member(0, bar.member);
  bar.options.relative_moduli.clear();
  MotionBatch plain(bar.body, bar.options, 1);
  bar.member.youngs_modulus *= 2.0;
  plain.set_member(0, bar.member);
  EXPECT_EQ(test::ends(doubled, 10).front().x, test::ends(plain, 10).front().x);
}

TEST(MotionBatch, StatesComeAtTheStepsAskedFor) {
  const BatchScene bar = test::batch_bar({4, 2, 2});
  MotionBatch batch(bar.body, bar.options, 1);
  batch.set_member(0, bar.member);
  std::vector<int> seen;
  std::vector<double> lowest;
  batch.run(6, {0, 2, 5}, [&](int step, std::span<const State> states) {
    seen.push_back(step);
    lowest.push_back(states.front().x.col(1).minCoeff());
  });
  EXPECT_EQ(seen, (std::vector<int>{0, 2, 5}));
  EXPECT_GT(lowest[0], lowest[1]);
  EXPECT_GT(lowest[1], lowest[2]);
}

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

TEST(MotionBatch, RefusesBadInputInWords) {
  const BatchScene bar = test::batch_bar({4, 2, 2});
  const auto with = [&](const std::function<void(BatchOptions&)>& change) {
    BatchOptions options = bar.options;
    change(options);
    return refusal([&] { MotionBatch(bar.body, options, 1); });
  };
  using testing::HasSubstr;
  EXPECT_EQ(with([](BatchOptions&) {}), "");
  EXPECT_THAT(with([](BatchOptions& o) { o.dt = 0.0; }), HasSubstr("time step must be positive"));
  EXPECT_THAT(with([](BatchOptions& o) { o.newmark_theta = 1.0; }), HasSubstr("[0.5, 1)"));
  EXPECT_THAT(with([](BatchOptions& o) { o.contact_weight = 0.5; }), HasSubstr("(0.5, 1]"));
  EXPECT_THAT(with([](BatchOptions& o) { o.rotation_prediction = 1.5; }), HasSubstr("[0, 1]"));
  EXPECT_THAT(with([](BatchOptions& o) { o.tolerance = 0.0; }), HasSubstr("[1e-12, 1)"));
  EXPECT_THAT(with([](BatchOptions& o) { o.max_iterations = 0; }), HasSubstr("at least one iteration"));
  EXPECT_THAT(with([](BatchOptions& o) { o.with_plane = true; }), HasSubstr("stiffness and smoothing"));
  EXPECT_THAT(with([](BatchOptions& o) { o.friction_speed = -1.0; }), HasSubstr("must not be negative"));
  EXPECT_THAT(with([](BatchOptions& o) { o.held = {100000}; }), HasSubstr("node 100000 is held"));
  EXPECT_THAT(with([](BatchOptions& o) { o.relative_moduli = {1.0}; }), HasSubstr("one relative modulus an element"));
  EXPECT_THAT(refusal([&] { MotionBatch(bar.body, bar.options, 0); }), HasSubstr("at least one member"));
  EXPECT_THAT(refusal([&] {
                MotionBatch(test::tet_body({0.2, 0.1, 0.1}, {2, 1, 1}, true), bar.options, 1);
              }),
              HasSubstr("not quadratic ones"));

  MotionBatch batch(bar.body, bar.options, 2);
  const auto member = [&](const std::function<void(BatchMember&)>& change, int index = 1) {
    BatchMember m = bar.member;
    change(m);
    return refusal([&] { batch.set_member(index, m); });
  };
  EXPECT_EQ(member([](BatchMember&) {}), "");
  EXPECT_THAT(member([](BatchMember&) {}, 2), HasSubstr("member 2 of a batch of 2"));
  EXPECT_THAT(member([](BatchMember& m) { m.youngs_modulus = 0.0; }), HasSubstr("member 1: Young's modulus"));
  EXPECT_THAT(member([](BatchMember& m) { m.poissons_ratio = 0.5; }), HasSubstr("Poisson's ratio must lie in"));
  EXPECT_THAT(member([](BatchMember& m) { m.density = -1.0; }), HasSubstr("density must be positive"));
  EXPECT_THAT(member([](BatchMember& m) { m.mass_damping = -1.0; }), HasSubstr("mass damping"));
  EXPECT_THAT(member([](BatchMember& m) { m.stiffness_damping = -1.0; }), HasSubstr("stiffness damping"));
  EXPECT_THAT(member([](BatchMember& m) { m.friction = -1.0; }), HasSubstr("friction"));
  EXPECT_THAT(member([](BatchMember& m) { m.plane_normal.setZero(); }), HasSubstr("normal must not be zero"));
  EXPECT_THAT(member([](BatchMember& m) { m.start.x.resize(3, 3); }), HasSubstr("the start has 3 rows"));
  EXPECT_THAT(member([](BatchMember& m) { m.start.v(0, 0) = std::nan(""); }), HasSubstr("start must be finite"));

  EXPECT_THROW(batch.run(1, {}, {}), std::logic_error);  // member 0 was never set
  EXPECT_EQ(member([](BatchMember&) {}, 0), "");
  EXPECT_THAT(refusal([&] { batch.run(3, {2, 1}, {}); }), HasSubstr("must ascend"));
  EXPECT_THAT(refusal([&] { batch.run(3, {4}, {}); }), HasSubstr("from 0 to 3"));
}

}  // namespace
}  // namespace pliant::motion_batch_test
