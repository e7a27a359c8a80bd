// A known weight that is let go: pascals follow from it, though nobody weighed the object.
#include <Eigen/LU>

#include "estimation/objective.hpp"
#include "estimation/optimiser.hpp"
#include "estimation/problem.hpp"
#include "geometry/primitives.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::cut_string_test {
namespace {

using test::tolerance;

constexpr double length = 0.1, edge = 0.02;

/// A bar held at one end, of unknown modulus and density, every node followed while it swings from its sag under a
/// weight. Made by the elements that fit it: an inverse crime on purpose.
struct CutString {
  explicit CutString(double mass) {
    body = std::make_shared<Body>(make_body(make_tet_box(test::centred_box({length, edge, edge}), {6, 2, 2}, false)));
    for (int f = 0; f < 12; ++f) options.times.push_back(f / 60.0);
    options.max_dt = 1.0 / 120.0 + 1e-9;
    options.solver.tolerance = 1e-13;
    options.newton.tolerance = 1e-13;
    options.holds = {{[](const Vector3& p) { return p.x() < -length + 1e-6; }}};
    options.released_weights = {{Vector3(length, 0, 0), mass}};
    options.blocks = layout;
    layout.set_moduli(truth, 8e4);
    truth[layout.poissons_ratio] = 0.35;
    truth[layout.mass_damping] = 0.5;
    truth[layout.stiffness_damping] = 2e-3;
    truth[layout.density] = 700.0;
    truth.segment<3>(layout.gravity) = Vector3(0, -9.81, 0);
    std::vector<Vector3> rest;
    for (int n = 0; n < body->node_count(); ++n) rest.push_back(body->nodes.row(n).transpose());
    tracks = std::make_shared<PointTracks>(*body, rest);
    auto frames = std::make_shared<std::vector<FrameObservations>>();
    Simulation simulation(body, options);
    const RolloutSummary summary = simulation.run(truth, [&](int frame, const State& state, auto) {
      FrameObservations one{frame};
      for (int n = 0; n < body->node_count(); ++n) one.tracks.push_back({n, Vector3(state.x.row(n)), 1e-3});
      frames->push_back(std::move(one));
      return true;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    seen = frames;
    VectorX start = truth;
    layout.scale_moduli(start, 1.6), start[layout.density] *= 1.3;
    parameters =
        ParameterSet(layout.layout(),
                     {{"youngs_modulus", "Pa", Transform::Logarithm, layout.youngs_moduli[0], 1.0, 1.0, 1e9, true},
                      {"density", "kg/m^3", Transform::Logarithm, layout.density, 1.0, 1.0, 1e5, true}},
                     start);
  }
  Objective objective() const {
    ObjectiveOptions o;
    o.outlier_scale = 0.1;
    o.last_frame = int(options.times.size()) - 1;
    return {{nullptr, tracks}, body, options, seen, parameters, o};
  }
  /// Of ln E and ln rho, at the truth.
  double correlation() const {
    Objective o = objective();
    const MatrixX H = o.linearise(parameters.to_unconstrained(truth)).gauss_newton;
    return -H(0, 1) / std::sqrt(H(0, 0) * H(1, 1));
  }

  std::shared_ptr<const Body> body;
  MotionLayout layout;
  SimulationOptions options;
  VectorX truth = layout.zero();
  std::shared_ptr<const PointTracks> tracks;
  std::shared_ptr<const std::vector<FrameObservations>> seen;
  ParameterSet parameters;
};

TEST(CutString, AnchorsModulusAndDensity) {
  const CutString scene(0.1);
  Objective objective = scene.objective();
  OptimiserOptions options;
  options.max_iterations = 40;
  options.cost_tolerance = 1e-8;
  const OptimiserSummary summary =
      minimise(objective, scene.parameters.to_unconstrained(scene.parameters.reference()), options);
  ASSERT_TRUE(summary.succeeded && summary.converged) << summary.reason;
  const VectorX found = scene.parameters.to_theta(summary.p);
  for (const ParameterHandle& estimated : {scene.layout.youngs_moduli[0], scene.layout.density})
    EXPECT_NEAR(found[estimated] / scene.truth[estimated], 1.0, tolerance(1e-3));
  EXPECT_LT(scene.correlation(), 0.95);
  EXPECT_GT(CutString(1e-7).correlation(), 0.99999) << "nothing tells them apart but the weight";
}

/// A bar of which a capture knows that it hangs under a weight until the start.
struct ReleasedCapture : ::testing::Test {
  ReleasedCapture() {
    capture.scene.object.surface = make_box(Vector3(2 * length, 2 * edge, 2 * edge), edge);
    capture.scene.object.surface_noise = 0.0;
    capture.scene.world.gravity = Vector3(0, -9.81, 0);
    capture.scene.fixed = {{RegionHalfSpace{{-0.9 * length, 0, 0}, {-1, 0, 0}}, std::nullopt}};
    capture.scene.timing.times = {0.0, 0.1};
    capture.scene.initial.released = true;
    capture.scene.initial.release_of = Weight{0.02, Vector3(length, 0, 0)};
  }
  Capture capture;
};

TEST_F(ReleasedCapture, HasTheWeightAndNoPulls) {
  Resolution resolution;
  EXPECT_EQ(pull_count(capture.scene, resolution), 0);
  const auto [parameters, blocks] = default_parameters(capture, 1e-4);
  const Discretisation d =
      discretise(capture, capture_distance(capture, resolution.band), resolution, blocks, parameters.reference());
  EXPECT_TRUE(d.simulation.blocks.pulls.empty());
  EXPECT_TRUE(d.simulation.weights.empty()) << "it is gone while the object moves";
  ASSERT_EQ(d.simulation.released_weights.size(), 1u);
  EXPECT_EQ(d.simulation.released_weights[0].mass, 0.02);
  EXPECT_EQ(d.simulation.released_weights[0].at, Vector3(length, 0, 0));
  capture.scene.initial.release_of.reset();
  EXPECT_EQ(pull_count(capture.scene, resolution), resolution.pulls);
}

TEST_F(ReleasedCapture, EstimatesTheDensityOnlyWhereNobodyKnowsIt) {
  const auto is_estimated = [](const Capture& c) {
    const ParameterSet parameters = default_parameters(c, 1e-4).set;
    for (const Parameter& p : parameters.parameters())
      if (p.name == "density") return p.estimated;
    return false;
  };
  EXPECT_TRUE(is_estimated(capture));
  Capture weighed = capture;
  weighed.scene.object.mass = 0.1;
  EXPECT_FALSE(is_estimated(weighed));
  capture.scene.initial.release_of.reset();
  EXPECT_FALSE(is_estimated(capture));
}

}  // namespace
}  // namespace pliant::cut_string_test
