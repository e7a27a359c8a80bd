// Followed points as observations: derivatives through the whole chain, and moduli found from them.
#include <random>

#include "base/dense.hpp"
#include "elasticity/modulus_field.hpp"
#include "estimation/objective.hpp"
#include "estimation/optimiser.hpp"
#include "support/bodies.hpp"
#include "support/derivatives.hpp"
#include "support/tolerance.hpp"

namespace pliant::tracks_test {
namespace {

using test::tolerance;

/// A bar of tetrahedra held at one end that swings from its straight pose, with three control moduli; every node is
/// followed. Made by the model that fits it: an inverse crime on purpose.
struct SwingingBar {
  explicit SwingingBar(Integrator integrator, bool is_static, double noise = 0.0) {
    Body soft = make_body(make_tet_box(test::centred_box({0.1, 0.02, 0.02}), {6, 2, 2}, false));
    soft.modulus = linear_field(soft, Vector3::UnitX(), 3).field;
    body = std::make_shared<Body>(std::move(soft));
    for (int f = 0; f < (is_static ? 1 : 12); ++f) options.times.push_back(f / 60.0);
    options.max_dt = 1.0 / 120.0 + 1e-9;
    options.integrator = integrator;
    options.is_static = is_static;
    options.solver.tolerance = 1e-13;
    options.newton.tolerance = 1e-13;
    options.holds = {{[](const Vector3& p) { return p.x() < -0.1 + 1e-6; }}};
    options.blocks = layout;
    const Vector3 moduli(4e4, 2e4, 6e4);
    for (int k = 0; k < 3; ++k) truth[modulus(k)] = moduli[k];
    truth[layout.poissons_ratio] = 0.4;
    truth[layout.mass_damping] = 0.5;
    truth[layout.stiffness_damping] = 2e-3;
    truth[layout.density] = 1000.0;
    truth.segment<3>(layout.gravity) = Vector3(0, -9.81, 0);
    std::vector<Vector3> rest;
    for (int n = 0; n < body->node_count(); ++n) rest.push_back(body->nodes.row(n).transpose());
    tracks = std::make_shared<PointTracks>(*body, rest);
    auto frames = std::make_shared<std::vector<FrameObservations>>();
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    Simulation simulation(body, options);
    simulation.run(truth, [&](int frame, const State& state, auto) {
      FrameObservations seen{frame};
      for (int n = 0; n < body->node_count(); ++n)
        if ((n + frame) % 3 != 0)  // rows are missing
          seen.tracks.push_back(
              {n, Vector3(state.x.row(n)) + noise * Vector3(normal(random), normal(random), normal(random)), 1e-3});
      frames->push_back(std::move(seen));
      return true;
    });
    observations = frames;
    std::vector<Parameter> list;
    for (int k = 0; k < 3; ++k)
      list.push_back(
          {"youngs_modulus@" + std::to_string(k + 1), "Pa", Transform::Logarithm, modulus(k), 1.0, 1.0, 1e9, true});
    list.push_back({"mass_damping", "1/s", Transform::Logarithm, layout.mass_damping, 1.0, 1e-4, 1e3, !is_static});
    list.push_back(
        {"stiffness_damping", "s", Transform::Logarithm, layout.stiffness_damping, 1.0, 1e-6, 1.0, !is_static});
    VectorX start = truth;
    for (int k = 0; k < 3; ++k) start[modulus(k)] = 3e4 * (1.0 + 0.3 * k);
    if (!is_static) start[layout.mass_damping] *= 2.0, start[layout.stiffness_damping] *= 0.4;
    parameters = ParameterSet(layout.layout(), std::move(list), start);
  }
  Objective objective() const {
    ObjectiveOptions o;
    o.outlier_scale = 0.1;
    o.last_frame = int(options.times.size()) - 1;
    return {{nullptr, tracks}, body, options, observations, parameters, o};
  }
  ParameterHandle modulus(int control) const { return layout.youngs_moduli[std::size_t(control)]; }
  VectorX start() const { return parameters.to_unconstrained(parameters.reference()); }

  std::shared_ptr<const Body> body;
  MotionLayout layout{{.moduli = 3}};
  SimulationOptions options;
  VectorX truth = layout.zero();
  std::shared_ptr<const PointTracks> tracks;
  std::shared_ptr<const std::vector<FrameObservations>> observations;
  ParameterSet parameters;
};

struct Kind {
  const char* name;
  Integrator integrator;
  bool is_static;
  friend void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }
};

class FollowedPoints : public ::testing::TestWithParam<Kind> {};

TEST_P(FollowedPoints, GradientsMatchCentralDifferencesAndEachOther) {
  const SwingingBar bar(GetParam().integrator, GetParam().is_static);
  Objective objective = bar.objective();
  const VectorX p = bar.start();
  const CostEvaluation by_tangents = objective.linearise(p), by_adjoint = objective.gradient(p);
  ASSERT_TRUE(by_tangents.succeeded && by_adjoint.succeeded) << by_tangents.failure << by_adjoint.failure;
  EXPECT_NEAR(by_adjoint.cost, by_tangents.cost, tolerance(1e-10) * by_tangents.cost);
  EXPECT_GT(by_tangents.track_rms(), 1e-4);
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    EXPECT_NEAR(by_adjoint.gradient[i], by_tangents.gradient[i], tolerance(1e-7) * std::abs(by_tangents.gradient[i]))
        << i;
    const auto along = [&](double h) -> VectorX {
      return VectorX::Constant(1, objective.evaluate(p + h * VectorX::Unit(p.size(), i)).cost);
    };
    EXPECT_LT(test::best_relative_error(along, VectorX::Constant(1, by_tangents.gradient[i]), 0.1), tolerance(1e-5))
        << i;
  }
}

TEST_P(FollowedPoints, LeadBackToTheModuliAndDampings) {
  const SwingingBar bar(GetParam().integrator, GetParam().is_static);
  Objective objective = bar.objective();
  OptimiserOptions options;
  options.cost_tolerance = 1e-6;
  options.max_iterations = 40;
  const OptimiserSummary summary = minimise(objective, bar.start(), options);
  ASSERT_TRUE(summary.converged) << summary.reason;
  const VectorX found = bar.parameters.to_theta(summary.p);
  for (const Parameter& p : bar.parameters.parameters())
    if (p.estimated) {
      EXPECT_NEAR(found[p.at] / bar.truth[p.at], 1.0, tolerance(0.01)) << p.name;
    }
}

INSTANTIATE_TEST_SUITE_P(Motions, FollowedPoints,
                         ::testing::Values(Kind{"lagged", Integrator::Lagged, false},
                                           Kind{"newton", Integrator::Newton, false},
                                           Kind{"at_rest", Integrator::Lagged, true}),
                         [](const auto& kind) { return kind.param.name; });

/// One per cent of the bar's length on every point, twice what the fit believes: moduli lie within their deviations,
/// which grow from the clamp, where all bending is, to the free end, where there is hardly any.
TEST(FollowedPointsWithNoise, LeadToTheModuliWithinTheirDeviations) {
  const SwingingBar bar(Integrator::Lagged, false, 2e-3);
  Objective objective = bar.objective();
  const OptimiserSummary summary = minimise(objective, bar.start(), {});
  ASSERT_TRUE(summary.succeeded);
  const MatrixX& H = summary.evaluation.gauss_newton;
  const VectorX std = 2.0 * inverse(H).diagonal().cwiseSqrt();
  const VectorX found = bar.parameters.to_theta(summary.p);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LT(std::abs(std::log(found[bar.modulus(k)] / bar.truth[bar.modulus(k)])), tolerance(3.0 * std[k])) << k;
  }
  EXPECT_LT(std[0], 0.1);
  EXPECT_GT(std[2], 3.0 * std[0]);
}

}  // namespace
}  // namespace pliant::tracks_test
