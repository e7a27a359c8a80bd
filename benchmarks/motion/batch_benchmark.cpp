// Steps of many members of one mesh a second: by a `Stepper` each, one after the other, beside `MotionBatch` in the
// lanes of this processor's registers, in one thread, and on a CUDA device where there is one. Members differ in every
// number of their material; hexahedra of one Poisson's ratio read their stiffness once for all, so that there is a
// torus with one and one with many. The torus (704 hexahedra, 1,144 nodes) and the bar (3,000 linear tetrahedra, 756
// nodes) are those of step_benchmark.cpp, the one in an impact, the other let go; the gradient is a run and its reverse
// sweep.

#include <benchmark/benchmark.h>

#include "base/parallel.hpp"
#include "batch_motion/motion_batch.hpp"
#include "elasticity/corotated.hpp"
#include "motion/body_forces.hpp"
#include "support/scenes.hpp"

namespace pliant {
namespace {

constexpr int steps = 12;

struct Scene {
  std::shared_ptr<const Body> body;
  MotionLayout layout;
  BatchOptions options;
  std::vector<BatchMember> members;
};

void add_members(Scene& scene, BatchMember member, int count, double ratios) {
  member.start.x = scene.body->nodes;
  for (int k = 0; k < count; ++k) {
    BatchMember m = member;
    const double share = double(k) / count;
    m.youngs_modulus *= 0.8 + 0.4 * share;
    m.poissons_ratio -= ratios * share;
    m.mass_damping *= 1.0 + share;
    m.stiffness_damping *= 0.9 + 0.2 * share;
    m.density *= 1.0 + 0.1 * share;
    scene.members.push_back(m);
  }
}

/// Dropped, in the middle of an impact, at the default step of the fit.
/// @param ratios  over which Poisson's ratios are spread
Scene torus_of(int members, double ratios) {
  Scene s{test::torus_body(0.1, 0.04, 0.0178), MotionLayout({.planes = 1}), {}, {}};
  s.options.dt = default_time_step(*s.body, 9.81);
  s.options.with_plane = true;
  s.options.contact = default_contact(*s.body, 100.0 * s.body->volume(), 9.81);
  BatchMember m;
  m.youngs_modulus = 4000.0, m.poissons_ratio = 0.35, m.mass_damping = 0.3, m.stiffness_damping = 0.003;
  m.density = 100.0, m.gravity = {0.1, -9.7, 0.2};
  m.plane_point = {0, s.body->nodes.col(1).minCoeff() + 0.3 * s.body->grid().cell_size, 0};
  m.start.v = Points::Zero(s.body->node_count(), 3).rowwise() + Eigen::RowVector3d(0.0, -1.5, 0.0);
  add_members(s, m, members, ratios);
  return s;
}
Scene torus(int members) { return torus_of(members, 0.0); }
Scene torus_of_many_ratios(int members) { return torus_of(members, 0.05); }

/// A clamped bar, 1 x 0.25 x 0.25 m, let go under gravity.
Scene bar(int members) {
  Box box;
  box.extend(Vector3::Zero());
  box.extend(Vector3(1.0, 0.25, 0.25));
  Scene s{std::make_shared<Body>(make_body(make_tet_box(box, {20, 5, 5}, false))), MotionLayout(), {}, {}};
  s.options.dt = 0.01;
  for (int n = 0; n < s.body->node_count(); ++n)
    if (s.body->nodes(n, 0) < 1e-6) s.options.held.push_back(n);
  BatchMember m;
  m.youngs_modulus = 1e6, m.poissons_ratio = 0.4, m.mass_damping = 0.1, m.stiffness_damping = 0.001, m.density = 1000.0;
  m.gravity = {0.0, -9.81, 0.0};
  m.start.v = Points::Zero(s.body->node_count(), 3);
  add_members(s, m, members, 0.05);
  return s;
}

/// A member by the program's own stepper.
struct Alone {
  std::unique_ptr<Stepper> stepper;
  VectorX theta;
  State start;

  Alone(const Scene& s, const BatchMember& m, double tolerance) : theta(s.layout.zero()), start(m.start) {
    s.layout.set_moduli(theta, m.youngs_modulus);
    theta[s.layout.poissons_ratio] = m.poissons_ratio;
    theta[s.layout.mass_damping] = m.mass_damping;
    theta[s.layout.stiffness_damping] = m.stiffness_damping;
    theta[s.layout.density] = m.density;
    theta.segment<3>(s.layout.gravity) = m.gravity;
    std::vector<std::unique_ptr<ForceTerm>> terms;
    terms.push_back(make_elasticity(s.body, s.layout));
    terms.push_back(std::make_unique<Gravity>(*s.body, s.layout));
    for (const PlaneBlock& plane : s.layout.planes) {
      theta.segment<3>(plane.point) = m.plane_point;
      theta.segment<3>(plane.normal) = m.plane_normal;
      terms.push_back(std::make_unique<RigidContact>(
          RigidContact::sliding(*s.body, surface_samples(*s.body), plane, s.options.contact)));
    }
    StepOptions options;
    options.dt = s.options.dt;
    options.newmark_theta = s.options.newmark_theta;
    options.solver = {SolverKind::Iterative, tolerance, 500};
    stepper = std::make_unique<Stepper>(s.body, std::move(terms), s.layout, options);
    stepper->set_parameters(theta);
    stepper->hold(s.options.held);
  }
  /// @return  iterations
  int run(std::vector<State>& states, std::vector<Points>& deltas) {
    stepper->set_parameters(theta);
    states.assign(1, start);
    deltas.clear();
    int iterations = 0;
    for (int i = 0; i < steps; ++i) {
      Points delta = stepper->options().dt * states.back().v;
      if (!stepper->prepare(states.back())) std::abort();
      iterations += stepper->solve(states.back(), delta).iterations;
      State end = states.back();
      stepper->advance(delta, end);
      states.push_back(std::move(end));
      deltas.push_back(std::move(delta));
    }
    return iterations;
  }
  void sweep(const Points& rest, const std::vector<State>& states, const std::vector<Points>& deltas) {
    VectorX theta_bar = VectorX::Zero(theta.size());
    State bar = {states.back().x - rest, Points::Zero(rest.rows(), 3)};
    for (std::size_t i = steps; i-- > 0;) {
      if (!stepper->prepare_derivatives(states[i], deltas[i])) std::abort();
      stepper->adjoint(states[i], deltas[i], bar, theta_bar);
    }
    benchmark::DoNotOptimize(theta_bar.data());
  }
};

using MakeScene = Scene (*)(int members);

void label(benchmark::State& state, int members, double iterations) {
  state.SetItemsProcessed(state.iterations() * members * steps);  // member-steps
  state.counters["members"] = members;
  state.counters["iterations"] = iterations / (members * steps);
}

void one_by_one(benchmark::State& state, MakeScene make, bool with_gradient, double tolerance) {
  const ThreadLimit one(1);
  constexpr int members = 8;
  const Scene scene = make(members);
  std::vector<Alone> all;
  for (const BatchMember& m : scene.members) all.emplace_back(scene, m, tolerance);
  std::vector<State> states;
  std::vector<Points> deltas;
  int iterations = 0;
  for (auto _ : state) {
    iterations = 0;
    for (Alone& alone : all) {
      iterations += alone.run(states, deltas);
      if (with_gradient) alone.sweep(scene.body->nodes, states, deltas);
    }
  }
  label(state, members, iterations);
}

void together(benchmark::State& state, MakeScene make, bool with_gradient, double tolerance, BatchDevice device,
              int members) {
  const ThreadLimit one(1);
  std::string reason;
  if (device == BatchDevice::Cuda && cuda_device_count(&reason) == 0)
    return state.SkipWithError(("no CUDA device: " + reason).c_str());
  Scene scene = make(members);
  scene.options.tolerance = tolerance;
  scene.options.device = device;
  scene.options.memory_budget = std::size_t(8) << 30;
  MotionBatch batch(scene.body, scene.options, members);
  for (int k = 0; k < members; ++k) batch.set_member(k, scene.members[std::size_t(k)]);
  std::vector<BatchRun> runs;
  std::vector<BatchGradient> gradients;
  const auto add_cotangents = [&](int, std::span<const State> states, std::span<State> bars) {
    for (std::size_t k = 0; k < states.size(); ++k) bars[k].x += states[k].x - scene.body->nodes;
  };
  for (auto _ : state) {
    if (with_gradient)
      runs = batch.run_adjoint(steps, {steps}, {}, add_cotangents, gradients);
    else
      runs = batch.run(steps, {steps}, {});
  }
  double iterations = 0.0;
  for (const BatchRun& run : runs) {
    if (!run.succeeded) std::abort();
    iterations += double(run.solver_iterations);
  }
  label(state, members, iterations);
}

void forward_one_by_one(benchmark::State& state, MakeScene make, double tolerance) {
  one_by_one(state, make, false, tolerance);
}
void gradient_one_by_one(benchmark::State& state, MakeScene make, double tolerance) {
  one_by_one(state, make, true, tolerance);
}
void forward_in_lanes(benchmark::State& state, MakeScene make, double tolerance, int members) {
  together(state, make, false, tolerance, BatchDevice::Host, members);
}
void gradient_in_lanes(benchmark::State& state, MakeScene make, double tolerance, int members) {
  together(state, make, true, tolerance, BatchDevice::Host, members);
}
void forward_on_device(benchmark::State& state, MakeScene make, double tolerance, int members) {
  together(state, make, false, tolerance, BatchDevice::Cuda, members);
}
void gradient_on_device(benchmark::State& state, MakeScene make, double tolerance, int members) {
  together(state, make, true, tolerance, BatchDevice::Cuda, members);
}

#define PLIANT_BATCH_BENCHMARKS(scene)                                                                    \
  BENCHMARK_CAPTURE(forward_one_by_one, scene##_1e8, scene, 1e-8)->Unit(benchmark::kMillisecond);         \
  BENCHMARK_CAPTURE(forward_one_by_one, scene##_1e6, scene, 1e-6)->Unit(benchmark::kMillisecond);         \
  BENCHMARK_CAPTURE(forward_in_lanes, scene##_1e6, scene, 1e-6, 8)->Unit(benchmark::kMillisecond);        \
  BENCHMARK_CAPTURE(gradient_one_by_one, scene##_1e6, scene, 1e-6)->Unit(benchmark::kMillisecond);        \
  BENCHMARK_CAPTURE(gradient_in_lanes, scene##_1e6, scene, 1e-6, 8)->Unit(benchmark::kMillisecond);       \
  BENCHMARK_CAPTURE(forward_on_device, scene##_1e6_32, scene, 1e-6, 32)->Unit(benchmark::kMillisecond);   \
  BENCHMARK_CAPTURE(forward_on_device, scene##_1e6_512, scene, 1e-6, 512)->Unit(benchmark::kMillisecond); \
  BENCHMARK_CAPTURE(gradient_on_device, scene##_1e6_512, scene, 1e-6, 512)->Unit(benchmark::kMillisecond)

PLIANT_BATCH_BENCHMARKS(torus);
PLIANT_BATCH_BENCHMARKS(torus_of_many_ratios);
PLIANT_BATCH_BENCHMARKS(bar);

}  // namespace
}  // namespace pliant
