// Presses: 1,800 tetrahedra (a foam block of 10 x 3 x 10 cells) with 193 followed points, and moving probes on 1,764
// and 8,640 tetrahedra. One factorisation of the stiffness stands beside each part.

#include <benchmark/benchmark.h>

#include <cmath>

#include "estimation/sample_fit.hpp"
#include "motion/press_session.hpp"

namespace pliant {
namespace {

std::shared_ptr<const Body> block(const Eigen::Vector3i& cells) {
  Box box;
  box.extend(Vector3(-0.1, 0.0, -0.1));
  box.extend(Vector3(0.1, 0.1, 0.1));
  return std::make_shared<Body>(make_body(make_tet_box(box, cells, false)));
}

std::vector<int> bottom(const Body& body) {
  std::vector<int> held;
  for (int n = 0; n < body.node_count(); ++n)
    if (body.nodes(n, 1) < 1e-9) held.push_back(n);
  return held;
}

std::shared_ptr<const LinearLaw> linear(const Body& body) {
  MatrixX table(body.element_count(), 2);
  const LambdaAlpha p = lambda_alpha({9000.0, 0.25});
  table.rowwise() = Eigen::RowVector2d(p.lambda, p.alpha);
  return std::make_shared<LinearLaw>(table);
}

std::shared_ptr<const OgdenLaw> foam(const Body& body) {
  MatrixX table(body.element_count(), 6);
  table.rowwise() = (Eigen::RowVectorXd(6) << 2000.0, 8.0, 0.2, 2000.0, -6.0, 0.15).finished();
  return std::make_shared<OgdenLaw>(table);
}

/// Eight samples an element.
std::shared_ptr<const SampledLaw> sampled(const Body& body) {
  std::vector<MaterialSample> samples;
  MatrixX strains(body.element_count(), 6);
  for (int k = 0; k < 8; ++k) {
    for (int e = 0; e < body.element_count(); ++e)
      for (int i = 0; i < 6; ++i) strains(e, i) = 0.1 * std::sin(1.0 + e + 3.1 * i + 7.3 * k);
    samples.push_back({strains, stresses_of(*linear(body), (1.0 + 0.4 * k) * strains)});
  }
  return sample_material(foam(body), samples, {1e-9, 8}).law;
}

/// One press with markers on top and sides, as its own truth says.
struct Press1800 {
  Press1800() {
    scene.body = block({10, 3, 10});
    scene.held = bottom(*scene.body);
    scene.noise = 2e-4;
    scene.density = 40.0;
    scene.unit_weight = weight_of(*scene.body, 1.0, {0.0, -9.81, 0.0});
    std::vector<Vector3> markers;
    for (int i = 0; i < 11; ++i)
      for (int j = 0; j < 11; ++j) markers.emplace_back(-0.095 + 0.019 * i, 0.1, -0.095 + 0.019 * j);
    for (int i = 0; i < 9; ++i)
      for (int j = 0; j < 4; ++j) {
        markers.emplace_back(0.1, 0.02 + 0.02 * j, -0.08 + 0.02 * i);
        markers.emplace_back(-0.08 + 0.02 * i, 0.02 + 0.02 * j, 0.1);
      }
    Press press;
    press.force = Vector3(1.0, -18.0, 0.0);
    press.contact_centre = Vector3(0.01, 0.1, 0.02);
    press.contact_radius = 0.02;
    scene.facts.push_back(press);
    scene.presses.push_back({"press 1", "fit", press.force, markers, markers, false, 0.0});
    PressedBody truth(scene, 0, foam(*scene.body), 9000.0);
    (void)truth.solve();
    const Points points = truth.points();
    for (std::size_t m = 0; m < markers.size(); ++m)
      scene.presses[0].loaded[m] = points.row(Eigen::Index(m)).transpose();
  }
  PressScene scene;
};
const Press1800& press() {
  static const Press1800 one;
  return one;
}

/// A linear law that may be changed.
std::shared_ptr<const ChangedLaw> changed(const Body& body) {
  const MatrixX table = Eigen::RowVector2d(1.0, 0.25).replicate(body.element_count(), 1);
  return std::make_shared<ChangedLaw>(
      linear(body), std::vector<SmallStrainModuli>(std::size_t(body.element_count()), {9000.0, 0.25}), table);
}

void Factorisation(benchmark::State& state) {
  const auto law = changed(*press().scene.body);
  PressedBody body(press().scene, 0, law, 9000.0);
  (void)body.solve();
  const auto elasticity = LawElasticity::make(press().scene.body, law);
  elasticity->evaluate(body.placement().nodes, true);
  BlockMatrix K(press().scene.body->pattern);
  elasticity->add_stiffness(LawElasticity::Stiffness::Exact, 1.0, K);
  for (const int n : press().scene.held) K.constrain(n);
  const auto solver = make_linear_solver(press().scene.body->pattern, {best_direct_kind()});
  for (auto _ : state) benchmark::DoNotOptimize(solver->factorise(K));
}
BENCHMARK(Factorisation)->Unit(benchmark::kMillisecond);

template <class Law>
void Assembly(benchmark::State& state, Law&& make) {
  const auto body = press().scene.body;
  const auto elasticity = LawElasticity::make(body, make(*body));
  Points x = body->nodes;
  x.col(1) *= 0.9;
  BlockMatrix K(body->pattern);
  for (auto _ : state) {
    elasticity->evaluate(x, true);
    K.set_zero();
    elasticity->add_stiffness(LawElasticity::Stiffness::Exact, 1.0, K);
  }
}
BENCHMARK_CAPTURE(Assembly, linear, linear)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Assembly, ogden, foam)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Assembly, sampled, sampled)->Unit(benchmark::kMillisecond);

/// The Jacobian of all coordinates by all elements' two unknowns.
void Jacobian(benchmark::State& state) {
  const auto law = changed(*press().scene.body);
  PressedBody body(press().scene, 0, law, 9000.0);
  (void)body.solve();
  const auto by = state.range(0) ? JacobianBy::Tangents : JacobianBy::Adjoints;
  for (auto _ : state) {
    (void)body.equilibrium().prepare_derivatives(body.placement());
    benchmark::DoNotOptimize(sample_jacobian(body, *press().scene.body, *law, by));
  }
}
BENCHMARK(Jacobian)->ArgName("tangents")->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

/// One iteration: Jacobian, the matrix of measurements, the weight, the step, and the equilibrium after it.
void LevenbergMarquardtStep(benchmark::State& state) {
  static const ElementSmoothness smoothness(*press().scene.body);
  SampleFitOptions options;
  options.deviations = VectorX::Constant(3 * Eigen::Index(press().scene.presses[0].rest.size()), 2e-4);
  options.max_iterations = 1;
  const auto about = linear(*press().scene.body);
  const MatrixX strains = MatrixX::Zero(press().scene.body->element_count(), 6);
  for (auto _ : state) benchmark::DoNotOptimize(fit_sample(press().scene, 0, about, strains, smoothness, options));
}
BENCHMARK(LevenbergMarquardtStep)->Unit(benchmark::kMillisecond);

/// A probe that goes round in small steps; items are equilibria.
template <class Law>
void MovingProbe(benchmark::State& state, Law&& make, Eigen::Vector3i cells, ProbeKind kind) {
  const auto body = block(cells);
  PressSessionOptions options;
  options.held = bottom(*body);
  PressSession session(body, make(*body), {kind, {0.0, 0.1, 0.0}, 0.03, {}}, options);
  for (int k = 1; k <= 10; ++k) (void)session.move_to({0.0, -0.001 * k, 0.0});
  int k = 0, iterations = 0, failed = 0;
  for (auto _ : state) {  // a millimetre a step, at 60 steps a second 6 cm/s
    const double angle = 2.0 * M_PI * (++k % 60) / 60.0;
    const SolveSummary s = session.move_to(
        {0.0095 * std::sin(angle), -0.01 - 0.004 * std::sin(2 * angle), 0.0095 * (1.0 - std::cos(angle))});
    iterations += s.iterations;
    failed += !s.converged;
  }
  state.counters["tetrahedra"] = body->element_count();
  state.counters["iterations"] = double(iterations) / double(k);
  state.counters["failed"] = failed;
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_CAPTURE(MovingProbe, small_sampled_disc, sampled, {7, 6, 7}, ProbeKind::BondedDisc)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(MovingProbe, small_ogden_disc, foam, {7, 6, 7}, ProbeKind::BondedDisc)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(MovingProbe, small_ogden_ball, foam, {7, 6, 7}, ProbeKind::Ball)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(MovingProbe, large_sampled_disc, sampled, {12, 10, 12}, ProbeKind::BondedDisc)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(MovingProbe, large_ogden_disc, foam, {12, 10, 12}, ProbeKind::BondedDisc)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();

}  // namespace
}  // namespace pliant
