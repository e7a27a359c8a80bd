// One capture that shows an object by depth, followed markers, weights that hang from it, presses with known force,
// force-depth curves and stress-strain curves.
// Each kind of measurement is made of a material of its own stiffness: what takes part in the fit draws the estimate
// towards its own.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <set>

#include "capture/curves.hpp"
#include "capture/markers.hpp"
#include "estimation/fit.hpp"
#include "estimation/press_law.hpp"
#include "estimation/press_scene.hpp"
#include "estimation/recordings.hpp"
#include "geometry/primitives.hpp"
#include "input_errors.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"
#include "temporary_folder.hpp"

namespace pliant::all_measurements_test {
namespace {

using test::tolerance;

constexpr double length = 0.3, edge = 0.05, modulus = 1e5, poissons_ratio = 0.35, noise = 5e-4;
constexpr int frames = 12;
constexpr OptimiserOptions converged{.step_tolerance = 1e-7, .cost_tolerance = 1e-10};

/// How stiff the material is that a kind of measurement sees.
struct Truths {
  double depth = modulus, markers = modulus, loads = modulus, presses = modulus, indentations = modulus,
         curves = modulus;
};

/// What of the capture takes part.
struct Parts {
  bool depth = true, markers = true, loads = true, presses = true, indentations = true, curves = true;
};

/// A bar along x, clamped at its low end and let go straight.
class SeenInEveryWay : public ::testing::Test {
 protected:
  SeenInEveryWay() {
    capture_.name = "bar";
    capture_.file = folder_.path() / "capture.toml";
    capture_.scene.object.surface = make_box(Vector3(length, edge, edge), 0.0125);
    capture_.scene.object.surface_noise = 0.0;
    capture_.scene.object.density = 300.0;
    capture_.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
    for (int f = 0; f < frames; ++f) capture_.scene.timing.times.push_back(f / 30.0);
    capture_.scene.fixed = {{RegionBox{Vector3(-1, -1, -1), Vector3(-0.5 * length + 1e-4, 1, 1)}, {}}};
    DepthCamera camera;
    camera.name = "front";
    capture_.depth = {camera};
    for (double x = -0.1; x < 0.16; x += 0.05)
      for (const double z : {-0.02, 0.02}) markers_.emplace_back(x, 0.5 * edge, z);
    write("rest.csv", markers_);
  }

  void write(const std::string& name, const std::vector<Vector3>& places) const {
    MarkerPositions positions;
    positions.positions.resize(Eigen::Index(places.size()), 3);
    for (std::size_t m = 0; m < places.size(); ++m) {
      positions.ids.push_back(std::to_string(m));
      positions.positions.row(Eigen::Index(m)) = places[m].transpose();
    }
    write_marker_positions(folder_ / name, positions);
  }

  double draw() { return errs_ ? normal_(random_) : 0.0; }
  Vector3 error() { return noise * Vector3(draw(), draw(), draw()); }

  CaptureParameters parameters() const {
    return default_parameters(capture_, enclosed_volume(*capture_.scene.object.surface));
  }
  Discretisation discretised(const CaptureParameters& p, const VectorX& theta) const {
    Resolution resolution;
    resolution.cells = 10.0, resolution.follows_thickness = true;  // as fits are: an inverse crime
    if (capture_.scene.object.shape_is == ShapeIs::Static) resolution.element = ElementKind::Tetrahedron;
    return discretise(capture_, capture_distance(capture_, 0.2), resolution, p.blocks, theta);
  }

  void run(double youngs_modulus, bool at_rest, const std::vector<PointMass>& weights,
           const std::function<void(int, const Body&, const Points&)>& see) {
    const CaptureParameters p = parameters();
    VectorX theta = p.set.reference();
    p.blocks.motion.set_moduli(theta, youngs_modulus);
    const Discretisation d = discretised(p, theta);
    SimulationOptions options = d.simulation;
    options.loads = weights;  // hung since the scan was taken
    if (at_rest) options.is_static = true, options.times = {0.0};
    const RolloutSummary summary = Simulation(d.body, options).run(theta, [&](int frame, const State& state, auto) {
      see(frame, *d.body, state.x);
      return true;
    });
    ASSERT_TRUE(summary.succeeded) << summary.failure;
  }

  void record(const Truths& truths) {
    run(truths.depth, false, {}, [&](int frame, const Body& body, const Points& nodes) {
      const Points x = Embedding(body, capture_.scene.object.surface->vertices).positions(nodes);
      ObservedFrame seen;
      seen.frame = frame;
      for (Eigen::Index v = 0; v < x.rows(); ++v) {
        if (capture_.scene.object.surface->vertices[std::size_t(v)].z() < 0.0) continue;
        seen.points.push_back(Vector3(x.row(v)) + error());
        seen.noise.push_back(float(noise));
        seen.view.emplace_back(-Vector3::UnitZ());
        seen.camera.push_back(0);
        seen.pixel.push_back(-1);
      }
      observed_.push_back(std::move(seen));
    });
    std::vector<Points> track;
    std::vector<std::string> ids;
    for (std::size_t m = 0; m < markers_.size(); ++m) ids.push_back(std::to_string(m));
    run(truths.markers, false, {}, [&](int, const Body& body, const Points& nodes) {
      track.push_back(Embedding(body, markers_).positions(nodes));
      for (Eigen::Index m = 0; m < track.back().rows(); ++m) track.back().row(m) += error().transpose();
    });
    write_marker_track(folder_ / "track.csv", ids, track);
    const PointMass weight{Vector3(0.5 * length, -0.5 * edge, 0.0), 0.05};
    run(truths.loads, true, {weight}, [&](int, const Body& body, const Points& nodes) {
      const Points x = Embedding(body, markers_).positions(nodes);
      std::vector<Vector3> there;
      for (Eigen::Index m = 0; m < x.rows(); ++m) there.push_back(Vector3(x.row(m)) + error());
      write("load.csv", there);
    });
    record_press(truths.presses);
    record_indentation(truths.indentations);
    record_curve(truths.curves);
  }

  /// The same Poisson's ratio as where it moves.
  static VectorX numbers(const LawLayout& layout, double youngs_modulus) {
    VectorX theta = law_parameters(layout, youngs_modulus).reference();
    theta[layout.poissons_ratio()] = poissons_ratio;
    return theta;
  }

  void record_press(double youngs_modulus) {
    Press press;
    press.force = Vector3(0.0, -0.5, 0.0);
    press.contact_centre = Vector3(0.08, 0.5 * edge, 0.0);
    press.contact_radius = 0.015;
    press.markers = folder_ / "press.csv", press.markers_rest = folder_ / "rest.csv";
    write("press.csv", markers_);
    Capture pressed = capture_;
    pressed.presses = {press};
    Resolution resolution;
    resolution.cells = 10.0;
    resolution.element = ElementKind::Tetrahedron;
    std::vector<Vector3> control_points;
    const PressScene scene =
        make_press_scene(pressed, make_body_of(pressed.scene, SignedDistance(), resolution, control_points));
    const LawLayout layout({1, 0, 1, false, ElasticLaw::NeoHookean});
    const auto law = press_law(*scene.body, layout, numbers(layout, youngs_modulus));
    PressedBody body(scene, 0, law, youngs_modulus);
    ASSERT_TRUE(body.solve().converged) << body.equilibrium().failure();
    const Points x = body.points();
    std::vector<Vector3> there;
    for (Eigen::Index m = 0; m < Eigen::Index(markers_.size()); ++m) there.push_back(Vector3(x.row(m)) + error());
    write("press.csv", there);
    press_ = press;
  }

  void record_indentation(double youngs_modulus) {
    indentation_.contact = Vector3(-0.12, 0.5 * edge, 0.0);  // near the clamp: farther out the bar sags away from it
    indentation_.direction = -Vector3::UnitY();
    indentation_.radius = 0.02;
    indentation_.curve = folder_ / "depths.csv";
    write_force_curve(indentation_.curve, {{5e-3, 8e-3}, {1.0, 1.0}, {1.0, 1.0}});
    Capture tested = capture_;
    tested.indentations = {indentation_};
    Resolution resolution;
    resolution.cells = 10.0;
    resolution.element = ElementKind::Tetrahedron;
    std::vector<Vector3> control_points;
    const PressScene scene =
        make_press_scene(tested, make_body_of(tested.scene, SignedDistance(), resolution, control_points));
    const LawLayout layout({1, 0, 1, false, ElasticLaw::NeoHookean});
    const auto law = press_law(*scene.body, layout, numbers(layout, youngs_modulus));
    const CurvePrediction there = predict_curves(scene, law).front();
    ASSERT_EQ(there.failure, "");
    const double std = 0.01 * there.predicted.back();
    ForceCurve curve{there.at, there.predicted, {std, std}};
    for (double& force : curve.forces) force += std * draw();
    write_force_curve(indentation_.curve, curve);
  }

  void record_curve(double youngs_modulus) {
    curve_.curve = folder_ / "tension.csv";
    const LawLayout layout({1, 0, 1, false, ElasticLaw::NeoHookean});
    MaterialTest test;
    test.stretch = {0.97, 1.03, 1.05};
    test.stress = predict_test(*press_law(*unit_element(), layout, numbers(layout, youngs_modulus)), test);
    const double std = 0.01 * test.greatest_stress();
    for (double& stress : test.stress) stress += std * draw();
    write_stress_curve(curve_.curve, {test.stretch, {}, test.stress, {std, std, std}});
  }

  RecordedCapture recorded(const Parts& parts) const {
    RecordedCapture r{capture_, {}, {}};
    if (parts.depth) r.observed = observed_;
    if (parts.markers) r.capture.markers = {{folder_ / "rest.csv", folder_ / "track.csv"}};
    if (parts.loads) {
      Load load;
      load.mass = 0.05;
      load.at = Vector3(0.5 * length, -0.5 * edge, 0.0);
      load.markers = folder_ / "load.csv", load.markers_rest = folder_ / "rest.csv";
      r.capture.loads = {load};
    }
    if (parts.presses) r.capture.presses = {*press_};
    if (parts.indentations) r.capture.indentations = {indentation_};
    if (parts.curves) r.capture.material_curves = {curve_};
    return r;
  }

  /// Young's modulus [Pa] that fits best, everything else known.
  double estimate(const Parts& parts) const {
    std::vector<std::string> notes;
    FitOptions options;
    options.parameters["poissons_ratio"] = {VectorX::Constant(1, poissons_ratio), false, {}};
    for (const char* damping : {"mass_damping", "stiffness_damping"}) options.parameters[damping].estimated = false;
    options.marker_noise = noise;
    const Recordings recordings({recorded(parts)}, options, notes);
    ParameterSet set = recordings.parameters();
    VectorX start = set.reference();
    recordings.material().set_moduli(start, 1.2 * modulus);
    set.set_reference(start);
    Objective objective =
        recordings.objective(recordings.grid(10.0, 1.0), set, {0.2, [](const Recording& r) { return r.last_frame; }});
    const OptimiserSummary s = minimise(objective, set.to_unconstrained(start), converged);
    EXPECT_TRUE(s.succeeded) << s.reason;
    return set.to_theta(s.p)[recordings.material().youngs_moduli.front()];
  }

  test::TemporaryFolder folder_;
  Capture capture_;
  std::vector<Vector3> markers_;
  std::vector<ObservedFrame> observed_;
  std::optional<Press> press_;
  Indentation indentation_;
  MaterialCurve curve_;
  std::mt19937 random_{4};
  std::normal_distribution<double> normal_;
  bool errs_ = true;  // measurements have errors
};

/// Motion, weight, press, curves and a scan that sags are all of one law: none of them leaves a residual where one
/// material made them all. Distances to the surface are as exact as it is sampled; the others, as files keep digits.
TEST_F(SeenInEveryWay, ResidualsOfAllMeasurementsOfOneMaterialAreZeroAtTheTruth) {
  errs_ = false;
  record({});
  RecordedCapture moving = recorded({});
  observed_.clear();
  capture_.name = "sagging bar";
  capture_.scene.object.shape_is = ShapeIs::Static;
  const PointMass weight{Vector3(0.5 * length, -0.5 * edge, 0.0), 0.05};
  run(modulus, true, {weight}, [&](int, const Body& body, const Points& nodes) {
    const Points x = Embedding(body, markers_).positions(nodes);
    std::vector<Vector3> there;
    for (Eigen::Index m = 0; m < x.rows(); ++m) there.push_back(Vector3(x.row(m)));
    EXPECT_GT((there.back() - markers_.back()).norm(), 0.01);
    write("sagging.csv", there);
  });
  RecordedCapture sagging = recorded({false, false, true, false, false, false});
  sagging.capture.loads.front().markers = folder_ / "sagging.csv";
  for (const RecordedCapture& r : {moving, sagging}) {
    std::vector<std::string> notes;
    FitOptions options;
    options.marker_noise = noise;
    options.parameters["poissons_ratio"] = {VectorX::Constant(1, poissons_ratio), false, {}};
    if (r.capture.scene.object.shape_is == ShapeIs::Static) options.element = ElementKind::Tetrahedron;
    const Recordings recordings({r}, options, notes);
    ParameterSet set = recordings.parameters();
    VectorX truth = set.reference();
    recordings.material().set_moduli(truth, modulus);
    set.set_reference(truth);
    Objective objective = recordings.objective(recordings.grid(10.0, 1.0), set,
                                               {0.2, [](const Recording& all) { return all.last_frame; }});
    const CostEvaluation e = objective.linearise(set.to_unconstrained(truth));
    ASSERT_TRUE(e.succeeded) << e.failure;
    std::set<int> trials;
    for (const FrameFit& frame : e.frames) {
      const double of_noise = frame.points > 0 ? 0.01 : 1e-3;  // root mean square residual
      EXPECT_LT(frame.cost, 0.5 * of_noise * of_noise * std::max(1.0, frame.independent))
          << r.capture.name << ", trial " << frame.recording << ", frame " << frame.frame;
      trials.insert(frame.recording);
    }
    EXPECT_EQ(trials.size(), r.capture.presses.empty() ? 1u : 4u) << r.capture.name;  // curves share a number
  }
}

/// Whichever is named first, what the motion alone tells is estimated, and both take part.
TEST_F(SeenInEveryWay, StaticTestsOfACaptureOfTheirOwnAreFittedBesideAMotion) {
  record({});
  const RecordedCapture moving = recorded({true, false, false, false, false, false});
  RecordedCapture pressed = recorded({false, false, false, true, true, true});
  pressed.capture.scene.timing = {};
  pressed.capture.depth.clear();
  pressed.observed.clear();
  FitOptions options;
  options.cells = options.coarse_cells = 6.0, options.starts = options.most_starts = 1, options.budget = 0.0;
  options.alternatives = false;
  for (const auto& both : {std::vector{moving, pressed}, std::vector{pressed, moving}}) {
    const FitOutcome outcome = fit(both, options);
    ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
    EXPECT_FALSE(outcome.law);
    EXPECT_EQ(outcome.recordings.size(), 2u);
    EXPECT_TRUE(outcome.parameters.find("stiffness_damping")->estimated);
    EXPECT_NEAR(outcome.theta[outcome.parameters.find("youngs_modulus")->at] / modulus, 1.0, tolerance(0.1));
    int of_motion = 0, of_tests = 0;
    for (const FrameFit& frame : outcome.evaluation.frames) ++(frame.points > 0 ? of_motion : of_tests);
    EXPECT_EQ(of_motion, frames);
    EXPECT_GE(of_tests, 3);
  }
}

TEST_F(SeenInEveryWay, OneMaterialIsFoundByAllMeasurementsTogetherAndByEach) {
  record({});
  EXPECT_NEAR(estimate({}) / modulus, 1.0, tolerance(0.03));
  EXPECT_NEAR(estimate({true, false, false, false, false, false}) / modulus, 1.0, tolerance(0.05));
  EXPECT_NEAR(estimate({false, true, false, false, false, false}) / modulus, 1.0, tolerance(0.05));
  EXPECT_NEAR(estimate({false, false, true, false, false, false}) / modulus, 1.0, tolerance(0.05));
}

TEST_F(SeenInEveryWay, EachKindOfMeasurementDrawsTheEstimateToItsOwnStiffness) {
  const std::vector<std::pair<const char*, double Truths::*>> kinds = {
      {"depth", &Truths::depth},     {"markers", &Truths::markers},           {"loads", &Truths::loads},
      {"presses", &Truths::presses}, {"indentations", &Truths::indentations}, {"curves", &Truths::curves}};
  const std::vector<bool Parts::*> parts = {&Parts::depth,   &Parts::markers,      &Parts::loads,
                                            &Parts::presses, &Parts::indentations, &Parts::curves};
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    Truths truths;
    truths.*kinds[k].second = 1.5 * modulus;
    observed_.clear();
    record(truths);
    Parts without;
    without.*parts[k] = false;
    const double all = estimate({}), others = estimate(without);
    EXPECT_NEAR(others / modulus, 1.0, tolerance(0.04)) << kinds[k].first;
    // The least share is that of one press beside two sagging motions; the optimiser comes within 1e-7.
    EXPECT_GT(all, (1.0 + 1e-4) * others) << kinds[k].first << " stiffer than the rest takes no part";
  }
}

/// What stands beside a motion is of the motion's law.
TEST_F(SeenInEveryWay, PressesAndLoadsBesideAMotionFollowItsLaw) {
  record({});
  std::vector<std::string> notes;
  FitOptions options;
  options.material = MaterialKind::Ogden;
  options.marker_noise = noise;
  const Recordings recordings({recorded({false, true, true, true})}, options, notes);
  ParameterSet set = recordings.parameters();
  const Parameter* exponent = set.find("exponent_1");
  ASSERT_TRUE(exponent && exponent->estimated);
  VectorX theta = set.reference();
  recordings.material().set_moduli(theta, modulus);
  set.set_reference(theta);
  const Grid grid = recordings.grid(4.0, 1.0);
  EXPECT_EQ(grid.recording.front().body->kind, ElementKind::QuadraticTetrahedron);
  EXPECT_EQ(grid.presses.front()->body, grid.recording.front().body);
  Objective objective = recordings.objective(grid, set, {0.2, [](const Recording&) { return 2; }});
  const VectorX p = set.to_unconstrained(theta);
  const CostEvaluation e = objective.linearise(p);
  ASSERT_TRUE(e.succeeded) << e.failure;
  const Eigen::Index at = set.coordinate(exponent->at);
  ASSERT_GE(e.frames.size(), 4u);
  for (const FrameFit& frame : e.frames)  // nothing is strained yet in the first
    if (frame.recording > 0 || frame.frame > 0) {
      EXPECT_NE(frame.gradient[at], 0.0) << frame.recording;
    }
  const auto cost = [&](double h) {
    return VectorX(VectorX::Constant(1, objective.evaluate(p + h * VectorX::Unit(p.size(), at)).cost));
  };
  EXPECT_LT(test::best_relative_error(cost, VectorX::Constant(1, e.gradient[at]), 0.1), tolerance(1e-4));
}

TEST_F(SeenInEveryWay, WhatDoesNotSuitALawIsRefused) {
  record({});
  const auto refusal = [&](const FitOptions& options) {
    return test::complaint_of([&] {
      std::vector<std::string> notes;
      (void)Recordings({recorded({})}, options, notes);
    });
  };
  FitOptions options;
  options.material = MaterialKind::Sampled;
  EXPECT_THAT(refusal(options), ::testing::HasSubstr("presses alone"));
  options.material = MaterialKind::Ogden;
  options.element = ElementKind::Hexahedron;
  EXPECT_THAT(refusal(options), ::testing::HasSubstr("quadratic_tetrahedra"));
}

/// The numbers of the law belong to the object: two recordings share them.
TEST_F(SeenInEveryWay, RecordingsOfOneObjectShareTheLaw) {
  record({});
  FitOptions options;
  options.material = MaterialKind::Ogden;
  options.law_terms = 2;
  const JointLayout joint = joint_layout({recorded({}), recorded({})}, options, 1);
  for (const char* name : {"exponent_1", "exponent_2", "stiffness_ratio_2"}) {
    EXPECT_TRUE(joint.layout.contains(name));
    EXPECT_FALSE(joint.layout.contains(std::string(name) + "[2]"));
  }
  for (const CaptureBlocks& blocks : joint.blocks) {
    ASSERT_TRUE(blocks.law);
    EXPECT_EQ(blocks.law->all(), joint.blocks.front().law->all());
    EXPECT_EQ(blocks.law->modulus(0), blocks.motion.youngs_moduli.front());
    EXPECT_EQ(blocks.law->exponent(1), joint.layout.at("exponent_2"));
  }
}

}  // namespace
}  // namespace pliant::all_measurements_test
