// Several recordings in one objective, and sensors that need correction.
#include "support/recordings.hpp"

#include "estimation/corrections.hpp"
#include "estimation/optimiser.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant {
namespace {

using test::tolerance;

constexpr double outlier_scale = 0.03;
const Vector3 centre(0.01, 0.02, -0.01);

/// Two flights of one torus seen by sensors whose range and pose are a little off.
struct TwoFlights {
  TwoFlights() {
    VectorX theta;
    for (const unsigned seed : {1u, 2u}) {
      test::Recording r = test::torus_recording(0.05, 5, 0, 1e-3, seed);
      r.scene.options.sensors = 1;
      for (FrameObservations& frame : *r.observations)
        for (SurfaceObservation& o : frame.points) o.view = (o.position - Vector3(0, 0, 2)).normalized();
      ObservedMotion motion{{r.constraints, nullptr, centre}, r.scene.body, r.scene.options, r.observations, {}};
      motion.options.outlier_scale = outlier_scale;
      motion.options.last_frame = 4;
      motions.push_back(motion);
      one_theta.setZero(theta::size(0, 1, 0, 1));
      one_theta.head(r.truth.size()) = r.truth;
      theta.conservativeResize(theta.size() + one_theta.size());
      theta.tail(one_theta.size()) = one_theta;
    }
    const int other = int(one_theta.size()), sensor = theta::sensor(0, 0, 0);
    list = {{"youngs_modulus", "Pa", Transform::Logarithm, theta::youngs_modulus, 1.0, 1.0, 1e7, true}};
    list[0].also = {other + theta::youngs_modulus};
    for (const int offset : {0, other}) {
      const std::string number = offset > 0 ? "[2]" : "";
      list.push_back({"linear_velocity" + number, "m/s", Transform::Vector, offset + theta::linear_velocity, 0.5});
      list.push_back({"range_error@front" + number, "m", Transform::Shift, offset + sensor, 0.1});
      list.push_back({"sensor_turn@front" + number, "rad", Transform::Vector, offset + sensor + 1});
      list.push_back({"sensor_shift@front" + number, "m", Transform::Vector, offset + sensor + 4, 0.1});
    }
    for (Parameter& q : list) {
      q.estimated = true;
      if (q.name.starts_with("sensor")) q.prior_std = 0.05, q.prior_mean = VectorX::Zero(3);
    }
    parameters = ParameterSet(list, theta);
    p = parameters.to_unconstrained(theta);
    for (Eigen::Index i = 0; i < p.size(); ++i) p[i] += 0.02 * std::sin(1.0 + 2.0 * double(i));
  }
  std::vector<ObservedMotion> motions;
  VectorX one_theta;
  std::vector<Parameter> list;
  ParameterSet parameters;
  VectorX p;
};

TEST(SeveralRecordings, GradientsAgreeAndMatchCentralDifferences) {
  const TwoFlights scene;
  Objective objective(scene.motions, scene.parameters);
  const CostEvaluation by_tangents = objective.linearise(scene.p), by_adjoint = objective.gradient(scene.p);
  ASSERT_TRUE(by_tangents.succeeded && by_adjoint.succeeded) << by_tangents.failure << by_adjoint.failure;
  EXPECT_NEAR(by_adjoint.cost, by_tangents.cost, tolerance(1e-10) * by_adjoint.cost);
  const auto names = scene.parameters.coordinate_names();
  for (Eigen::Index i = 0; i < scene.p.size(); ++i) {
    const double g = by_tangents.gradient[i];
    ASSERT_GT(std::abs(g), 1e-4 * std::sqrt(by_tangents.gauss_newton(i, i))) << names[std::size_t(i)];
    EXPECT_NEAR(by_adjoint.gradient[i], g, tolerance(1e-7) * std::abs(g)) << names[std::size_t(i)];
    const auto along = [&](double h) {
      return VectorX::Constant(1, objective.evaluate(scene.p + h * VectorX::Unit(scene.p.size(), i)).cost);
    };
    EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, g), 0.05), tolerance(1e-5))
        << names[std::size_t(i)];
  }
}

TEST(SeveralRecordings, OnlyTheMaterialConnectsThem) {
  const TwoFlights scene;
  const MatrixX H = Objective(scene.motions, scene.parameters).linearise(scene.p).gauss_newton;
  EXPECT_EQ(H.block(1, 11, 10, 10).norm(), 0.0) << "the first one's own and the second one's own";
  EXPECT_GT(H.block(0, 1, 1, 10).norm(), 0.0);
  EXPECT_GT(H.block(0, 11, 1, 10).norm(), 0.0);
}

TEST(SeveralRecordings, CostsAddUp) {
  const TwoFlights scene;
  const CostEvaluation both = Objective(scene.motions, scene.parameters).evaluate(scene.p);
  const VectorX theta = scene.parameters.to_theta(scene.p);
  double sum = scene.parameters.prior(scene.p);
  for (std::size_t r = 0; r < 2; ++r) {
    const VectorX own = r == 0 ? theta.head(theta.size() / 2) : theta.tail(theta.size() / 2);
    const double cost = Objective({scene.motions[r]}, ParameterSet({}, own)).evaluate(VectorX(0)).cost;
    EXPECT_NEAR(both.of_recording(int(r)).cost, cost, tolerance(1e-12) * cost);
    sum += cost;
  }
  EXPECT_NEAR(both.cost, sum, tolerance(1e-12) * sum);
  EXPECT_THROW(Objective(scene.motions, ParameterSet({}, scene.one_theta)), std::invalid_argument);
}

/// Points that were moved as a bad sensor moves them cost what the true ones cost once the sensor is corrected.
TEST(Sensors, ACorrectionUndoesTheSensorsError) {
  TwoFlights scene;
  SensorCorrection::Values values;
  values << 0.0, 0.02, -0.01, 0.03, 4e-3, -2e-3, 1e-3;
  const double before = Objective({scene.motions[0]}, ParameterSet({}, scene.one_theta)).evaluate(VectorX(0)).cost;
  auto moved = std::make_shared<std::vector<FrameObservations>>(*scene.motions[0].observations);
  const SensorCorrection wrong(centre, values);
  const Vector3 shift = values.tail<3>(), turn = values.segment<3>(1);
  for (FrameObservations& frame : *moved)
    for (SurfaceObservation& o : frame.points) {  // the inverse of the correction
      const Matrix3 R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
      o.position = centre + R.transpose() * (o.position - centre - shift);
    }
  scene.motions[0].observations = moved;
  const double spoiled = Objective({scene.motions[0]}, ParameterSet({}, scene.one_theta)).evaluate(VectorX(0)).cost;
  EXPECT_GT(spoiled, 2.0 * before);
  VectorX theta = scene.one_theta;
  theta.segment<SensorCorrection::size>(theta::sensor(0, 0, 0)) = values;
  EXPECT_NEAR(Objective({scene.motions[0]}, ParameterSet({}, theta)).evaluate(VectorX(0)).cost, before,
              tolerance(1e-9) * before);
}

/// What a correction would gain is what minimising the quadratic model with it gains over minimising it without.
TEST(Corrections, TheScoreTestPredictsTheFallOfAQuadraticCost) {
  MatrixX A(3, 3);
  A << 4.0, 1.0, 0.5, 1.0, 3.0, -0.7, 0.5, -0.7, 2.0;
  CostEvaluation e;
  e.cost = 650.0;
  e.gauss_newton = A;
  e.gradient.resize(3);
  e.gradient << 0.0, 50.0, -10.0;
  const auto parameter = [](const char* name, int index) {
    return Parameter{name, "m", Transform::Shift, index, 1.0, -1.0, 1.0, true};
  };
  const ParameterSet parameters(
      {parameter("youngs_modulus", 0), parameter("range_error@left", 1), parameter("range_error@right", 2)},
      VectorX::Zero(3));
  const std::vector<Correction> both = {{"left", {"range_error@left"}}, {"right", {"range_error@right"}}};
  const auto needed = needed_corrections(e, parameters, both, 100.0);
  ASSERT_EQ(needed.size(), 1u) << "beside the first, the second gains too little";
  EXPECT_EQ(needed[0].correction.what, "left");
  const Eigen::Vector2d g(0.0, 50.0);
  EXPECT_NEAR(needed[0].gain, 0.5 * g.dot(A.topLeftCorner<2, 2>().ldlt().solve(g)), 1e-12);
  EXPECT_NEAR(needed[0].least, 0.5 * (650.0 - 50.0), 1e-12) << "half of what noise does not explain";
  e.cost = 99.0;  // an error of the model as large as the noise
  EXPECT_TRUE(needed_corrections(e, parameters, both, 100.0).empty());
  e.cost = 1000.0;  // it explains less than half of what is wrong
  EXPECT_TRUE(needed_corrections(e, parameters, both, 100.0).empty());
}

TEST(Corrections, WhatTheUserDecidedAboutIsLeftAlone) {
  const TwoFlights scene;
  std::vector<Parameter> list = scene.list;
  for (Parameter& p : list) p.estimated = p.name == "youngs_modulus";
  const ParameterSet none(list, scene.parameters.reference());
  EXPECT_EQ(possible_corrections(none, {}).size(), 4u) << "range and pose of two sensors";
  EXPECT_EQ(possible_corrections(none, {"range_error"}).size(), 2u);
  EXPECT_EQ(possible_corrections(none, {"sensor_turn@front[2]"}).size(), 3u);
  EXPECT_TRUE(possible_corrections(scene.parameters, {}).empty()) << "they are estimated already";
}

/// A sensor that stands elsewhere than stated is found out, and no other.
TEST(Corrections, OnlyTheSensorThatStandsElsewhereNeedsCorrection) {
  TwoFlights scene;
  std::vector<Parameter> list = scene.list;
  for (Parameter& p : list) p.estimated = p.name == "youngs_modulus";
  ParameterSet without(list, scene.parameters.reference());
  const auto look = [&](const std::vector<ObservedMotion>& motions) {
    Objective objective(motions, without);
    const OptimiserSummary s = minimise(objective, without.to_unconstrained(without.reference()), {});
    ParameterSet with_all = without;
    const auto possible = possible_corrections(without, {});
    for (const Correction& c : possible)
      for (const std::string& name : c.parameters) with_all.set_estimated(name, true);
    with_all.set_reference(without.to_theta(s.p));
    Objective all(motions, with_all);
    const CostEvaluation e = all.linearise(with_all.to_unconstrained(with_all.reference()));
    std::vector<std::string> what;
    for (const NeededCorrection& n : needed_corrections(e, with_all, possible, e.independent_observations()))
      what.push_back(n.correction.what);
    return what;
  };
  EXPECT_TRUE(look(scene.motions).empty());
  auto moved = std::make_shared<std::vector<FrameObservations>>(*scene.motions[1].observations);
  for (FrameObservations& frame : *moved)
    for (SurfaceObservation& o : frame.points) o.position += Vector3(4e-3, -2e-3, 1e-3);
  scene.motions[1].observations = moved;
  EXPECT_EQ(look(scene.motions), std::vector<std::string>{"the pose of front[2]"});
}

}  // namespace
}  // namespace pliant
