// Fits of what cameras without depth saw: the outlines of masks alone.
#include <gtest/gtest.h>

#include <numbers>

#include "estimation/verdict.hpp"
#include "support/derivatives.hpp"
#include "support/dropped.hpp"
#include "support/tolerance.hpp"

namespace pliant::silhouettes_test {
namespace {

using test::tolerance;

SilhouetteCamera camera_at(const std::string& name, const Vector3& eye) {
  SilhouetteCamera camera;
  camera.name = name;
  camera.camera = look_at(eye, {0.0, 0.12, 0.0}, Vector3::UnitY(), 320, 240, 40.0 * std::numbers::pi / 180.0);
  return camera;
}

/// Seen from two sides, as sharply as pixels allow.
test::Dropped dropped_before_two() {
  test::Dropped dropped;
  dropped.silhouettes = {camera_at("left", {-0.3, 0.3, 0.7}), camera_at("right", {0.75, 0.15, 0.2})};
  return dropped;
}

TEST(Silhouettes, HaveTheGradientOfTheirCostByTangentsAndByTheAdjoint) {
  test::Dropped dropped = dropped_before_two();
  dropped.frames = 14, dropped.cells = 6.0;
  FitOptions options = test::six_cells();
  options.solver_tolerance = 1e-11;  // derivatives are solved for a thousand times less closely
  std::vector<std::string> notes;
  const Recordings recordings({dropped.record()}, options, notes);
  ASSERT_EQ(sensor_names(recordings.front().capture), (std::vector<std::string>{"left", "right"}));
  const Grid grid = recordings.grid(6.0, 4.0);
  const ParameterSet& parameters = recordings.parameters();
  ASSERT_TRUE(parameters.find("sensor_turn@left")->estimated);
  ASSERT_EQ(parameters.find("range_error@left"), nullptr) << "a picture has no range";
  ASSERT_TRUE(parameters.find("outline_error@left")->estimated);
  Objective objective = recordings.objective(grid, parameters, {0.1, [](const Recording&) { return 13; }});
  VectorX p = parameters.to_unconstrained(parameters.reference()), direction(p.size());
  for (Eigen::Index i = 0; i < p.size(); ++i)
    p[i] += 0.01 * std::sin(1.0 + double(i)), direction[i] = std::cos(3.0 * double(i));
  const CostEvaluation by_tangents = objective.linearise(p), by_adjoint = objective.gradient(p);
  ASSERT_TRUE(by_tangents.succeeded && by_adjoint.succeeded) << by_tangents.failure << by_adjoint.failure;
  EXPECT_GT(by_tangents.matched_fraction(), 0.9);
  EXPECT_GT(by_tangents.outline_rms(), 0.0);
  EXPECT_EQ(by_tangents.outline_rms(), by_tangents.surface_rms()) << "nothing else was seen";
  const VectorX& g = by_tangents.gradient;
  ASSERT_GT(g.norm(), 0.0);
  EXPECT_LT((by_adjoint.gradient - g).norm(), tolerance(1e-6) * g.norm());
  const auto along = [&](double h) { return VectorX::Constant(1, objective.evaluate(p + h * direction).cost); };
  // Kinks where rays change edges cost a few digits.
  const VectorX slope = VectorX::Constant(1, g.dot(direction));
  const double error = test::best_relative_error(along, slope, 0.1, 5);
  RecordProperty("error", std::to_string(error));
  EXPECT_LT(error, tolerance(2e-3));
  EXPECT_GT(test::best_relative_error(along, 1.1 * slope, 0.01, 2), 2e-2) << "a wrong derivative would pass";
}

/// An inverse crime: made on the mesh that it is fitted with. On a finer one these coarse meshes alone put the modulus
/// off by a tenth, up or down.
TEST(Silhouettes, AloneTellHowStiffAFallingBlockIs) {
  test::Dropped dropped = dropped_before_two();
  dropped.cells = 6.0;
  const FitOutcome outcome = fit({dropped.record()}, test::six_cells());
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  const double modulus = test::value(outcome, "youngs_modulus");
  RecordProperty("youngs_modulus", std::to_string(modulus));
  EXPECT_NEAR(modulus, dropped.youngs_modulus, 0.1 * dropped.youngs_modulus);
  EXPECT_GT(outcome.evaluation.matched_fraction(), 0.95);
  EXPECT_LT(outcome.evaluation.outline_rms(), 2e-3);
  EXPECT_NE(outcome.verdict.kind, Verdict::Kind::Unexplained);
}

}  // namespace
}  // namespace pliant::silhouettes_test
