#pragma once

#include <cmath>
#include <memory>

#include "motion/simulation.hpp"

namespace pliant::test {

inline SignedDistance torus_distance(double major, double minor, double spacing, double margin) {
  Box box;
  box.extend(Vector3(-major - minor - margin, -minor - margin, -major - minor - margin));
  box.extend(-box.min);
  return SignedDistance(box, spacing, [=](const Vector3& p) {
    return std::hypot(std::hypot(p.x(), p.z()) - major, p.y()) - minor;
  });
}

inline std::shared_ptr<const Body> torus_body(double major, double minor, double cell_size, const BodyOptions& options = {}) {
  const SignedDistance distance = torus_distance(major, minor, cell_size / 6, 3 * cell_size);
  Box box;
  box.extend(Vector3(-major - minor, -minor, -major - minor));
  box.extend(-box.min);
  return std::make_shared<Body>(make_body(make_hex_grid(distance, box, cell_size), options));
}

/// A small tilted, spinning torus hitting a tilted plane: every parameter matters.
struct TorusScene {
  std::shared_ptr<const Body> body;
  SimulationOptions options;
  VectorX theta;
};

inline TorusScene torus_scene(double cell_size, int frames, SolverKind solver = SolverKind::Cholmod) {
  TorusScene scene;
  scene.body = torus_body(0.1, 0.04, cell_size);
  for (int f = 0; f < frames; ++f) scene.options.times.push_back(f / 60.0);
  scene.options.max_dt = 1.0 / 240.0 + 1e-9;
  scene.options.planes = 1;
  scene.options.solver.kind = solver;
  scene.options.solver.tolerance = 1e-13;
  scene.options.contact = default_contact(*scene.body, 100.0 * scene.body->volume(), 9.81);
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
