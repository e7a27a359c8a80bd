// The poses of sensors as unknowns of a fit.
#include "estimation/sensor_poses.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "capture/small_capture.hpp"
#include "estimation/fit.hpp"
#include "support/derivatives.hpp"
#include "support/dropped.hpp"
#include "support/recordings.hpp"
#include "support/tolerance.hpp"

namespace pliant::sensor_poses_test {
namespace {

using test::tolerance;

constexpr double degree = std::numbers::pi / 180.0;

RecordedCapture with_pose_std(RecordedCapture recorded, const PoseStd& std) {
  recorded.capture.clouds.front().pose_std = std;
  return recorded;
}

Vector3 middle_of(const Capture& capture) {
  const Box box = bounding_box(*capture.scene.object.surface);
  return 0.5 * (box.min + box.max);
}

/// What a sensor sees that stands turned and shifted: `turn` and `shift` bring its points where they belong.
RecordedCapture seen_askew(RecordedCapture recorded, const Vector3& turn, const Vector3& shift) {
  const Vector3 middle = middle_of(recorded.capture);
  const Matrix3 R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  for (ObservedFrame& frame : recorded.observed)
    for (Vector3& p : frame.points) p = middle + R.transpose() * (p - shift - middle);
  return recorded;
}

/// A block that somebody holds still for a while, and drops.
RecordedCapture held_and_dropped() {
  constexpr int held = 20;
  test::Dropped block;
  block.frames = 20;
  RecordedCapture recorded = block.record();
  const std::vector<Vector3>& vertices = recorded.capture.scene.object.surface->vertices;
  double middle = 0.0;
  for (const Vector3& v : vertices) middle += v.y() / double(vertices.size());
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<ObservedFrame> observed(held, recorded.observed.front());
  for (int f = 0; f < held; ++f) {
    observed[std::size_t(f)].frame = f;
    std::size_t i = 0;
    for (const Vector3& v : vertices)
      if (v.y() >= middle)
        observed[std::size_t(f)].points[i++] =
            v + test::Dropped::noise * Vector3(normal(random), normal(random), normal(random));
  }
  for (ObservedFrame& frame : recorded.observed) {
    frame.frame += held;
    observed.push_back(std::move(frame));
  }
  recorded.observed = std::move(observed);
  Timing& timing = recorded.capture.scene.timing;
  timing.start_frame = held;
  timing.times.clear();
  for (int f = 0; f < held + block.frames; ++f) timing.times.push_back(f / 60.0);
  return recorded;
}

/// On the mesh that the motion was made on: an inverse crime. A pose makes up in part for a model that errs.
FitOptions quick() {
  FitOptions options;
  options.cells = 9.0, options.coarse_cells = 6.0;
  options.budget = 0.0;
  options.alternatives = false;
  return options;
}

TEST(PoseStds, AreThoseOfEachSensorAndZeroWhereAPoseIsExact) {
  Capture capture = test::SmallCapture().read();
  ASSERT_EQ(pose_stds(capture).size(), 1u);
  EXPECT_EQ(pose_stds(capture)[0], PoseStd());
  EXPECT_TRUE(estimates_sensors(capture));
  capture.clouds.resize(2);
  EXPECT_EQ(pose_stds(capture)[1], (PoseStd{0.0, 0.0})) << "clouds lie where they are";
  capture.clouds[0].pose_std = {0.02, 0.001}, capture.clouds[1].pose_std = {0.01, 0.004};
  EXPECT_EQ(pose_stds(capture)[1], (PoseStd{0.02, 0.004})) << "one pose, known as badly as the worst states";
  capture.clouds.clear();
  capture.markers.resize(1);
  capture.depth[0].pose_std = {0.0, 0.0};
  EXPECT_FALSE(estimates_sensors(capture));
}

TEST(PoseStds, ArePriorsOfParametersThatAreEstimated) {
  Capture capture = test::SmallCapture().read();
  capture.depth[0].pose_std = {0.02, 0.0};
  const ParameterSet set = default_parameters(capture, 1e-3).set;
  const Parameter &turn = *set.find("sensor_turn@front"), &shift = *set.find("sensor_shift@front");
  EXPECT_TRUE(turn.estimated);
  EXPECT_FALSE(shift.estimated) << "0: exact";
  EXPECT_NEAR(turn.scale * turn.prior_std, 0.02, 1e-15);
  capture.depth[0].pose_std = {0.0, 0.004};
  const ParameterSet other = default_parameters(capture, 1e-3).set;
  EXPECT_FALSE(other.find("sensor_turn@front")->estimated);
  EXPECT_TRUE(other.find("sensor_shift@front")->estimated);
  EXPECT_NEAR(other.find("sensor_shift@front")->scale * other.find("sensor_shift@front")->prior_std, 0.004, 1e-15);
}

TEST(DeviationsOfReadings, ArePriorsOfParametersThatAreEstimated) {
  Capture capture = test::SmallCapture().read();
  capture.depth[0].pose_std = {0.0, 0.0};
  ParameterSet set = default_parameters(capture, 1e-3).set;
  EXPECT_FALSE(set.find("range_error@front")->estimated);
  EXPECT_FALSE(set.find("range_error@front")->given_std.has_value());
  for (const char* exact : {"range_scale@front", "focal_error@front"}) EXPECT_EQ(set.find(exact), nullptr);
  EXPECT_FALSE(estimates_sensors(capture));
  capture.depth[0].range_std = 0.0;
  set = default_parameters(capture, 1e-3).set;
  EXPECT_FALSE(set.find("range_error@front")->estimated);
  EXPECT_EQ(set.find("range_error@front")->given_std, 0.0);
  EXPECT_FALSE(estimates_sensors(capture));
  capture.depth[0].range_std = 0.003, capture.depth[0].range_scale_std = 0.01, capture.depth[0].focal_std = 0.02;
  EXPECT_TRUE(estimates_sensors(capture));
  set = default_parameters(capture, 1e-3).set;
  for (const auto& [name, std] :
       {std::pair("range_error@front", 0.003), {"range_scale@front", 0.01}, {"focal_error@front", 0.02}}) {
    const Parameter& p = *set.find(name);
    EXPECT_TRUE(p.estimated) << name;
    EXPECT_NEAR(p.scale * p.prior_std, std, 1e-15) << name;
    EXPECT_NEAR(p.scale * p.given_std.value(), std, 1e-15) << name;
    EXPECT_EQ(p.prior_mean, VectorX::Zero(1)) << name;
  }
}

TEST(PlanesSeen, AreThoseOfTheImages) {
  test::SmallCapture small;
  std::vector<std::string> notes;
  const std::vector<PlaneObservation> seen = planes_seen(small.read(), notes);
  ASSERT_EQ(seen.size(), 1u);
  EXPECT_EQ(seen[0].sensor, 0);
  EXPECT_LT((seen[0].normal - Vector3(0, -1, 0)).norm(), 2e-3);
  EXPECT_NEAR(seen[0].point.y(), 0.5, 2e-3);
  EXPECT_NEAR(seen[0].sight.direction.norm(), 1.0, 1e-12);
  EXPECT_LT((seen[0].sight.distance * seen[0].sight.direction - (seen[0].point - Vector3(0, 0, -1))).norm(), 1e-12);
  EXPECT_LT((seen[0].normal_off_axis - seen[0].normal.cwiseProduct(Vector3(1, 1, 0))).norm(), 1e-12);
  EXPECT_TRUE(notes.empty());
}

TEST(PlanesSeen, FarFromWhereOneIsKnownToBeAreAnother) {
  test::SmallCapture small;
  small.edit("point = [0.0, 0.5, 0.0]", "point = [0.0, 0.53, 0.0]");
  std::vector<std::string> notes;
  EXPECT_TRUE(planes_seen(small.read(), notes).empty());
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("30 mm from where plane 1 is known to be"), std::string::npos) << notes[0];
  notes.clear();
  small.edit("normal = [0.0, -2.0, 0.0]", "normal = [0.0, -2.0, 0.0]\nknown = false");
  EXPECT_EQ(planes_seen(small.read(), notes).size(), 1u) << "one that is known roughly is where it is seen";
}

/// A motion over a plane that its sensor saw, and whose place and pose are unknown with it.
TEST(PlanesSeen, DerivativesMatchCentralDifferences) {
  test::Recording r = test::torus_recording(0.05, 4, 1, 1e-3);
  ParameterLayout layout = r.scene.layout.layout();
  const SensorBlocks sensor = add_sensor_blocks(layout, "front");
  VectorX theta = VectorX::Zero(layout.size());
  theta.head(r.truth.size()) = r.truth;
  const PlaneBlock& plane = r.scene.options.blocks.planes.front();
  PlaneObservation seen;
  seen.normal = (plane.normal.vector(theta) + Vector3(0.01, 0.0, -0.02)).normalized();
  seen.point = plane.point.vector(theta) + Vector3(0.2, 0.003, 0.1);
  seen.sight = {Vector3(0.3, -0.8, 0.2).normalized(), 1.1, Vector3(0.2, 0.3, -0.1)};
  seen.normal_off_axis = Vector3(0.3, 0.6, -0.2);
  seen.tilt_std = 0.003, seen.height_std = 7e-4;
  r.observations->front().planes = {seen};
  std::vector<Parameter> list = {
      {"youngs_modulus", "Pa", Transform::Logarithm, layout.at("youngs_modulus"), 1.0, 1.0, 1e7, true},
      {"plane", "", Transform::PlanePosition, plane.whole(), 0.1},
      {"range_error@front", "m", Transform::Shift, sensor.error, 0.1, -1.0, 1.0},
      {"sensor_turn@front", "rad", Transform::Vector, sensor.turn},
      {"sensor_shift@front", "m", Transform::Vector, sensor.shift, 0.1},
      {"range_scale@front", "1", Transform::Shift, sensor.range_scale, 0.1, -1.0},
      {"focal_error@front", "1", Transform::Shift, sensor.focal_error, 0.1, -1.0}};
  for (Parameter& q : list) q.estimated = true;
  list[1].origin = theta.segment<6>(plane.whole());
  const ParameterSet parameters(layout, list, theta);
  ObservedMotion motion{{r.constraints, nullptr, Vector3(0.01, 0.02, -0.01), {sensor}},
                        r.scene.body,
                        r.scene.options,
                        r.observations,
                        {}};
  motion.options.outlier_scale = 0.03, motion.options.last_frame = 3;
  Objective objective({motion}, parameters);
  VectorX p = parameters.to_unconstrained(theta);
  for (Eigen::Index i = 0; i < p.size(); ++i) p[i] += 0.01 * std::sin(1.0 + 2.0 * double(i));
  const CostEvaluation by_tangents = objective.linearise(p), by_adjoint = objective.gradient(p);
  ASSERT_TRUE(by_tangents.succeeded && by_adjoint.succeeded) << by_tangents.failure << by_adjoint.failure;
  const auto names = parameters.coordinate_names();
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    const double g = by_tangents.gradient[i];
    EXPECT_NEAR(by_adjoint.gradient[i], g, tolerance(1e-7) * std::abs(g)) << names[std::size_t(i)];
    const auto along = [&](double h) {
      return VectorX::Constant(1, objective.evaluate(p + h * VectorX::Unit(p.size(), i)).cost);
    };
    EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, g), 0.02), tolerance(1e-5))
        << names[std::size_t(i)];
  }
  EXPECT_GT(by_tangents.cost, objective.evaluate(parameters.to_unconstrained(theta)).cost);
}

/// Frames before the start that show the object where it was scanned are looks at the first frame; one in which a hand
/// still brings it there ends them.
TEST(FirstFrameAtRest, IsWhereTheHandCameToRest) {
  RecordedCapture recorded = test::Dropped{}.record();
  Capture& capture = recorded.capture;
  const ObservedFrame still = recorded.observed.front();
  std::vector<ObservedFrame> observed(6, still);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int f = 0; f < 6; ++f) {
    observed[std::size_t(f)].frame = f;
    for (Vector3& p : observed[std::size_t(f)].points)
      p += Vector3(0.0, f < 2 ? 8e-3 : 0.0, 0.0) + 1e-3 * Vector3(normal(random), normal(random), normal(random));
  }
  capture.scene.timing.start_frame = 5;
  const auto distance = capture_distance(capture, 0.2);
  EXPECT_EQ(first_frame_at_rest(capture, observed, *distance), 2);
  observed.erase(observed.begin() + 3);
  EXPECT_EQ(first_frame_at_rest(capture, observed, *distance), 4) << "nobody saw it in frame 3";
  const std::vector<FrameObservations> frames = frame_observations(capture, observed, {}, 4);
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].at_rest, 2);
  EXPECT_EQ(frames[0].points.size(), 2 * still.points.size());
  EXPECT_EQ(frame_observations(capture, observed).at(0).points.size(), still.points.size());
}

/// A drop that is seen from a pose half a degree and 6 mm off: the pose is found, and the modulus as if it were not.
TEST(PoseOfASensor, IsFoundWithTheMaterial) {
  const RecordedCapture straight = held_and_dropped();
  const Vector3 turn = 0.5 * degree * Vector3(1.0, -0.5, 0.7).normalized(), shift(3e-3, 4e-3, -3.3e-3);
  const RecordedCapture askew = with_pose_std(seen_askew(straight, turn, shift), {});
  const FitOutcome outcome = fit({askew}, quick());
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  const auto found = [&](const std::string& name) {
    return Vector3(outcome.theta.segment<3>(outcome.parameters.find(name)->at));
  };
  EXPECT_LT((found("sensor_turn@clouds") - turn).norm(), 0.25 * turn.norm());
  EXPECT_LT((found("sensor_shift@clouds") - shift).norm(), 0.25 * shift.norm());
  const double modulus = outcome.theta[outcome.parameters.find("youngs_modulus")->at];
  EXPECT_NEAR(modulus, test::Dropped::youngs_modulus, 0.1 * test::Dropped::youngs_modulus);
  EXPECT_TRUE(std::ranges::any_of(
      outcome.notes, [](const std::string& note) { return note.starts_with("The pose of clouds was found"); }));
  // Taken as exact it seems to be of another material.
  FitOptions exact = quick();
  exact.correct = false;
  const FitOutcome bent = fit({with_pose_std(askew, {0.0, 0.0})}, exact);
  ASSERT_TRUE(bent.evaluation.succeeded) << bent.reason;
  const double of_bent = bent.theta[bent.parameters.find("youngs_modulus")->at];
  EXPECT_GT(std::abs(of_bent - test::Dropped::youngs_modulus), 2.0 * std::abs(modulus - test::Dropped::youngs_modulus));
}

/// Where the pose is exact no estimate moves by more than a third of its deviation for being asked.
TEST(PoseOfASensor, ThatIsRightChangesNothing) {
  const RecordedCapture straight = held_and_dropped();
  FitOptions options = quick();
  options.correct = false;
  options.alternatives = true;
  const FitOutcome exact = fit({with_pose_std(straight, {0.0, 0.0})}, options);
  const FitOutcome asked = fit({with_pose_std(straight, {})}, options);
  ASSERT_TRUE(exact.evaluation.succeeded && asked.evaluation.succeeded) << exact.reason << asked.reason;
  const VectorX p = exact.parameters.to_unconstrained(exact.theta);
  const VectorX of_asked = exact.parameters.to_unconstrained(asked.theta);
  for (Eigen::Index i = 0; i < p.size(); ++i)
    EXPECT_NEAR(of_asked[i], p[i], asked.std[i] / 3.0) << exact.parameters.coordinate_names()[std::size_t(i)];
}

/// Deviations of zero leave a pose out of a fit, to the last bit: as of clouds that state none.
TEST(PoseOfASensor, ThatIsExactIsNoUnknown) {
  const RecordedCapture straight = held_and_dropped();
  FitOptions options = quick();
  const FitOutcome unsaid = fit({straight}, options), stated = fit({with_pose_std(straight, {0.0, 0.0})}, options);
  EXPECT_EQ(unsaid.theta, stated.theta);
  EXPECT_EQ(unsaid.evaluation.cost, stated.evaluation.cost);
  EXPECT_EQ(unsaid.parameters.coordinate_names(), stated.parameters.coordinate_names());
  for (const std::string& name : stated.parameters.coordinate_names()) EXPECT_FALSE(name.starts_with("sensor")) << name;
}

/// Of two sensors that disagree each is found where it stands: points are told apart by who saw them.
TEST(PoseOfASensor, EachOfTwoThatDisagree) {
  RecordedCapture recorded = test::Dropped{}.record();
  Capture& capture = recorded.capture;
  DepthCamera left, right;
  left.name = "left", right.name = "right";
  left.noise = right.noise = test::Dropped::noise;
  capture.clouds.clear();
  capture.depth = {left, right};
  const Vector3 shifts[2] = {{4e-3, -2e-3, 3e-3}, {-3e-3, 3e-3, 2e-3}};
  for (ObservedFrame& frame : recorded.observed)
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      frame.camera[i] = int(i % 2);
      frame.pixel[i] = int(i);
      frame.points[i] -= shifts[i % 2];
    }
  capture.scene.planes.clear();  // images, which would show one, there are none
  const int frames = 10;         // before it lands
  capture.scene.timing.times.resize(frames);
  recorded.observed.resize(frames);
  FitOptions options = quick();
  options.parameters["youngs_modulus"] = {VectorX::Constant(1, test::Dropped::youngs_modulus), false, {}};
  const FitOutcome outcome = fit({recorded}, options);
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  for (const auto& [name, shift] : {std::pair("sensor_shift@left", shifts[0]), {"sensor_shift@right", shifts[1]}})
    EXPECT_LT((Vector3(outcome.theta.segment<3>(outcome.parameters.find(name)->at)) - shift).norm(), 1e-3) << name;
}

/// What the readings err by of a camera that sees a block fall freely, a metre away and far from its optical axis.
struct ErringCamera {
  const char* name;
  double value, std;
  std::function<void(DepthCamera& camera, double std)> state;
};

class ErrorOfReadings : public ::testing::TestWithParam<ErringCamera> {};

TEST_P(ErrorOfReadings, IsFoundWithTheMaterial) {
  const ErringCamera& erring = GetParam();
  RecordedCapture recorded = test::Dropped{}.record();
  Capture& capture = recorded.capture;
  DepthCamera above;
  above.name = "above";
  above.noise = test::Dropped::noise;
  above.pose_std = {0.0, 0.0};
  above.camera = look_at(Vector3(0.1, 1.2, 0.2), Vector3(0.6, 0.2, 0.2), Vector3::UnitX(), 320, 240, 1.5);
  erring.state(above, erring.std);
  capture.clouds.clear();
  capture.depth = {above};
  capture.scene.planes.clear();
  constexpr int frames = 10;  // before it lands
  capture.scene.timing.times.resize(frames);
  recorded.observed.resize(frames);
  ParameterLayout layout;
  const SensorBlocks blocks = add_sensor_blocks(layout, "above");
  VectorX wrong = VectorX::Zero(layout.size());
  wrong[layout.at(erring.name + std::string("@above"))] = -erring.value;
  const SensorCorrection error(Vector3::Zero(), blocks.values(wrong));
  for (ObservedFrame& frame : recorded.observed)
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      frame.camera[i] = 0, frame.pixel[i] = int(i);
      frame.points[i] = error.apply(frame.points[i], sight_of(above.camera, frame.points[i]));
    }
  FitOptions options = quick();
  options.parameters["youngs_modulus"] = {VectorX::Constant(1, test::Dropped::youngs_modulus), false, {}};
  const FitOutcome outcome = fit({recorded}, options);
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_NEAR(test::value(outcome, erring.name + std::string("@above")), erring.value, 0.15 * std::abs(erring.value));
}

INSTANTIATE_TEST_SUITE_P(
    OfEachKind, ErrorOfReadings,
    ::testing::Values(ErringCamera{"range_error", 5e-3, 0.01, [](DepthCamera& c, double std) { c.range_std = std; }},
                      ErringCamera{"range_scale", 0.005, 0.02,
                                   [](DepthCamera& c, double std) { c.range_scale_std = std; }},
                      ErringCamera{"focal_error", -0.01, 0.02, [](DepthCamera& c, double std) { c.focal_std = std; }}),
    [](const auto& kind) { return std::string(kind.param.name); });

}  // namespace
}  // namespace pliant::sensor_poses_test
