// A fit's model, written and simulated, moves as the fit does.
#include "output/fitted_model.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <optional>

#include "estimation/scan_errors.hpp"
#include "simulation/model_simulation.hpp"
#include "support/dropped.hpp"

namespace pliant::fitted_model_test {
namespace {

double mass_of(const Body& body) { return std::accumulate(body.mass.begin(), body.mass.end(), 0.0); }

/// A block that is held, or falls, as a fit with its surface off the scan has it, and the model of that.
class FittedModels : public testing::TestWithParam<std::tuple<bool, bool>> {};

TEST_P(FittedModels, MoveAsTheFitDidWhereItsSurfaceIsOffTheScan) {
  const auto [is_weighed, is_held] = GetParam();
  test::Dropped dropped;
  dropped.frames = 12;
  dropped.change = [&](Scene& scene) {
    if (is_held) scene.fixed = {{RegionHalfSpace{Vector3(0.0, 0.21, 0.0), Vector3::UnitY()}, {}}};
  };
  RecordedCapture recorded = dropped.record();
  Object& object = recorded.capture.scene.object;
  object.surface_noise = 0.002;
  if (is_weighed) object.mass = 0.35, object.density.reset();
  std::vector<std::string> notes;
  const FitOptions options = test::six_cells();
  const Recordings recordings({recorded}, options, notes);
  ModelChange change;
  change.scan_errors.assign(ScanErrors::count, 0.0);
  change.scan_errors[0] = 1.5, change.scan_errors[3] = -1.0, change.scan_errors[7] = 2.0;
  const Grid grid = recordings.grid(6.0, 1.0, change);
  const Discretisation& d = grid.recording.front();
  VectorX theta = recordings.parameters().reference();
  d.simulation.blocks.set_moduli(theta, test::Dropped::youngs_modulus);
  const Model model =
      make_model(recorded.capture, d, theta, modulus_statistics(d.body, d.simulation.blocks, theta, {}), 6.0);
  const ModelScene made = make_scene(model);

  ASSERT_EQ(made.body->node_count(), d.body->node_count());
  EXPECT_LT((made.body->reference_positions() - d.body->reference_positions()).norm(), 1e-9);
  EXPECT_NEAR(made.body->volume(), d.body->volume(), 1e-9 * d.body->volume());
  const double of_fit = theta[d.simulation.blocks.density] * mass_of(*d.body);
  EXPECT_NEAR(made.theta[made.simulation.blocks.density] * mass_of(*made.body), of_fit, 1e-9 * of_fit);
  if (is_weighed) {
    EXPECT_NEAR(of_fit, 0.35, 0.01 * 0.35) << "as heavy as the capture says";
  }
  const auto end = [](const std::shared_ptr<const Body>& body, const SimulationOptions& simulation, const VectorX& at) {
    Points last;
    const RolloutSummary summary = Simulation(body, simulation).run(at, [&](int, const State& state, auto) {
      last = state.x;
      return true;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    return last;
  };
  const Points fit = end(d.body, d.simulation, theta), own = end(made.body, made.simulation, made.theta);
  EXPECT_GT((fit - d.body->reference_positions()).cwiseAbs().maxCoeff(), 1e-3) << "it moves";
  EXPECT_LT((own - fit).cwiseAbs().maxCoeff(), 1e-7);

  // Off the surface of its scan it is another body than on it.
  const Grid on_scan = recordings.grid(6.0, 1.0);
  EXPECT_GT(std::abs(on_scan.recording.front().body->volume() / d.body->volume() - 1.0), 0.01);
}

INSTANTIATE_TEST_SUITE_P(Weighed, FittedModels, testing::Combine(testing::Bool(), testing::Bool()));

}  // namespace
}  // namespace pliant::fitted_model_test
