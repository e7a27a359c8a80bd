// One time step, forward and adjoint, beside the best direct and the best iterative solve of the same matrix, at the
// sizes of Weiss 2020: the torus (690 elements, 1,138 nodes there) and the teddy (1,716 elements, 2,440 nodes there).
// Times a step of a body in contact, at the default step of the fit.

#include <benchmark/benchmark.h>

#include <algorithm>

#include "elasticity/corotated.hpp"
#include "motion/body_forces.hpp"
#include "support/scenes.hpp"

namespace pliant {
namespace {

/// A doll of spheres: body, head, ears, arms and legs.
SignedDistance teddy_distance(Box& box, double spacing) {
  struct Part {
    Vector3 centre;
    double radius;
  };
  static const std::vector<Part> parts = {{{0, 0, 0}, 0.10},          {{0, 0.14, 0.01}, 0.075},    {{0.06, 0.21, 0}, 0.03},
                                          {{-0.06, 0.21, 0}, 0.03},   {{0.11, 0.05, 0.03}, 0.045}, {{-0.11, 0.05, 0.03}, 0.045},
                                          {{0.06, -0.10, 0.05}, 0.05}, {{-0.06, -0.10, 0.05}, 0.05}};
  for (const Part& p : parts) {
    box.extend(p.centre - Vector3::Constant(p.radius));
    box.extend(p.centre + Vector3::Constant(p.radius));
  }
  Box wide = box;
  wide.extend(box.min - Vector3::Constant(0.06));
  wide.extend(box.max + Vector3::Constant(0.06));
  return SignedDistance(wide, spacing, [](const Vector3& x) {
    double d = 1.0;
    for (const Part& p : parts) d = std::min(d, (x - p.centre).norm() - p.radius);
    return d;
  });
}

std::shared_ptr<const Body> torus() { return test::torus_body(0.1, 0.04, 0.0178); }
std::shared_ptr<const Body> teddy() {
  Box box;
  const SignedDistance distance = teddy_distance(box, 0.004);
  return std::make_shared<Body>(make_body(make_hex_grid(distance, box, 0.0173)));
}

/// A stepper in the middle of an impact.
struct Impact {
  std::shared_ptr<const Body> body;
  std::unique_ptr<Stepper> stepper;
  State start;
  Points delta;

  Impact(std::shared_ptr<const Body> of, const SolverOptions& solver) : body(std::move(of)) {
    VectorX theta = test::torus_scene(0.04, 2).theta;
    double lowest = body->nodes.col(1).minCoeff();
    theta.segment<3>(theta::plane_point(0)) = Vector3(0, lowest + 0.3 * body->grid().cell_size, 0);
    theta.segment<3>(theta::plane_normal(0)) = Vector3::UnitY();
    std::vector<std::unique_ptr<ForceTerm>> terms;
    terms.push_back(make_elasticity(body));
    terms.push_back(std::make_unique<Gravity>(*body));
    terms.push_back(std::make_unique<PlaneContact>(body, 0, default_contact(*body, theta[theta::density] * body->volume(), 9.81)));
    const double dt = default_time_step(*body, 9.81);
    StepOptions options;
    options.dt = dt;
    options.newmark_theta = 0.51;
    options.solver = solver;
    stepper = std::make_unique<Stepper>(body, std::move(terms), options);
    stepper->set_parameters(theta);
    start = {body->reference_positions(), Points::Zero(body->node_count(), 3)};
    start.v.col(1).setConstant(-1.5);
    for (int s = 0; s < 5; ++s) {  // into the impact
      delta = dt * start.v;
      if (!stepper->prepare(start)) std::abort();
      if (!stepper->solve(start, delta).converged) std::abort();
      if (s < 4) stepper->advance(delta, start);
    }
  }
  void label(benchmark::State& state) const {
    state.counters["elements"] = body->element_count();
    state.counters["nodes"] = body->node_count();
  }
};

SolverOptions iterative(double tolerance) { return {SolverKind::Iterative, tolerance, 500}; }

using MakeBody = std::shared_ptr<const Body> (*)();

void forward_step(benchmark::State& state, MakeBody make) {
  Impact impact(make(), iterative(1e-8));
  Points delta;
  int iterations = 0;
  for (auto _ : state) {
    delta = impact.stepper->options().dt * impact.start.v;
    benchmark::DoNotOptimize(impact.stepper->prepare(impact.start));
    iterations = impact.stepper->solve(impact.start, delta).iterations;
  }
  state.counters["iterations"] = iterations;
  impact.label(state);
}

void adjoint_step(benchmark::State& state, MakeBody make) {
  Impact impact(make(), iterative(1e-8));
  State bar{Points::Random(impact.body->node_count(), 3), Points::Zero(impact.body->node_count(), 3)};
  VectorX theta_bar = VectorX::Zero(theta::size(1));
  for (auto _ : state) {
    State in = bar;
    benchmark::DoNotOptimize(impact.stepper->prepare(impact.start));
    impact.stepper->adjoint(impact.start, impact.delta, in, theta_bar);
    benchmark::DoNotOptimize(in.x.data());
  }
  impact.label(state);
}

/// Refactorisation (or preconditioner) and one solve, from a zero guess.
void linear_solve(benchmark::State& state, MakeBody make, SolverOptions options) {
  Impact impact(make(), iterative(1e-8));
  std::unique_ptr<LinearSolver> solver;
  try {
    solver = make_linear_solver(impact.body->pattern, options);
  } catch (const std::invalid_argument& error) {
    return state.SkipWithError(error.what());
  }
  const VectorX b = impact.stepper->matrix().rows() ? VectorX(VectorX::Random(impact.stepper->matrix().rows())) : VectorX();
  VectorX x = VectorX::Zero(b.size());
  for (auto _ : state) {
    benchmark::DoNotOptimize(solver->factorise(impact.stepper->matrix()));
    x.setZero();
    benchmark::DoNotOptimize(solver->solve(b, x));
  }
  impact.label(state);
}

void assembly(benchmark::State& state, MakeBody make) {
  const auto body = make();
  const auto elasticity_term = make_elasticity(body);
  Elasticity& elasticity = *elasticity_term;
  VectorX theta = test::torus_scene(0.04, 2).theta;
  elasticity.set_parameters(theta);
  BlockMatrix matrix(body->pattern);
  const Points x = body->reference_positions() + 1e-3 * Points::Random(body->node_count(), 3);
  for (auto _ : state) {
    matrix.set_zero();
    elasticity.linearise(x);
    elasticity.add_matrix(1.0, matrix);
  }
}

#define PLIANT_STEP_BENCHMARKS(body)                                                                                \
  BENCHMARK_CAPTURE(forward_step, body, body)->Unit(benchmark::kMillisecond);                                       \
  BENCHMARK_CAPTURE(adjoint_step, body, body)->Unit(benchmark::kMillisecond);                                       \
  BENCHMARK_CAPTURE(linear_solve, body##_iterative_1e6, body, iterative(1e-6))->Unit(benchmark::kMillisecond);      \
  BENCHMARK_CAPTURE(linear_solve, body##_iterative_1e8, body, iterative(1e-8))->Unit(benchmark::kMillisecond);      \
  BENCHMARK_CAPTURE(linear_solve, body##_cholmod, body, SolverOptions{SolverKind::Cholmod})->Unit(benchmark::kMillisecond); \
  BENCHMARK_CAPTURE(assembly, body, body)->Unit(benchmark::kMillisecond)

PLIANT_STEP_BENCHMARKS(torus);
PLIANT_STEP_BENCHMARKS(teddy);

}  // namespace
}  // namespace pliant
