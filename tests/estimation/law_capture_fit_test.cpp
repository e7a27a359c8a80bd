// Laws found from captures of motion by the fit that the command line makes, and the models that it leaves behind.
#include <gmock/gmock.h>

#include <random>

#include "estimation/fit.hpp"
#include "geometry/primitives.hpp"
#include "output/fit_output.hpp"
#include "simulation/model_simulation.hpp"
#include "temporary_folder.hpp"

namespace pliant::law_capture_fit_test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr double length = 0.2, edge = 0.05, modulus = 2e4, nu = 0.3, exponent = 9.0, noise = 1e-4;
constexpr int frames = 12;

/// A bar along x that is held at its low end and thrown along and across: it is stretched and compressed as it swings.
Capture thrown_bar() {
  Capture capture;
  capture.name = "bar";
  capture.scene.object.surface = make_box(Vector3(length, edge, edge), 0.025);
  capture.scene.object.surface_noise = 0.0;
  capture.scene.object.density = 100.0;
  capture.scene.world.gravity = Vector3(0.0, -9.81, 0.0);
  for (int f = 0; f < frames; ++f) capture.scene.timing.times.push_back(0.008 * f);
  capture.scene.fixed = {{RegionBox{Vector3(-1, -1, -1), Vector3(-0.5 * length + 1e-4, 1, 1)}, {}}};
  capture.scene.initial.linear_velocity = Vector3(0.8, 1.2, 0.0);
  capture.scene.initial.known = true;
  capture.markers = {{{"rest.csv"}, {"track.csv"}}};
  return capture;
}

FitOptions quick(MaterialKind material) {
  FitOptions options;
  options.budget = 0.0;
  options.material = material;
  options.element = ElementKind::QuadraticTetrahedron;
  options.cells = options.coarse_cells = 5.0;
  options.steps = 0.45;
  options.correct = false;
  options.parameters["youngs_modulus"].start = VectorX::Constant(1, 0.7 * modulus);
  return options;
}

/// As it moves when it is made of a law, on a finer mesh and with shorter steps than it is fitted with.
RecordedCapture recorded(const FitOptions& of) {
  RecordedCapture made{thrown_bar(), {}, TrackedPoints{}};
  const Capture& capture = made.capture;
  const CaptureParameters p =
      default_parameters(capture, enclosed_volume(*capture.scene.object.surface), 1, 0, 0, of.law_of_motion());
  VectorX theta = p.set.reference();
  p.blocks.motion.set_moduli(theta, modulus);
  theta[p.blocks.motion.poissons_ratio] = nu;
  theta[p.blocks.motion.mass_damping] = 0.2;
  theta[p.blocks.motion.stiffness_damping] = 2e-4;
  if (p.blocks.law) theta[p.blocks.law->exponent(0)] = exponent;
  Resolution resolution;
  resolution.element = ElementKind::QuadraticTetrahedron;
  resolution.cells = 8.0, resolution.steps = 1.8;
  const Discretisation d = discretise(capture, capture_distance(capture, 0.2), resolution, p.blocks, theta);
  for (const double x : {-0.05, 0.0, 0.05, 0.1})
    for (const double y : {-0.5 * edge, 0.5 * edge})
      for (const double z : {-0.5 * edge, 0.5 * edge}) made.followed->rest.emplace_back(x, y, z);
  const Embedding points(*d.body, made.followed->rest);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  const RolloutSummary summary = Simulation(d.body, d.simulation).run(theta, [&](int f, const State& state, auto) {
    for (int i = 0; i < points.point_count(); ++i)
      made.followed->frames[f].push_back(
          {i, points.position(i, state.x) + noise * Vector3(normal(random), normal(random), normal(random)), noise});
    return true;
  });
  EXPECT_TRUE(summary.succeeded) << summary.failure;
  return made;
}

double value(const FitOutcome& outcome, const char* name) { return outcome.theta[outcome.parameters.find(name)->at]; }

/// The model that a fit leaves behind, read back, moves as the estimate does.
void expect_same_motion(const RecordedCapture& seen, const FitOutcome& outcome, const std::string& law) {
  const test::TemporaryFolder folder;
  save_model(folder.path(), make_model(seen.capture, outcome));
  const Model model = load_model(folder / "model.toml");
  EXPECT_EQ(model.law ? model.law->name : "", law);
  const ModelScene scene = make_scene(model);
  const auto positions = [&](const std::shared_ptr<const Body>& body, const SimulationOptions& options,
                             const VectorX& theta) {
    const Embedding points(*body, seen.followed->rest);
    Points there;
    const auto summary = Simulation(body, options).run(theta, [&](int, const State& state, auto) {
      return there = points.positions(state.x), true;
    });
    EXPECT_TRUE(summary.succeeded) << summary.failure;
    return there;
  };
  const Discretisation& d = outcome.recordings.front().discretisation;
  const Points by_model = positions(scene.body, scene.simulation, scene.theta),
               by_estimate = positions(d.body, d.simulation, outcome.theta);
  EXPECT_LT((by_model - by_estimate).rowwise().norm().maxCoeff(), 1e-5);
}

TEST(LawCaptureFit, FindsOgdensLaw) {
  const RecordedCapture seen = recorded(quick(MaterialKind::Ogden));
  const FitOutcome outcome = fit({seen}, quick(MaterialKind::Ogden));
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_TRUE(outcome.converged) << outcome.reason;
  EXPECT_EQ(outcome.recordings.front().discretisation.body->kind, ElementKind::QuadraticTetrahedron);
  EXPECT_NEAR(value(outcome, "youngs_modulus"), modulus, 0.03 * modulus);
  EXPECT_NEAR(value(outcome, "poissons_ratio"), nu, 0.03);
  EXPECT_NEAR(value(outcome, "exponent_1"), exponent, 0.1 * exponent);
  EXPECT_THAT(outcome.notes, Contains(HasSubstr("Ogden's law of 1 term")));
  expect_same_motion(seen, outcome, "ogden");
  const Result result = make_result({seen}, outcome, {});
  ASSERT_TRUE(result.find("exponent_1"));
  EXPECT_TRUE(result.find("exponent_1")->std);
  // A linear material cannot do the same.
  EXPECT_GT(fit({seen}, quick(MaterialKind::Linear)).final_cost, 1.5 * outcome.final_cost);
}

TEST(LawCaptureFit, FindsANeoHookeanLaw) {
  const RecordedCapture seen = recorded(quick(MaterialKind::NeoHookean));
  const FitOutcome outcome = fit({seen}, quick(MaterialKind::NeoHookean));
  ASSERT_TRUE(outcome.evaluation.succeeded) << outcome.reason;
  EXPECT_TRUE(outcome.converged) << outcome.reason;
  EXPECT_NEAR(value(outcome, "youngs_modulus"), modulus, 0.03 * modulus);
  EXPECT_NEAR(value(outcome, "poissons_ratio"), nu, 0.03);
  expect_same_motion(seen, outcome, "");
  EXPECT_THAT(outcome.material, testing::HasSubstr("neo-Hookean"));
}

}  // namespace
}  // namespace pliant::law_capture_fit_test
