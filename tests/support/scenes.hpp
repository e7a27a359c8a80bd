#pragma once

#include "motion/simulation.hpp"
#include "support/bodies.hpp"
#include "support/parameters.hpp"

namespace pliant::test {

/// A small tilted, spinning torus hitting a tilted plane: every parameter matters.
struct TorusScene {
  MotionLayout layout;
  std::shared_ptr<const Body> body;
  SimulationOptions options;
  VectorX theta;
};

/// The torus meets the plane within the first frame interval and has turned round after the fourth.
/// @param solver_tolerance  far below what differences over steps of 1e-5 can see
/// @param planes            0: nothing is there to hit
inline TorusScene torus_scene(double cell_size, int frames, SolverKind solver = SolverKind::Iterative,
                              double solver_tolerance = 1e-13, int planes = 1) {
  TorusScene scene;
  scene.layout = MotionLayout({.planes = planes});
  scene.body = torus_body(0.1, 0.04, cell_size);
  for (int f = 0; f < frames; ++f) scene.options.times.push_back(f / 60.0);
  scene.options.max_dt = 1.0 / 240.0 + 1e-9;
  scene.options.blocks = scene.layout;
  scene.options.solver.kind = solver;
  scene.options.solver.tolerance = solver_tolerance;
  scene.options.contact = default_contact(*scene.body, 100.0 * scene.body->volume(), 9.81);
  // Set here rather than by default: the scene's steps are long, and contact that sets in over much less than the body
  // moves in one gives the cost many small valleys.
  scene.options.contact.smoothing = 6e-4;
  scene.theta = torus_values(scene.layout);
  return scene;
}

}  // namespace pliant::test
