#include "estimation/objective.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "estimation/corrections.hpp"
#include "estimation/problem.hpp"
#include "support/derivatives.hpp"
#include "support/recordings.hpp"
#include "support/tolerance.hpp"

namespace pliant::objective_test {
namespace {

using test::tolerance;

constexpr double cell_size = 0.05;

/// A recording seen from other parameters than those that made it.
struct Scene {
  explicit Scene(int planes) : recording(test::torus_recording(cell_size, 6, planes, 1e-3)) {
    const MotionLayout& layout = recording.scene.layout;
    VectorX theta = recording.truth;
    layout.scale_moduli(theta, 1.4);
    theta[layout.poissons_ratio] = 0.3;
    theta[layout.mass_damping] *= 1.5;
    theta[layout.stiffness_damping] *= 0.7;
    theta[layout.density] *= 1.1;
    theta.segment<3>(layout.gravity) += Vector3(0.1, 0.2, -0.1);
    theta.segment<3>(layout.linear_velocity) += Vector3(0.02, -0.03, 0.04);
    theta.segment<3>(layout.angular_velocity) += Vector3(-0.2, 0.1, 0.1);
    for (const PlaneBlock& plane : layout.planes) theta.segment<3>(plane.point) += Vector3(0.0, 2e-3, 0.0);
    parameters = test::torus_parameters(layout, theta);
    std::vector<Parameter> list = parameters.parameters();
    for (Parameter& q : list) q.estimated = true;
    list[1].prior_std = 0.5;
    list[1].prior_mean = VectorX::Zero(1);
    parameters = ParameterSet(layout.layout(), list, theta);
    p = parameters.to_unconstrained(theta);
    p.array() += 0.01;
  }
  test::Recording recording;
  ParameterSet parameters;
  VectorX p;
};

class Gradient : public ::testing::TestWithParam<int> {};

TEST_P(Gradient, SceneIsWorthDifferentiating) {
  Scene scene(GetParam());
  Objective objective = scene.recording.objective(scene.parameters);
  const CostEvaluation e = objective.evaluate(scene.p);
  ASSERT_TRUE(e.succeeded) << e.failure;
  EXPECT_EQ(e.frames.size(), 5u);
  EXPECT_GT(e.matched_fraction(), 0.95);
  EXPECT_GT(e.surface_rms(), 1e-3);
  EXPECT_LT(e.surface_rms(), 0.03);
}

TEST_P(Gradient, AdjointTangentsAndEvaluationAgree) {
  Scene scene(GetParam());
  Objective objective = scene.recording.objective(scene.parameters);
  const CostEvaluation by_adjoint = objective.gradient(scene.p), by_tangents = objective.linearise(scene.p);
  ASSERT_TRUE(by_adjoint.succeeded && by_tangents.succeeded);
  EXPECT_NEAR(by_adjoint.cost, by_tangents.cost, tolerance(1e-10) * by_adjoint.cost);
  EXPECT_NEAR(objective.evaluate(scene.p).cost, by_tangents.cost, tolerance(1e-12) * by_adjoint.cost);
  const VectorX scale = by_tangents.gauss_newton.diagonal().cwiseSqrt();  // what each gradient is measured by
  for (Eigen::Index i = 0; i < scene.p.size(); ++i) {
    ASSERT_GT(std::abs(by_tangents.gradient[i]), 1e-6 * scale[i])
        << scene.parameters.coordinate_names()[std::size_t(i)];
    EXPECT_NEAR(by_adjoint.gradient[i], by_tangents.gradient[i],
                tolerance(1e-8) * std::max(std::abs(by_tangents.gradient[i]), scale[i]))
        << scene.parameters.coordinate_names()[std::size_t(i)];
  }
}

TEST_P(Gradient, MatchesCentralDifferencesInEveryParameter) {
  Scene scene(GetParam());
  Objective objective = scene.recording.objective(scene.parameters);
  const VectorX gradient = objective.gradient(scene.p).gradient;
  for (Eigen::Index i = 0; i < scene.p.size(); ++i) {
    const auto along = [&](double h) {
      return VectorX::Constant(1, objective.evaluate(scene.p + h * VectorX::Unit(scene.p.size(), i)).cost);
    };
    const double error = test::best_relative_error(along, VectorX::Constant(1, gradient[i]), 0.1);
    EXPECT_LT(error, tolerance(1e-5)) << scene.parameters.coordinate_names()[std::size_t(i)];
  }
}

/// Of a recording that lacks frames which nothing tells, or shows one twice.
TEST(TimeDoubt, NamesTheFrameFromWhichAnotherTimeExplainsWhatWasSeen) {
  const test::Recording whole = test::torus_recording(cell_size, 12, 0, 1e-3);
  const auto doubt_of = [&](const std::vector<FrameObservations>& seen) {
    const auto evaluated = [&](int later) {
      test::Recording r = whole;
      r.observations = std::make_shared<std::vector<FrameObservations>>();
      for (FrameObservations frame : seen)
        if ((frame.frame += later) >= 0 && frame.frame < 12) r.observations->push_back(frame);
      return r.objective(r.parameters).evaluate(VectorX(0));
    };
    std::vector<ShiftedInTime> shifted;
    for (const int later : {-1, 1, 2}) shifted.push_back({later, evaluated(later)});
    return doubt_of_time(evaluated(0), shifted);
  };
  std::vector<FrameObservations> missing = *whole.observations, twice = missing;  // of frames 1 to 11
  EXPECT_FALSE(doubt_of(missing));
  missing.erase(missing.begin() + 5, missing.begin() + 7);
  for (std::size_t i = 5; i < missing.size(); ++i) missing[i].frame -= 2;
  const auto later = doubt_of(missing);
  ASSERT_TRUE(later);
  EXPECT_EQ(later->frame, 6);
  EXPECT_EQ(later->later, 2);
  EXPECT_GT(later->share, 0.9);
  twice.insert(twice.begin() + 4, twice[3]);
  for (std::size_t i = 4; i < twice.size(); ++i) ++twice[i].frame;
  twice.pop_back();
  const auto earlier = doubt_of(twice);
  ASSERT_TRUE(earlier);
  EXPECT_EQ(earlier->frame, 5);
  EXPECT_EQ(earlier->later, -1);
  // Noise that is taken for less than it is does not lie in time.
  std::vector<FrameObservations> noisy = *whole.observations;
  for (FrameObservations& frame : noisy)
    for (SurfaceObservation& point : frame.points) point.noise *= 0.3;
  EXPECT_FALSE(doubt_of(noisy));
}

/// Every other sensor looks at 0.4 of the way to the next frame: frames are seen twice, at two times.
test::Recording seen_between_frames(int planes, bool only_between = false) {
  test::Recording r = test::torus_recording(cell_size, 6, planes, 1e-3);
  SimulationOptions options = r.scene.options;
  const std::vector<double> frames = options.times;
  const double late = 0.4 * (frames[1] - frames[0]);
  options.times = {frames[0]};
  for (std::size_t f = 1; f + 1 < frames.size(); ++f) options.times.push_back(frames[f] + late);
  std::vector<Vector3> samples;
  for (const SurfacePoint& p : r.scene.body->surface) samples.push_back(p.position);
  const Embedding surface(*r.scene.body, samples);
  std::vector<FrameObservations> between;
  Simulation simulation(r.scene.body, options);
  simulation.run(r.truth, [&](int frame, const State& state, auto) {
    if (frame == 0) return true;
    FrameObservations seen{frame, {}, {}, late};
    const Points x = surface.positions(state.x);
    for (Eigen::Index i = 0; i < x.rows(); i += x.rows() / 40) seen.points.push_back({x.row(i).transpose(), 1e-3});
    between.push_back(std::move(seen));
    return true;
  });
  if (only_between) r.observations->clear();
  std::vector<FrameObservations> all;
  std::ranges::merge(*r.observations, between, std::back_inserter(all), {}, &FrameObservations::frame,
                     &FrameObservations::frame);
  *r.observations = std::move(all);
  return r;
}

/// What was seen between frames agrees with the motion at its own time, and not with that at the frame.
TEST(TimeOffset, IsThatOfTheMotion) {
  test::Recording r = seen_between_frames(1, true);
  std::vector<Parameter> list = r.parameters.parameters();
  const ParameterSet parameters(r.scene.layout.layout(), list, r.truth);
  const VectorX p = parameters.to_unconstrained(r.truth);
  const CostEvaluation at_its_time = r.objective(parameters).evaluate(p);
  ASSERT_TRUE(at_its_time.succeeded) << at_its_time.failure;
  EXPECT_EQ(at_its_time.frames.size(), 4u);
  for (FrameObservations& seen : *r.observations) seen.after = 0.0;
  const CostEvaluation at_the_frame = r.objective(parameters).evaluate(p);
  EXPECT_LT(at_its_time.surface_rms(), 0.1 * at_the_frame.surface_rms());
  EXPECT_GT(at_the_frame.surface_rms(), 2e-3);
}

/// Frames at 0, 0.1, 0.2, 0.3 s, let go at 0.1 s; the second camera is 0.13 s late, the third 0.04 s early.
TEST(TimeOffset, PutsWhatASensorSawWhereItLooked) {
  Capture capture;
  capture.scene.timing = evenly_timed(10.0, 4, 1);
  capture.depth.resize(3);
  capture.depth[1].time_offset = 0.13;
  capture.depth[2].time_offset = -0.04;
  std::vector<ObservedFrame> observed(4);
  for (int f = 0; f < 4; ++f) {
    observed[std::size_t(f)].frame = f;
    for (int c = 0; c < 3; ++c) {
      observed[std::size_t(f)].points.push_back(Vector3(f, c, 0));
      observed[std::size_t(f)].noise.push_back(1e-3f);
      observed[std::size_t(f)].camera.push_back(c);
    }
  }
  std::string seen;  // frame of the simulation + time after it: recorded frame and camera of each point
  const auto written = [&] {
    seen.clear();
    for (const FrameObservations& o : frame_observations(capture, observed, {})) {
      seen += " " + std::to_string(o.frame) + "+" + std::to_string(int(std::lround(1e3 * o.after))) + ":";
      for (const SurfaceObservation& p : o.points)
        seen += std::to_string(int(p.position.x())) + "abc"[int(p.position.y())] + ",";
    }
    return seen;
  };
  EXPECT_EQ(written(), " 0+0:1a, 0+30:0b, 0+60:2c, 1+0:2a, 1+30:1b, 1+60:3c, 2+0:3a, 2+30:2b, 2+130:3b,");
  capture.scene.timing.is_static = true;
  EXPECT_EQ(written(), " 0+0:1a,1b,1c, 1+0:2a,2b,2c, 2+0:3a,3b,3c,");
}

TEST_P(Gradient, OfWhatIsSeenBetweenFramesMatchesCentralDifferences) {
  Scene scene(GetParam());
  const test::Recording r = seen_between_frames(GetParam());
  Objective objective = r.objective(scene.parameters);
  const CostEvaluation by_adjoint = objective.gradient(scene.p), by_tangents = objective.linearise(scene.p);
  ASSERT_TRUE(by_adjoint.succeeded && by_tangents.succeeded);
  EXPECT_EQ(by_adjoint.frames.size(), 9u);
  EXPECT_LT((by_adjoint.gradient - by_tangents.gradient).norm(), tolerance(1e-8) * by_tangents.gradient.norm());
  for (const Eigen::Index i : {Eigen::Index(0), scene.p.size() / 2, scene.p.size() - 1}) {
    const auto along = [&](double h) {
      return VectorX::Constant(1, objective.evaluate(scene.p + h * VectorX::Unit(scene.p.size(), i)).cost);
    };
    const double error = test::best_relative_error(along, VectorX::Constant(1, by_adjoint.gradient[i]), 0.1);
    EXPECT_LT(error, tolerance(1e-5)) << scene.parameters.coordinate_names()[std::size_t(i)];
  }
}

TEST_P(Gradient, GaussNewtonMatrixIsThatOfTheResiduals) {
  Scene scene(GetParam());
  Objective objective = scene.recording.objective(scene.parameters);
  const CostEvaluation e = objective.linearise(scene.p);
  Simulation simulation(scene.recording.scene.body, scene.recording.scene.options);
  const auto& seen = *scene.recording.observations;
  const auto distances = [&](const VectorX& p) {
    std::vector<double> all;
    simulation.run(scene.parameters.to_theta(p), [&](int frame, const State& state, auto) {
      if (frame > 0)
        for (const PointMatch& m : scene.recording.constraints->match(seen[std::size_t(frame - 1)].points, state.x))
          all.push_back(m.cell < 0 ? 1.0 : m.distance);
      return true;
    });
    return VectorX(Eigen::Map<VectorX>(all.data(), Eigen::Index(all.size())));
  };
  const VectorX r = distances(scene.p);
  MatrixX J(r.size(), scene.p.size());
  for (Eigen::Index i = 0; i < scene.p.size(); ++i) {
    const VectorX step = 1e-6 * VectorX::Unit(scene.p.size(), i);
    J.col(i) = (distances(scene.p + step) - distances(scene.p - step)) / 2e-6;
  }
  const RobustLoss loss{0.03};
  const VectorX w =
      r.unaryExpr([&](double d) { return loss.weight(d) / (1e-3 * 1e-3); });  // 40 points: all count in full
  VectorX unused;
  MatrixX curvature;
  scene.parameters.prior(scene.p, &unused, &curvature);
  const MatrixX expected = J.transpose() * w.asDiagonal() * J + curvature;
  const VectorX scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixX difference = scale.asDiagonal() * (e.gauss_newton - expected) * scale.asDiagonal();
  EXPECT_LT(difference.cwiseAbs().maxCoeff(), tolerance(1e-4));  // kinks of the distance's grid within the steps
  EXPECT_GT(curvature.maxCoeff(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(FlightAndContact, Gradient, ::testing::Values(0, 1),
                         [](const auto& kind) { return kind.param ? "Contact" : "Flight"; });

TEST(Objective, FreeFlightKnowsOnlyTheRatioOfStiffnessAndDensity) {
  test::Recording recording = test::torus_recording(cell_size, 6, 0, 1e-3);
  ParameterSet parameters = recording.parameters;
  parameters.set_estimated("youngs_modulus", true);
  parameters.set_estimated("density", true);
  Objective objective = recording.objective(parameters);
  VectorX p = parameters.to_unconstrained(recording.truth);
  p[0] += 0.2;
  const CostEvaluation e = objective.linearise(p);
  ASSERT_GT(std::abs(e.gradient[0]), 1e-3);
  EXPECT_NEAR(e.gradient[0], -e.gradient[1], tolerance(1e-8) * std::abs(e.gradient[0]));
  const double cost = objective.evaluate(p + VectorX::Constant(2, 0.5)).cost;
  EXPECT_NEAR(cost, e.cost, tolerance(1e-8) * e.cost);
}

TEST(Objective, ManyPointsOfAFrameCountAsFew) {
  const test::Recording few = test::torus_recording(cell_size, 3, 1, 1e-3, 1, 40);
  const test::Recording many = test::torus_recording(cell_size, 3, 1, 1e-3, 1, 400);
  const double one = few.objective(few.parameters).evaluate(VectorX(0)).cost;
  const double ten = many.objective(many.parameters).evaluate(VectorX(0)).cost;
  // 400 points count as 50; the expected cost of noise is half a point's.
  EXPECT_NEAR(ten / one, 50.0 / 40.0, 0.4);
}

TEST(Objective, PointsBeyondTheBandCostAConstantAndNothingMore) {
  const test::Recording recording = test::torus_recording(cell_size, 3, 1, 1e-3);
  const double clean = recording.objective(recording.parameters).evaluate(VectorX(0)).cost;
  test::Recording dirty = recording;
  dirty.observations = std::make_shared<std::vector<FrameObservations>>(*recording.observations);
  SurfaceObservation& point = (*dirty.observations)[1].points[3];
  std::vector<double> costs;
  for (const double away : {0.5, 3.0}) {
    point.position = Vector3(away, away, away);
    const CostEvaluation e = dirty.objective(dirty.parameters).evaluate(VectorX(0));
    EXPECT_EQ(e.frames[1].matched, 39);
    costs.push_back(e.cost);
  }
  EXPECT_EQ(costs[0], costs[1]);
  EXPECT_GT(costs[0], clean + 100.0);
  EXPECT_LT(costs[0], clean + RobustLoss{0.03}.outlier() / 1e-6 + 1e-6);
}

TEST(Objective, SeveralVectorsAtOnceCostWhatEachCostsAlone) {
  const test::Recording recording = test::torus_recording(cell_size, 4, 1, 1e-3);
  ParameterSet parameters = recording.parameters;
  parameters.set_estimated("youngs_modulus", true);
  parameters.set_estimated("mass_damping", true);
  Objective objective = recording.objective(parameters);
  std::vector<VectorX> points;
  for (const double step : {-0.4, 0.0, 0.3, 0.7})
    points.push_back(parameters.to_unconstrained(recording.truth) + VectorX::Constant(2, step));
  (void)objective.linearise(points.front());  // what was run before leaves no trace
  const std::vector<CostEvaluation> together = objective.evaluate(points);
  ASSERT_EQ(together.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_TRUE(together[i].succeeded) << together[i].failure;
    EXPECT_EQ(together[i].cost, objective.evaluate(points[i]).cost) << i;
    EXPECT_EQ(together[i].frames.size(), objective.evaluate(points[i]).frames.size());
    if (i > 0) {
      EXPECT_NE(together[i].cost, together[0].cost);
    }
  }
}

TEST(Objective, EvaluationsThatHaveNotBegunCanBeLeftOut) {
  const test::Recording recording = test::torus_recording(cell_size, 3, 1, 1e-3);
  Objective objective = recording.objective(recording.parameters);
  const ThreadLimit one(1);
  const std::vector<VectorX> points(3, VectorX(0));
  const auto after_the_first = [](std::size_t, const CostEvaluation&) { return false; };
  const std::vector<CostEvaluation> some = objective.evaluate(points, after_the_first);
  ASSERT_EQ(some.size(), 3u);
  EXPECT_EQ(std::ranges::count(some, true, &CostEvaluation::succeeded), 1);
  EXPECT_EQ(std::ranges::count(some, "left out", &CostEvaluation::failure), 2);
}

TEST(Objective, EndsAtTheFrameWhereItIsInterrupted) {
  const test::Recording recording = test::torus_recording(cell_size, 6, 1, 1e-3);
  ParameterSet parameters = recording.parameters;
  parameters.set_estimated("youngs_modulus", true);
  int asked = 0;
  ObjectiveOptions options;
  options.outlier_scale = 0.03, options.last_frame = 5;
  options.interrupted = [&] { return ++asked == 3; };
  Objective objective({recording.constraints, nullptr}, recording.scene.body, recording.scene.options,
                      recording.observations, parameters, options);
  const VectorX p = parameters.to_unconstrained(recording.truth);
  EXPECT_THROW((void)objective.evaluate(p), Interrupted);
  EXPECT_EQ(asked, 3);
  asked = 0;
  EXPECT_THROW((void)objective.linearise(p), Interrupted);
  EXPECT_EQ(asked, 3);
  asked = 0;
  EXPECT_THROW((void)objective.gradient(p), Interrupted);
  EXPECT_EQ(asked, 3);
  asked = 3;  // it does not come again
  EXPECT_TRUE(objective.linearise(p).succeeded) << "what was broken off leaves no trace";
}

/// Work is counted: twice the same is the same, and derivatives and frames add to it.
TEST(Objective, CountsItsWork) {
  const test::Recording recording = test::torus_recording(cell_size, 4, 1, 1e-3);
  ParameterSet parameters = recording.parameters;
  parameters.set_estimated("youngs_modulus", true);
  parameters.set_estimated("mass_damping", true);
  Objective objective = recording.objective(parameters);
  const VectorX p = parameters.to_unconstrained(recording.truth);
  const CostEvaluation alone = objective.evaluate(p), tangents = objective.linearise(p);
  EXPECT_EQ(alone.work, double(recording.scene.body->node_count()) * alone.steps);
  EXPECT_NEAR(tangents.work, (1.0 + 2.0 * steps_of_a_tangent) * alone.work, 1e-9 * alone.work);
  EXPECT_EQ(objective.evaluate(p).work, alone.work);
}

TEST(Objective, AFailedSimulationIsReportedNotThrown) {
  test::Recording recording = test::torus_recording(cell_size, 3, 1, 1e-3);
  recording.scene.options.solver.max_iterations = 1;
  ParameterSet parameters = recording.parameters;
  parameters.set_estimated("youngs_modulus", true);
  Objective objective = recording.objective(parameters);
  const VectorX p = parameters.to_unconstrained(recording.truth);
  for (const CostEvaluation& e : {objective.evaluate(p), objective.linearise(p), objective.gradient(p)}) {
    EXPECT_FALSE(e.succeeded);
    EXPECT_FALSE(e.failure.empty());
  }
}

}  // namespace
}  // namespace pliant::objective_test
