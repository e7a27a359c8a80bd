// A recording's wind and applied forces as unknowns: derivatives through the whole chain, and what is found of them.
#include <cmath>

#include "estimation/objective.hpp"
#include "estimation/optimiser.hpp"
#include "estimation/problem.hpp"
#include "geometry/primitives.hpp"
#include "simulation/scene_simulation.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::loads_test {
namespace {

using test::tolerance;

/// A light plate held at one end, in a wind that turns and under a push, every node followed. Made by the model that
/// fits it: an inverse crime on purpose.
struct BlownPlate {
  BlownPlate() {
    Scene& scene = capture.scene;
    scene.object.surface = make_box({0.2, 0.02, 0.1}, 0.05);
    scene.object.surface_noise = 0.0;
    scene.object.mass = 0.03;
    scene.world.gravity = Vector3(0.0, -9.81, 0.0);
    scene.timing = evenly_timed(60.0, 16);
    scene.fixed = {{RegionHalfSpace{{-0.099, 0, 0}, {-1, 0, 0}}, std::nullopt}};
    WindFacts& wind = scene.wind.emplace();
    wind.over_time = {{0.0, {0.0, -4.0, 1.0}}, {0.2, {0.0, -6.0, 3.0}}};
    wind.velocity = {0.0, -5.0, 2.0};
    wind.gust_intensity = 0.1, wind.known = false;
    AppliedForce& force = scene.forces.emplace_back();
    force.at = {0.09, 0.01, 0.04}, force.radius = 0.02, force.known = false;
    force.force = {{0.05, Vector3::Zero()}, {0.12, {0.0, 0.05, 0.0}}};

    body = test::tet_body({0.2, 0.02, 0.1}, {5, 1, 3}, true, 0.0);
    CaptureParameters all = default_parameters(capture, body->volume());
    blocks = all.blocks.motion;
    truth = all.set.reference();
    blocks.set_moduli(truth, 4e4);
    truth.segment<3>(blocks.wind) = Vector3(0.0, -5.0, 2.0);
    truth[blocks.strengths[0]] = 1.0;
    SimulationOptions settings;
    settings.solver.tolerance = 1e-13;
    options = make_simulation(scene, *body, {}, blocks, truth, settings);

    std::vector<Vector3> rest;
    for (int n = 0; n < body->node_count(); ++n) rest.push_back(body->nodes.row(n).transpose());
    tracks = std::make_shared<PointTracks>(*body, rest);
    auto frames = std::make_shared<std::vector<FrameObservations>>();
    (void)Simulation(body, options).run(truth, [&](int frame, const State& state, auto) {
      FrameObservations seen{frame};
      for (int n = 0; n < body->node_count(); ++n) seen.tracks.push_back({n, Vector3(state.x.row(n)), 1e-3});
      frames->push_back(std::move(seen));
      return true;
    });
    observations = frames;

    parameters = all.set;
    for (const Parameter& p : all.set.parameters())
      parameters.set_estimated(p.name, p.name == "youngs_modulus" || p.name == "wind" || p.name == "strength@1");
    VectorX start = truth;
    blocks.set_moduli(start, 5.5e4);
    start.segment<3>(blocks.wind) = Vector3(0.5, -3.5, 1.0);
    start[blocks.strengths[0]] = 0.5;
    parameters.set_reference(start);
  }
  Objective objective() const {
    ObjectiveOptions o;
    o.outlier_scale = 0.1;
    o.last_frame = int(options.times.size()) - 1;
    return {{nullptr, tracks}, body, options, observations, parameters, o};
  }
  VectorX start() const { return parameters.to_unconstrained(parameters.reference()); }

  Capture capture;
  std::shared_ptr<const Body> body;
  MotionBlocks blocks;
  SimulationOptions options;
  VectorX truth;
  std::shared_ptr<const PointTracks> tracks;
  std::shared_ptr<const std::vector<FrameObservations>> observations;
  ParameterSet parameters;
};

TEST(UnknownLoads, AreEstimatedWhereTheCaptureSaysSo) {
  BlownPlate plate;
  const auto is_estimated = [&](const char* name) {
    return default_parameters(plate.capture, plate.body->volume()).set.find(name)->estimated;
  };
  EXPECT_TRUE(is_estimated("wind"));
  EXPECT_TRUE(is_estimated("strength@1"));
  plate.capture.scene.wind->known = plate.capture.scene.forces[0].known = true;
  EXPECT_FALSE(is_estimated("wind"));
  EXPECT_FALSE(is_estimated("strength@1"));
}

TEST(UnknownLoads, HaveTheGradientOfCentralDifferences) {
  const BlownPlate plate;
  Objective objective = plate.objective();
  const VectorX p = plate.start();
  ASSERT_EQ(p.size(), 5);
  const CostEvaluation by_tangents = objective.linearise(p), by_adjoint = objective.gradient(p);
  ASSERT_TRUE(by_tangents.succeeded && by_adjoint.succeeded) << by_tangents.failure << by_adjoint.failure;
  const double greatest = by_tangents.gradient.cwiseAbs().maxCoeff();
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    EXPECT_NEAR(by_adjoint.gradient[i], by_tangents.gradient[i], tolerance(1e-7) * greatest) << i;
    const auto along = [&](double h) -> VectorX {
      return VectorX::Constant(1, objective.evaluate(p + h * VectorX::Unit(p.size(), i)).cost);
    };
    EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, by_tangents.gradient[i]), 0.1), tolerance(1e-5))
        << i;
  }
}

TEST(UnknownLoads, AreFoundWithTheModulus) {
  const BlownPlate plate;
  Objective objective = plate.objective();
  OptimiserOptions options;
  options.cost_tolerance = 1e-8;
  options.max_iterations = 60;
  const OptimiserSummary summary = minimise(objective, plate.start(), options);
  ASSERT_TRUE(summary.converged) << summary.reason;
  const VectorX found = plate.parameters.to_theta(summary.p);
  const MotionBlocks& b = plate.blocks;
  EXPECT_NEAR(found[b.youngs_moduli[0]] / plate.truth[b.youngs_moduli[0]], 1.0, tolerance(0.01));
  EXPECT_NEAR(found[b.strengths[0]], 1.0, tolerance(0.02));
  EXPECT_LT((b.wind.vector(found) - b.wind.vector(plate.truth)).norm(), tolerance(0.1));
}

}  // namespace
}  // namespace pliant::loads_test
