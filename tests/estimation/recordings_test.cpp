// Several recordings in one objective, and sensors that need correction.
#include "estimation/recordings.hpp"

#include "estimation/alternative.hpp"
#include "estimation/corrections.hpp"
#include "estimation/given_quantities.hpp"
#include "estimation/optimiser.hpp"
#include "geometry/primitives.hpp"
#include "support/derivatives.hpp"
#include "support/dropped.hpp"
#include "support/recordings.hpp"
#include "support/sagging_bar.hpp"
#include "support/tolerance.hpp"

namespace pliant::recordings_test {
namespace {

using test::tolerance;

constexpr double outlier_scale = 0.03;
const Vector3 centre(0.01, 0.02, -0.01);

/// The parameters of a flight that one sensor sees.
struct OneFlight {
  ParameterLayout layout;
  CaptureBlocks blocks{add_motion_blocks(layout, {}), {add_sensor_blocks(layout, "front")}};
};

/// Two flights of one torus seen by sensors whose range and pose are a little off.
struct TwoFlights {
  TwoFlights() {
    for (const unsigned seed : {1u, 2u}) {
      test::Recording r = test::torus_recording(0.05, 5, 0, 1e-3, seed);
      PinholeCamera above;
      above.camera_to_world = {Vector3(1, -1, -1).asDiagonal(), Vector3(0, 0, 2)};
      for (FrameObservations& frame : *r.observations)
        for (SurfaceObservation& o : frame.points) o.sight = sight_of(above, o.position);
      ObservedMotion motion{{r.constraints, nullptr, centre}, r.scene.body, r.scene.options, r.observations, {}};
      motion.options.outlier_scale = outlier_scale;
      motion.options.last_frame = 4;
      motions.push_back(motion);
      one_theta = carry(r.scene.layout.layout(), r.truth, one.layout, VectorX::Zero(one.layout.size()));
    }
    const ParameterSet alone(one.layout, {}, one_theta);
    joint = join({{alone, one.blocks}, {alone, one.blocks}}, true);
    theta = VectorX::Zero(joint.layout.size());
    list = {{"youngs_modulus", "Pa", Transform::Logarithm, joint.layout.at("youngs_modulus"), 1.0, 1.0, 1e7, true}};
    for (const std::size_t r : {0u, 1u}) {
      for (const ParameterBlock& block : one.layout.blocks()) {
        const ParameterHandle own = one.layout.at(block.name), at = joint.layout.at(joint.name_of(block.name, r));
        theta.segment(at, at.size) = one_theta.segment(own, own.size);
      }
      const CaptureBlocks& blocks = joint.blocks[r];
      const SensorBlocks& front = blocks.sensors.front();
      motions[r].simulation.blocks = blocks.motion;
      motions[r].mismatch.sensors = blocks.sensors;
      const std::string number = r > 0 ? "[2]" : "";
      list.push_back({"linear_velocity" + number, "m/s", Transform::Vector, blocks.motion.linear_velocity, 0.5});
      list.push_back({"range_error@front" + number, "m", Transform::Shift, front.error, 0.1});
      list.push_back({"sensor_turn@front" + number, "rad", Transform::Vector, front.turn});
      list.push_back({"sensor_shift@front" + number, "m", Transform::Vector, front.shift, 0.1});
      list.push_back({"range_scale@front" + number, "1", Transform::Shift, front.range_scale, 0.1, -1.0});
      list.push_back({"focal_error@front" + number, "1", Transform::Shift, front.focal_error, 1.0, -1.0});
    }
    for (Parameter& q : list) {
      q.estimated = true;
      if (q.name.starts_with("sensor")) q.prior_std = 0.05, q.prior_mean = VectorX::Zero(3);
    }
    parameters = ParameterSet(joint.layout, list, theta);
    p = parameters.to_unconstrained(theta);
    for (Eigen::Index i = 0; i < p.size(); ++i) p[i] += 0.02 * std::sin(1.0 + 2.0 * double(i));
  }
  /// Of the first flight, at these values.
  double cost_of_first(const VectorX& at) const {
    return Objective({motions[0]}, ParameterSet(joint.layout, {}, at)).evaluate(VectorX(0)).cost;
  }

  OneFlight one;
  VectorX one_theta;
  std::vector<ObservedMotion> motions;
  JointLayout joint;
  VectorX theta;  ///< the truth of both
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
  EXPECT_EQ(H.block(1, 13, 12, 12).norm(), 0.0) << "the first one's own and the second one's own";
  EXPECT_GT(H.block(0, 1, 1, 12).norm(), 0.0);
  EXPECT_GT(H.block(0, 13, 1, 12).norm(), 0.0);
}

TEST(SeveralRecordings, CostsAddUp) {
  const TwoFlights scene;
  const CostEvaluation both = Objective(scene.motions, scene.parameters).evaluate(scene.p);
  const VectorX theta = scene.parameters.to_theta(scene.p);
  double sum = scene.parameters.prior(scene.p);
  for (std::size_t r = 0; r < 2; ++r) {
    ObservedMotion alone = scene.motions[r];
    alone.simulation.blocks = scene.one.blocks.motion;
    alone.mismatch.sensors = scene.one.blocks.sensors;
    const ParameterSet own(scene.one.layout, {}, scene.joint.part(theta, r));
    const double cost = Objective({alone}, own).evaluate(VectorX(0)).cost;
    EXPECT_NEAR(both.of_recording(int(r)).cost, cost, tolerance(1e-12) * cost);
    sum += cost;
  }
  EXPECT_NEAR(both.cost, sum, tolerance(1e-12) * sum);
  EXPECT_THROW(Objective(scene.motions, ParameterSet(scene.joint.layout, {}, scene.one_theta)), std::invalid_argument);
}

/// Points that were moved as a bad sensor moves them cost what the true ones cost once the sensor is corrected.
TEST(Sensors, ACorrectionUndoesTheSensorsError) {
  TwoFlights scene;
  SensorCorrection::Values values;
  values << 0.0, 0.02, -0.01, 0.03, 4e-3, -2e-3, 1e-3, 0.0, 0.0;
  const double before = scene.cost_of_first(scene.theta);
  auto moved = std::make_shared<std::vector<FrameObservations>>(*scene.motions[0].observations);
  const SensorCorrection wrong(centre, values);
  const Vector3 shift = values.segment<3>(4), turn = values.segment<3>(1);
  for (FrameObservations& frame : *moved)
    for (SurfaceObservation& o : frame.points) {  // the inverse of the correction
      const Matrix3 R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
      o.position = centre + R.transpose() * (o.position - centre - shift);
    }
  scene.motions[0].observations = moved;
  const double spoiled = scene.cost_of_first(scene.theta);
  EXPECT_GT(spoiled, 2.0 * before);
  VectorX theta = scene.theta;
  scene.joint.blocks[0].sensors[0].add(values, theta);
  EXPECT_NEAR(scene.cost_of_first(theta), before, tolerance(1e-9) * before);
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
  ParameterLayout layout;
  std::vector<Parameter> list;
  for (const std::string name : {"youngs_modulus", "range_error@left", "range_error@right"}) {
    const Role role = list.empty() ? Role::Material : Role::Sensor;
    list.push_back({name, "m", Transform::Shift, layout.add({name, "m", 1, role}), 1.0, -1.0, 1.0, true});
  }
  const ParameterSet parameters(layout, list, VectorX::Zero(3));
  const std::vector<Correction> both = {{"left", {"range_error@left"}}, {"right", {"range_error@right"}}};
  const auto needed = needed_corrections(e, parameters, both, 100.0);
  ASSERT_EQ(needed.size(), 1u) << "beside the first, the second gains too little";
  EXPECT_EQ(needed[0].correction.what, "left");
  const Eigen::Vector2d g(0.0, 50.0);
  EXPECT_NEAR(needed[0].gain, 0.5 * g.dot(A.topLeftCorner<2, 2>().ldlt().solve(g)), 1e-12);
  EXPECT_NEAR(needed[0].least, 0.5 * (650.0 - 50.0), 1e-12) << "half of what noise does not explain";
  EXPECT_TRUE(may_need_correction(650.0, 100.0));
  EXPECT_FALSE(may_need_correction(99.0, 100.0));
  e.cost = 99.0;  // an error of the model as large as the noise
  EXPECT_TRUE(needed_corrections(e, parameters, both, 100.0).empty());
  e.cost = 1000.0;  // it explains less than half of what is wrong
  EXPECT_TRUE(needed_corrections(e, parameters, both, 100.0).empty());
}

TEST(Corrections, WhatTheUserDecidedAboutIsLeftAlone) {
  const TwoFlights scene;
  std::vector<Parameter> list = scene.list;
  for (Parameter& p : list) p.estimated = p.name == "youngs_modulus";
  const ParameterSet none(scene.joint.layout, list, scene.parameters.reference());
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
  ParameterSet without(scene.joint.layout, list, scene.parameters.reference());
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

/// Two captures of one object of two materials over a floor, each seen as clouds.
struct TwoCaptures : ::testing::Test {
  TwoCaptures() {
    Capture capture;
    capture.scene.object.surface = make_box(Vector3(0.3, 0.1, 0.1), 0.1);
    capture.scene.object.density = 300.0;
    capture.scene.timing.times = {0.0, 0.1};
    capture.scene.planes.resize(1);
    capture.clouds = {{{"cloud.ply"}, 1, 1e-3}};
    capture.scene.regions = {{"beyond", RegionHalfSpace{Vector3::Zero(), Vector3::UnitX()}}};
    recordings = {{capture, {}}, {capture, {}}};
  }
  JointLayout joint(const FitOptions& options = {}) const { return joint_layout(recordings, options, 2); }
  std::vector<RecordedCapture> recordings;
};

TEST_F(TwoCaptures, ShareTheMaterialAndHaveTheirOwnStartPlanesAndSensors) {
  const JointLayout joint = this->joint();
  for (const std::string shared :
       {"youngs_modulus", "youngs_modulus@beyond", "poissons_ratio", "mass_damping", "stiffness_damping"}) {
    EXPECT_TRUE(joint.layout.contains(shared)) << shared;
    EXPECT_FALSE(joint.layout.contains(shared + "[2]")) << shared;
  }
  for (const std::string own : {"gravity", "linear_velocity", "angular_velocity", "plane", "range_error@clouds",
                                "sensor_turn@clouds", "sensor_shift@clouds"}) {
    EXPECT_TRUE(joint.layout.contains(own)) << own;
    EXPECT_TRUE(joint.layout.contains(own + "[2]")) << own;
  }
  ASSERT_EQ(joint.blocks.size(), 2u);
  const CaptureBlocks &first = joint.blocks[0], &second = joint.blocks[1];
  EXPECT_EQ(first.motion.youngs_moduli, second.motion.youngs_moduli);
  EXPECT_EQ(first.motion.poissons_ratio, second.motion.poissons_ratio);
  EXPECT_EQ(first.motion.mass_damping, second.motion.mass_damping);
  EXPECT_EQ(first.motion.stiffness_damping, second.motion.stiffness_damping);
  EXPECT_EQ(second.motion.gravity, joint.layout.at("gravity[2]"));
  EXPECT_EQ(second.motion.linear_velocity, joint.layout.at("linear_velocity[2]"));
  EXPECT_EQ(second.motion.angular_velocity, joint.layout.at("angular_velocity[2]"));
  EXPECT_EQ(second.motion.planes[0].whole(), joint.layout.at("plane[2]"));
  EXPECT_EQ(second.motion.planes[0].normal.first, second.motion.planes[0].point.first + 3);
  EXPECT_EQ(first.motion.planes[0].whole(), joint.layout.at("plane"));
  EXPECT_EQ(second.sensors[0].error, joint.layout.at("range_error@clouds[2]"));
  EXPECT_EQ(second.sensors[0].turn, joint.layout.at("sensor_turn@clouds[2]"));
  EXPECT_EQ(first.sensors[0].shift, joint.layout.at("sensor_shift@clouds"));
  EXPECT_EQ(joint.layout.size(), 2 * joint.own[0].size() - 5) << "the material's numbers are there once";
}

TEST_F(TwoCaptures, ShareADensityWhereItIsEstimatedOrTheUserNamesIt) {
  const auto is_shared = [&](const FitOptions& options = {}) {
    const JointLayout joint = this->joint(options);
    EXPECT_EQ(joint.blocks[0].motion.density == joint.blocks[1].motion.density, !joint.layout.contains("density[2]"));
    return !joint.layout.contains("density[2]");
  };
  EXPECT_FALSE(is_shared());
  FitOptions named;
  named.parameters["density"].start = VectorX::Constant(1, 250.0);
  EXPECT_TRUE(is_shared(named));
  for (RecordedCapture& r : recordings) {
    r.capture.scene.object.density.reset();
    r.capture.scene.initial.released = true;
    r.capture.scene.initial.release_of = Weight{0.02, Vector3(0.3, 0.0, 0.0)};
  }
  EXPECT_TRUE(is_shared()) << "it is estimated";
}

TEST(Recordings, GiveADensityEachThatMayErr) {
  test::Dropped dropped;
  dropped.frames = 3, dropped.cells = 4.0;
  std::vector<std::string> notes;
  const Recordings two({dropped.record(), dropped.record()}, test::six_cells(), notes);
  ASSERT_NE(two.parameters().find("density[2]"), nullptr);
  EXPECT_FALSE(two.parameters().find("density[2]")->estimated);
  EXPECT_EQ(std::ranges::count(given_quantities(two.parameters()), cause_mass, &GivenQuantity::cause), 2);
}

TEST(Recordings, CompareWhatWasSeenLaterThanStated) {
  test::Dropped dropped;
  dropped.frames = 4, dropped.cells = 4.0;
  std::vector<std::string> notes;
  const Recordings one({dropped.record()}, test::six_cells(), notes);
  const Grid grid = one.grid(4.0, 1.0);
  ParameterSet nothing = one.parameters();
  for (const Parameter& p : one.parameters().parameters()) nothing.set_estimated(p.name, false);
  const auto frames = [&](std::optional<int> later, int last) {
    Compared compared{1.0, [&](const Recording&) { return last; }};
    compared.later = later;
    std::vector<int> seen;
    for (const FrameFit& f : one.objective(grid, nothing, compared).evaluate(VectorX(0)).frames)
      seen.push_back(f.frame);
    return seen;
  };
  const std::vector<int> as_stated = frames({}, 3);
  ASSERT_GE(as_stated.size(), 3u);
  EXPECT_EQ(frames(0, 1), as_stated) << "all of the motion, not up to a frame";
  EXPECT_EQ(frames(1, 1), std::vector<int>(as_stated.begin() + 1, as_stated.end())) << "but what falls behind its end";
  EXPECT_EQ(frames(-1, 1), std::vector<int>(as_stated.begin(), as_stated.end() - 1)) << "or before its beginning";
}

TEST_F(TwoCaptures, ArePartsOfTheirVector) {
  const JointLayout joint = this->joint();
  const VectorX theta = VectorX::LinSpaced(joint.layout.size(), 1.0, joint.layout.size());
  for (const std::size_t r : {0u, 1u}) {
    const VectorX part = joint.part(theta, r);
    ASSERT_EQ(part.size(), joint.own[r].size());
    for (const ParameterBlock& block : joint.own[r].blocks()) {
      const ParameterHandle own = joint.own[r].at(block.name), at = joint.layout.at(joint.name_of(block.name, r));
      EXPECT_EQ(part.segment(own, own.size), theta.segment(at, at.size)) << block.name;
    }
  }
  EXPECT_EQ(joint.name_of("plane", 0), "plane");
  EXPECT_EQ(joint.name_of("plane", 1), "plane[2]");
  EXPECT_EQ(joint.name_of("youngs_modulus", 1), "youngs_modulus");
  EXPECT_THROW((void)joint.part(theta.head(3), 0), std::invalid_argument);
}

/// A number of control moduli is chosen on the way: all else stays.
TEST_F(TwoCaptures, KeepAllButTheModuliWhereThereAreOthers) {
  for (RecordedCapture& r : recordings) r.capture.scene.regions.clear();
  const JointLayout from = joint_layout(recordings, {}, 2), to = joint_layout(recordings, {}, 3);
  const VectorX theta = VectorX::LinSpaced(from.layout.size(), 1.0, from.layout.size());
  const Vector3 moduli(1e3, 2e3, 3e3);
  const VectorX changed = with_moduli(from, theta, to, moduli);
  for (std::size_t r = 0; r < 2; ++r) {
    EXPECT_EQ(to.blocks[r].motion.moduli(changed), moduli);
    const auto same = [&](const ParameterHandle& before, const ParameterHandle& after) {
      return theta.segment(before, before.size) == changed.segment(after, after.size);
    };
    EXPECT_TRUE(same(from.blocks[r].motion.linear_velocity, to.blocks[r].motion.linear_velocity));
    EXPECT_TRUE(same(from.blocks[r].motion.planes[0].whole(), to.blocks[r].motion.planes[0].whole()));
    EXPECT_TRUE(same(from.blocks[r].motion.density, to.blocks[r].motion.density));
    EXPECT_TRUE(same(from.blocks[r].sensors[0].shift, to.blocks[r].sensors[0].shift));
  }
}

/// A bar that a camera sees whose neighbouring pixels scatter by so many times its noise of 1 mm.
struct ScatteringBar {
  explicit ScatteringBar(double scatter) {
    RecordedCapture bar = test::sagging_bar(2e5);
    bar.capture.clouds.clear();
    DepthCamera camera;
    camera.name = "front";
    camera.camera.width = camera.camera.height = 100;
    camera.noise = 1e-3;
    bar.capture.depth = {camera};
    std::ranges::fill(bar.observed.front().camera, 0);
    bar.observed.front().scatter = {scatter};
    recordings = std::make_unique<Recordings>(std::vector{bar}, FitOptions{}, notes);
  }
  double noise() const { return recordings->front().observations->front().points.front().noise; }

  std::vector<std::string> notes;
  std::unique_ptr<Recordings> recordings;
};

TEST(ScatterOfPixels, WithinWhatTheCaptureStatesChangesNothing) {
  const ScatteringBar bar(0.8);
  EXPECT_NEAR(bar.noise(), 1e-3, 1e-9);
  EXPECT_THAT(bar.recordings->common_errors(), ::testing::IsEmpty());
  EXPECT_THAT(bar.notes, ::testing::IsEmpty());
}

TEST(ScatterOfPixels, BeyondTheNoiseWeighsThem) {
  const ScatteringBar bar(2.0);
  EXPECT_NEAR(bar.noise(), 2e-3, 1e-9);
  EXPECT_THAT(bar.recordings->common_errors(), ::testing::IsEmpty());
  EXPECT_THAT(bar.notes, ::testing::ElementsAre(::testing::HasSubstr("2.0 times the noise that the capture states")));
}

TEST(ScatterOfPixels, FarBelowTheNoiseIsAnErrorThatAllHaveInCommon) {
  const ScatteringBar bar(0.1);
  EXPECT_NEAR(bar.noise(), 1e-3, 1e-9);
  const std::vector<CommonError> errors = bar.recordings->common_errors();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NEAR(errors[0].relative, 1e-3 * std::sqrt(0.99) / 0.4, 1e-8);
  EXPECT_EQ(errors[0].sensor.turn, bar.recordings->parameters().layout().at("sensor_turn@front"));
  EXPECT_THAT(bar.notes, ::testing::ElementsAre(::testing::HasSubstr("they err together")));
  const auto given = given_quantities(bar.recordings->parameters(), errors);
  const auto gravity = std::ranges::find(given, std::string("direction of gravity"), &GivenQuantity::cause);
  ASSERT_NE(gravity, given.end());
  EXPECT_EQ(gravity->deviation, 2.0 * errors[0].relative);
}

}  // namespace
}  // namespace pliant::recordings_test
