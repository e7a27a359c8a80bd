#pragma once

#include "parameters/motion_blocks.hpp"
#include "parameters/parameter_set.hpp"

namespace pliant::test {

/// Of a soft torus that spins onto a tilted plane, or that no plane stops.
inline VectorX torus_values(const MotionLayout& layout) {
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 4000.0);
  theta[layout.poissons_ratio] = 0.35;
  theta[layout.mass_damping] = 0.3;
  theta[layout.stiffness_damping] = 0.003;
  theta[layout.density] = 100.0;
  theta.segment<3>(layout.gravity) = Vector3(0.1, -9.7, 0.2);
  theta.segment<3>(layout.linear_velocity) = Vector3(0.2, -1.5, 0.1);
  theta.segment<3>(layout.angular_velocity) = Vector3(1.0, -2.0, 3.0);
  for (const PlaneBlock& plane : layout.planes) {
    theta.segment<3>(plane.point) = Vector3(0.01, -0.06, 0.02);
    theta.segment<3>(plane.normal) = Vector3(0.1, 1.0, -0.05).normalized();
  }
  return theta;
}

/// All that such a motion has, at these values; none is estimated yet.
inline ParameterSet torus_parameters(const MotionLayout& layout, const VectorX& theta) {
  std::vector<Parameter> list = {
      {"youngs_modulus", "Pa", Transform::Logarithm, layout.youngs_moduli[0], 1.0, 1.0, 1e7},
      {"poissons_ratio", "1", Transform::LogitHalf, layout.poissons_ratio, 1.0, 0.02, 0.495},
      {"mass_damping", "1/s", Transform::InverseSinh, layout.mass_damping, 0.3, 1e-4, 1e3},
      {"stiffness_damping", "s", Transform::InverseSinh, layout.stiffness_damping, 0.004, 1e-6, 1.0},
      {"density", "kg/m^3", Transform::Logarithm, layout.density, 1.0, 1.0, 1e4},
      {"gravity", "m/s^2", Transform::Vector, layout.gravity, 2.0},
      {"linear_velocity", "m/s", Transform::Vector, layout.linear_velocity, 0.5},
      {"angular_velocity", "rad/s", Transform::Vector, layout.angular_velocity, 3.0}};
  for (const PlaneBlock& plane : layout.planes)
    list.push_back({"plane", "", Transform::PlanePosition, plane.whole(), 0.1});
  return {layout.layout(), std::move(list), theta};
}

}  // namespace pliant::test
