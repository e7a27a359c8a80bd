// States that the reverse sweep holds at its most, over the number of frames, as CSV on stdout.
//   pliant_adjoint_memory [BUDGET_MIB]
// A falling ball with few nodes and a small budget: what counts is how the memory grows once the budget is passed.

#include <cstdio>
#include <cstdlib>
#include <memory>

#include "geometry/primitives.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/simulation.hpp"

int main(int argc, char** argv) {
  using namespace pliant;
  const double budget = argc > 1 ? std::atof(argv[1]) : 1.0;
  const TriangleMesh ball = make_sphere(0.05, 3);
  const SignedDistance distance = signed_distance(ball, 0.002, 0.02);
  const auto body = std::make_shared<Body>(make_body(make_hex_grid(distance, bounding_box(ball), 0.02)));
  const MotionLayout layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 5000.0);
  theta[layout.poissons_ratio] = 0.3;
  theta[layout.density] = 100.0;
  theta.segment<3>(layout.gravity) = Vector3(0.0, -9.81, 0.0);
  std::printf("frames,nodes,budget_bytes,all_states_bytes,peak_state_bytes\n");
  for (int frames = 25; frames <= 6400; frames *= 2) {
    SimulationOptions options;
    options.blocks = layout;
    for (int f = 0; f <= frames; ++f) options.times.push_back(f * 1e-3);
    options.max_dt = 1.001e-3;
    options.contact = default_contact(*body, 0.05, 9.81);
    options.memory_budget = std::size_t(budget * (1 << 20));
    Simulation simulation(body, options);
    VectorX theta_bar;
    const RolloutSummary summary = simulation.run_adjoint(
        theta, frames, [](int, const State&) { return true; },
        [](int, const State& state, Points& x_bar) { x_bar += 1e-3 * state.x; }, theta_bar);
    if (!summary.succeeded) return 1;
    const std::size_t all = std::size_t(frames + 1) * 6 * sizeof(double) * std::size_t(body->node_count());
    std::printf("%d,%d,%zu,%zu,%zu\n", frames, body->node_count(), options.memory_budget, all,
                simulation.peak_state_bytes());
  }
}
