// One time step, forward and adjoint, beside what the linear solvers take for the same system, at the sizes of Weiss
// 2020, the torus (690 elements, 1,138 nodes there) and the teddy (1,716 elements, 2,440 nodes there), in contact at
// the default step of the fit; and of Wang 2015, a bar of 756 nodes and 3,000 linear tetrahedra at steps of 1/100 and
// 1/30 s.

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
  static const std::vector<Part> parts = {{{0, 0, 0}, 0.10},           {{0, 0.14, 0.01}, 0.075},
                                          {{0.06, 0.21, 0}, 0.03},     {{-0.06, 0.21, 0}, 0.03},
                                          {{0.11, 0.05, 0.03}, 0.045}, {{-0.11, 0.05, 0.03}, 0.045},
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

/// A few successive steps in the middle of a motion.
struct Motion {
  static constexpr int before = 4, steps = 8;

  std::shared_ptr<const Body> body;
  MotionBlocks blocks;
  std::unique_ptr<Stepper> stepper;
  VectorX theta;
  std::vector<State> states;   // at the start of each step, and at the end of the last
  std::vector<Points> deltas;  // of each step

  Motion(std::shared_ptr<const Body> of, std::vector<std::unique_ptr<ForceTerm>> terms, const MotionBlocks& at,
         VectorX parameters, const StepOptions& options, const std::vector<int>& held, const Vector3& velocity)
      : body(std::move(of)), blocks(at), theta(std::move(parameters)) {
    stepper = std::make_unique<Stepper>(body, std::move(terms), blocks, options);
    stepper->set_parameters(theta);
    stepper->hold(held);
    State state = {body->reference_positions(), Points::Zero(body->node_count(), 3)};
    state.v.rowwise() += velocity.transpose();
    for (const int node : held) state.v.row(node).setZero();
    for (int s = 0; s < before + steps; ++s) {
      if (s >= before) states.push_back(state);
      Points delta = options.dt * state.v;
      if (!stepper->prepare(state)) std::abort();
      if (!stepper->solve(state, delta).converged) std::abort();
      stepper->advance(delta, state);
      if (s >= before) deltas.push_back(delta);
    }
    states.push_back(state);
  }
  void label(benchmark::State& state) const {
    state.counters["elements"] = body->element_count();
    state.counters["nodes"] = body->node_count();
  }
};

/// Derivatives as exact as a fit has them.
SolverOptions iterative(double tolerance) { return {SolverKind::Iterative, tolerance, 500, 1e3 * tolerance}; }

StepOptions step_options(double dt, Integrator integrator) {
  StepOptions options;
  options.dt = dt;
  options.newmark_theta = 0.51;
  options.integrator = integrator;
  options.solver = integrator == Integrator::Lagged ? iterative(1e-8) : SolverOptions{};
  return options;
}

/// Dropped, in the middle of an impact, at the default step of the fit.
Motion impact(const std::shared_ptr<const Body>& body, Integrator integrator) {
  const MotionLayout layout({.planes = 1});
  const PlaneBlock& plane = layout.planes.front();
  VectorX theta = test::torus_values(layout);
  const double lowest = body->nodes.col(1).minCoeff();
  theta.segment<3>(plane.point) = Vector3(0, lowest + 0.3 * body->grid().cell_size, 0);
  theta.segment<3>(plane.normal) = Vector3::UnitY();
  std::vector<std::unique_ptr<ForceTerm>> terms;
  terms.push_back(make_elasticity(body, layout));
  terms.push_back(std::make_unique<Gravity>(*body, layout));
  terms.push_back(std::make_unique<RigidContact>(RigidContact::sliding(
      *body, surface_samples(*body), plane, default_contact(*body, theta[layout.density] * body->volume(), 9.81))));
  return {body, std::move(terms), layout, theta, step_options(default_time_step(*body, 9.81), integrator),
          {},   {0.0, -1.5, 0.0}};
}
Motion torus(Integrator integrator) { return impact(test::torus_body(0.1, 0.04, 0.0178), integrator); }
Motion teddy(Integrator integrator) {
  Box box;
  const SignedDistance distance = teddy_distance(box, 0.004);
  return impact(std::make_shared<Body>(make_body(make_hex_grid(distance, box, 0.0173))), integrator);
}

/// A clamped bar of linear tetrahedra, 1 x 0.25 x 0.25 m, let go under gravity.
Motion swinging_bar(Integrator integrator, double dt) {
  Box box;
  box.extend(Vector3::Zero());
  box.extend(Vector3(1.0, 0.25, 0.25));
  const auto body = std::make_shared<Body>(make_body(make_tet_box(box, {20, 5, 5}, false)));
  const MotionLayout layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 1e6);
  theta[layout.poissons_ratio] = 0.4;
  theta[layout.mass_damping] = 0.1;
  theta[layout.stiffness_damping] = 0.001;
  theta[layout.density] = 1000.0;
  theta.segment<3>(layout.gravity) = Vector3(0.0, -9.81, 0.0);
  std::vector<std::unique_ptr<ForceTerm>> terms;
  terms.push_back(make_elasticity(body, layout));
  terms.push_back(std::make_unique<Gravity>(*body, layout));
  std::vector<int> held;
  for (int n = 0; n < body->node_count(); ++n)
    if (body->nodes(n, 0) < 1e-6) held.push_back(n);
  return {body, std::move(terms), layout, theta, step_options(dt, integrator), held, Vector3::Zero()};
}
Motion bar(Integrator integrator) { return swinging_bar(integrator, 0.01); }
Motion bar_long_steps(Integrator integrator) { return swinging_bar(integrator, 1.0 / 30.0); }

using MakeMotion = Motion (*)(Integrator);

void forward(benchmark::State& state, MakeMotion make, Integrator integrator) {
  Motion motion = make(integrator);
  Points delta;
  int iterations = 0;
  while (state.KeepRunningBatch(Motion::steps)) {
    iterations = 0;
    for (int s = 0; s < Motion::steps; ++s) {
      const State& start = motion.states[std::size_t(s)];
      delta = motion.stepper->options().dt * start.v;
      benchmark::DoNotOptimize(motion.stepper->prepare(start));
      iterations += motion.stepper->solve(start, delta).iterations;
    }
  }
  state.counters[integrator == Integrator::Newton ? "newton_iterations" : "iterations"] =
      double(iterations) / Motion::steps;
  motion.label(state);
}
void forward_step(benchmark::State& state, MakeMotion make) { forward(state, make, Integrator::Lagged); }
void newton_forward_step(benchmark::State& state, MakeMotion make) { forward(state, make, Integrator::Newton); }

/// Back over the steps, for a cotangent of the positions at their end.
void adjoint(benchmark::State& state, MakeMotion make, Integrator integrator) {
  Motion motion = make(integrator);
  VectorX theta_bar = VectorX::Zero(motion.theta.size());
  while (state.KeepRunningBatch(Motion::steps)) {
    motion.stepper->set_parameters(motion.theta);
    State bar = {motion.states.back().x - motion.body->reference_positions(),
                 Points::Zero(motion.body->node_count(), 3)};
    for (std::size_t s = Motion::steps; s-- > 0;) {
      benchmark::DoNotOptimize(motion.stepper->prepare_derivatives(motion.states[s], motion.deltas[s]));
      motion.stepper->adjoint(motion.states[s], motion.deltas[s], bar, theta_bar);
    }
    benchmark::DoNotOptimize(bar.x.data());
  }
  motion.label(state);
}
void adjoint_step(benchmark::State& state, MakeMotion make) { adjoint(state, make, Integrator::Lagged); }
void newton_adjoint_step(benchmark::State& state, MakeMotion make) { adjoint(state, make, Integrator::Newton); }

/// Tangents along so many directions, as fits carry them along: of the material, the dampings and the start's velocity.
void tangents(benchmark::State& state, MakeMotion make, int directions) {
  Motion motion = make(Integrator::Lagged);
  MatrixX along = MatrixX::Zero(motion.theta.size(), directions);
  for (int c = 0; c < directions; ++c) along(c % motion.theta.size(), c) = 1.0;
  const Eigen::Index nodes = motion.body->node_count();
  while (state.KeepRunningBatch(Motion::steps)) {
    motion.stepper->set_parameters(motion.theta);
    std::vector<State> changes(std::size_t(directions), {Points::Zero(nodes, 3), Points::Zero(nodes, 3)});
    for (std::size_t s = 0; s < Motion::steps; ++s) {
      benchmark::DoNotOptimize(motion.stepper->prepare_derivatives(motion.states[s], motion.deltas[s]));
      motion.stepper->tangents(motion.states[s], motion.deltas[s], along, changes);
    }
    benchmark::DoNotOptimize(changes.back().x.data());
  }
  motion.label(state);
}

/// Factorisation (or preconditioner) of a step's matrix and one solve for its right-hand side, from zero.
void linear_solve(benchmark::State& state, MakeMotion make, SolverOptions options) {
  Motion motion = make(Integrator::Lagged);
  std::unique_ptr<LinearSolver> solver;
  try {
    solver = make_linear_solver(motion.body->pattern, options);
  } catch (const std::invalid_argument& error) {
    return state.SkipWithError(error.what());
  }
  if (!motion.stepper->prepare(motion.states.front())) std::abort();
  VectorX b, x = VectorX::Zero(motion.deltas.front().size());
  motion.stepper->matrix().multiply(flat(motion.deltas.front()), b);
  int iterations = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(solver->factorise(motion.stepper->matrix()));
    x.setZero();
    iterations = solver->solve(b, x).iterations;
  }
  state.counters["iterations"] = iterations;
  motion.label(state);
}

/// Rotations and the elastic matrix.
void assembly(benchmark::State& state, MakeMotion make) {
  const Motion motion = make(Integrator::Lagged);
  const auto elasticity = make_elasticity(motion.body, motion.blocks);
  VectorX theta = VectorX::Zero(motion.theta.size());
  motion.blocks.set_moduli(theta, 1e5);
  theta[motion.blocks.poissons_ratio] = 0.35;
  elasticity->set_parameters(theta);
  BlockMatrix matrix(motion.body->pattern);
  for (auto _ : state) {
    matrix.set_zero();
    elasticity->linearise(motion.states.front().x);
    elasticity->add_matrix(1.0, matrix);
  }
  motion.label(state);
}

#define PLIANT_STEP_BENCHMARKS(motion)                                                                             \
  BENCHMARK_CAPTURE(forward_step, motion, motion)->Unit(benchmark::kMillisecond);                                  \
  BENCHMARK_CAPTURE(adjoint_step, motion, motion)->Unit(benchmark::kMillisecond);                                  \
  BENCHMARK_CAPTURE(tangents, motion##_1_direction, motion, 1)->Unit(benchmark::kMillisecond);                     \
  BENCHMARK_CAPTURE(tangents, motion##_5_directions, motion, 5)->Unit(benchmark::kMillisecond);                    \
  BENCHMARK_CAPTURE(linear_solve, motion##_iterative_1e6, motion, iterative(1e-6))->Unit(benchmark::kMillisecond); \
  BENCHMARK_CAPTURE(linear_solve, motion##_iterative_1e8, motion, iterative(1e-8))->Unit(benchmark::kMillisecond); \
  BENCHMARK_CAPTURE(linear_solve, motion##_cholmod, motion, SolverOptions{SolverKind::Cholmod})                    \
      ->Unit(benchmark::kMillisecond);                                                                             \
  BENCHMARK_CAPTURE(linear_solve, motion##_simplicial, motion, SolverOptions{SolverKind::Simplicial})              \
      ->Unit(benchmark::kMillisecond);                                                                             \
  BENCHMARK_CAPTURE(assembly, motion, motion)->Unit(benchmark::kMillisecond);                                      \
  BENCHMARK_CAPTURE(newton_forward_step, motion, motion)->Unit(benchmark::kMillisecond);                           \
  BENCHMARK_CAPTURE(newton_adjoint_step, motion, motion)->Unit(benchmark::kMillisecond)

PLIANT_STEP_BENCHMARKS(torus);
PLIANT_STEP_BENCHMARKS(teddy);
PLIANT_STEP_BENCHMARKS(bar);
PLIANT_STEP_BENCHMARKS(bar_long_steps);

}  // namespace
}  // namespace pliant
