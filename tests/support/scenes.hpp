#pragma once

#include "motion/simulation.hpp"
#include "support/bodies.hpp"

namespace pliant::test {

/// A small tilted, spinning torus hitting a tilted plane: every parameter matters.
struct TorusScene {
  std::shared_ptr<const Body> body;
  SimulationOptions options;
  VectorX theta;
};

/// The torus meets the plane within the first frame interval and has turned round after the fourth.
/// @param solver_tolerance  far below what differences over steps of 1e-5 can see
inline TorusScene torus_scene(double cell_size, int frames, SolverKind solver = SolverKind::Iterative,
                              double solver_tolerance = 1e-13) {
  TorusScene scene;
  scene.body = torus_body(0.1, 0.04, cell_size);
  for (int f = 0; f < frames; ++f) scene.options.times.push_back(f / 60.0);
  scene.options.max_dt = 1.0 / 240.0 + 1e-9;
  scene.options.planes = 1;
  scene.options.solver.kind = solver;
  scene.options.solver.tolerance = solver_tolerance;
  scene.options.contact = default_contact(*scene.body, 100.0 * scene.body->volume(), 9.81);
  // Set here rather than by default: the scene's steps are long, and contact that sets in over much less than the body
  // moves in one gives the cost many small valleys.
  scene.options.contact.smoothing = 6e-4;
  scene.theta.setZero(theta::size(1));
  scene.theta[theta::youngs_modulus] = 4000.0;
  scene.theta[theta::poissons_ratio] = 0.35;
  scene.theta[theta::mass_damping] = 0.3;
  scene.theta[theta::stiffness_damping] = 0.003;
  scene.theta[theta::density] = 100.0;
  scene.theta.segment<3>(theta::gravity) = Vector3(0.1, -9.7, 0.2);
  scene.theta.segment<3>(theta::linear_velocity) = Vector3(0.2, -1.5, 0.1);
  scene.theta.segment<3>(theta::angular_velocity) = Vector3(1.0, -2.0, 3.0);
  scene.theta.segment<3>(theta::plane_point(0)) = Vector3(0.01, -0.06, 0.02);
  scene.theta.segment<3>(theta::plane_normal(0)) = Vector3(0.1, 1.0, -0.05).normalized();
  return scene;
}

}  // namespace pliant::test
