#pragma once

#include "solvers/block_matrix.hpp"

namespace pliant {

/// A force of the scene, made affine about a lag point p for one linearly implicit step:
///   f(z | p) = f_p - K_p z.
/// Each term knows its force, its matrix, and the two products that differentiation needs; nothing else in the program
/// differentiates physics. Positions and forces are n x 3 [m], [N].
class ForceTerm {
 public:
  virtual ~ForceTerm() = default;

  /// p: where the start's velocities would bring the positions within the step, at the time that suits rotations or
  /// at the time that suits contact.
  enum class Lag { Rotation, Contact };
  /// z: between the step's start and end by Newmark's theta, with the stiffness damping's share; by the contact's own
  /// weight; or the step's end.
  enum class At { Blended, Contact, End };

  virtual Lag lag() const = 0;
  virtual At at() const = 0;

  /// Takes the term's own parameters out of a parameter vector, by the handles that it was made with.
  virtual void set_parameters(const VectorX& theta) = 0;
  /// Fixes the lag point; the calls below refer to it.
  virtual void linearise(const Points& lag) = 0;
  /// force += f(z | p)
  virtual void add_force(const Points& z, Points& force) = 0;
  /// matrix += scale K_p
  virtual void add_matrix(double scale, BlockMatrix& matrix) = 0;
  /// matrix += scale times -df/dp at z: what K_p leaves out of the exact stiffness of f(z | p) where p moves with z.
  /// Not symmetric in general. Terms whose affine form is exact where z = p add nothing.
  virtual void add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) {
    (void)z, (void)scale, (void)matrix;
  }
  /// force += df for changes of p, z and theta
  virtual void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                                 Points& force) = 0;
  /// Adds the cotangents of p, z and theta for the cotangent `w` of f.
  virtual void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar,
                                 VectorX& theta_bar) = 0;

  /// Makes ready for the two products below, about the lag point and z. Most terms do not ask where the object is free
  /// of load.
  virtual void linearise_reference(const Points& z) { (void)z; }
  /// force += df for a change of where the nodes are free of load, p, z and theta staying as they are.
  virtual void add_reference_tangent(const Points& d_reference, Points& force) { (void)d_reference, (void)force; }
  /// Adds the cotangent of where they are, for the cotangent `w` of f.
  virtual void add_reference_adjoint(const Points& w, Points& reference_bar) { (void)w, (void)reference_bar; }
};

}  // namespace pliant
