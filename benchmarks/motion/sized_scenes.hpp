#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "motion/simulation.hpp"
#include "support/bodies.hpp"
#include "support/parameters.hpp"

namespace pliant::benchmark {

/// A body of about so many nodes, and what happens to it.
struct SizedScene {
  std::shared_ptr<const Body> body;
  SimulationOptions options;
  VectorX theta;
};

/// A soft torus of hexahedra in the middle of an impact, as `step_benchmark` has it.
inline SizedScene sized_torus(int nodes) {
  const double major = 0.1, minor = 0.04;
  const double cell = 0.0178 * std::cbrt(1000.0 / nodes);  // [m]
  SizedScene scene;
  {
    const SignedDistance distance = test::torus_distance(major, minor, cell / 2, 3 * cell);
    const Box box = test::centred_box(Vector3(major + minor, minor, major + minor));
    scene.body = std::make_shared<Body>(make_body(make_hex_grid(distance, box, cell)));
  }
  const MotionLayout layout({.planes = 1});
  scene.options.blocks = layout;
  scene.theta = test::torus_values(layout);
  const PlaneBlock& plane = layout.planes.front();
  scene.theta.segment<3>(plane.point) = Vector3(0.0, -minor + 0.005, 0.0);
  scene.theta.segment<3>(plane.normal) = Vector3::UnitY();
  scene.options.max_dt = default_time_step(*scene.body, 9.81);
  scene.options.contact = default_contact(*scene.body, scene.theta[layout.density] * scene.body->volume(), 9.81);
  return scene;
}

/// A clamped bar of linear tetrahedra, 1 x 0.25 x 0.25 m, let go under gravity.
inline SizedScene sized_bar(int nodes, double youngs_modulus) {
  const int across = std::max(2, int(std::lround(std::cbrt(nodes / 4.0))) - 1);
  Box box;
  box.extend(Vector3::Zero());
  box.extend(Vector3(1.0, 0.25, 0.25));
  SizedScene scene;
  scene.body = std::make_shared<Body>(make_body(make_tet_box(box, {4 * across, across, across}, false)));
  const MotionLayout layout;
  scene.options.blocks = layout;
  scene.theta = layout.zero();
  layout.set_moduli(scene.theta, youngs_modulus);
  scene.theta[layout.poissons_ratio] = 0.4;
  scene.theta[layout.mass_damping] = 0.1;
  scene.theta[layout.stiffness_damping] = 0.001;
  scene.theta[layout.density] = 1000.0;
  scene.theta.segment<3>(layout.gravity) = Vector3(0.0, -9.81, 0.0);
  scene.options.max_dt = default_time_step(*scene.body, 9.81);
  scene.options.holds.push_back({.contains = [](const Vector3& p) { return p.x() < 1e-6; }});
  return scene;
}

/// @param name  torus, bar (E = 1 MPa) or stiff_bar (100 MPa)
/// Throws std::invalid_argument for another.
inline SizedScene sized_scene(const std::string& name, int nodes) {
  if (name == "torus") return sized_torus(nodes);
  if (name == "bar") return sized_bar(nodes, 1e6);
  if (name == "stiff_bar") return sized_bar(nodes, 1e8);
  throw std::invalid_argument("no such case: " + name + "; there are torus, bar and stiff_bar");
}

}  // namespace pliant::benchmark
