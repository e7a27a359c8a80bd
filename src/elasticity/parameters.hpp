#pragma once

#include "base/types.hpp"

namespace pliant {

/// Everything that one scene depends on, as one vector theta, so that tangents and adjoints with respect to any of it
/// are products with one matrix. After the numbers that every scene has there follow, per plane, its point and its
/// normal; the pulls that hold a released object until it is let go; corrections of what sensors saw, which play no
/// part in the motion; corrections of the scan; and at the very end the control moduli of an object of several (all but
/// the first, which stands at `youngs_modulus`).
namespace theta {
enum Index : int {
  youngs_modulus = 0,     ///< [Pa]
  poissons_ratio = 1,     ///< [-]
  mass_damping = 2,       ///< Rayleigh, [1/s]
  stiffness_damping = 3,  ///< Rayleigh, [s]
  density = 4,            ///< [kg/m^3]
  gravity = 5,            ///< 3, [m/s^2]
  linear_velocity = 8,    ///< 3, of the centre of mass at the start [m/s]
  angular_velocity = 11,  ///< 3, about the centre of mass at the start [rad/s]
  first_plane = 14,
};
inline int plane_point(int plane) { return first_plane + 6 * plane; }       ///< 3, [m]
inline int plane_normal(int plane) { return first_plane + 6 * plane + 3; }  ///< 3, unit
/// 3, of pull k: [-], times the object's size about how far it moves the object (see `Pull`)
inline int pull(int k, int planes) { return first_plane + 6 * planes + 3 * k; }
/// 7, of camera k: its range's error [m], then turn [rad] and shift [m] of its points (see `SensorCorrection`)
inline int sensor(int k, int planes, int pulls) { return pull(pulls, planes) + 7 * k; }
/// 3, of mode k of the scan's correction [-], in standard deviations of the prior (see `ShapeField`)
inline int shape(int k, int planes, int pulls, int sensors) { return sensor(sensors, planes, pulls) + 3 * k; }
inline int size(int planes, int moduli = 1, int pulls = 0, int sensors = 0, int shapes = 0) {
  return shape(shapes, planes, pulls, sensors) + (moduli - 1);
}
/// Where control modulus k of m stands in a theta of this size, [Pa].
inline int modulus(int k, int moduli, Eigen::Index theta_size) {
  return k == 0 ? int(youngs_modulus) : int(theta_size) - moduli + k;
}
inline Vector3 vector_at(const VectorX& theta, int index) { return theta.segment<3>(index); }
}  // namespace theta

/// Lame's constants for a unit Young's modulus and their derivatives with respect to Poisson's ratio.
struct UnitLame {
  double lambda, mu, d_lambda, d_mu;
};
UnitLame unit_lame(double poissons_ratio);

}  // namespace pliant
