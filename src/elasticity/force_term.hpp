#pragma once

#include <memory>
#include <optional>
#include <span>

#include "solvers/block_matrix.hpp"

namespace pliant {

struct Body;

/// The step in which forces act, for those that depend on more than positions: friction on the way since the start,
/// wind on velocities, led bodies on the time.
struct StepContext {
  const Points* start = nullptr;           ///< positions at the step's start [m]; null: at rest, there is no step
  const Points* start_velocity = nullptr;  ///< velocities there [m/s]
  double time = 0.0;                       ///< of the step's start [s]
  double dt = 0.0;                         ///< length of the step [s]
  double contact_weight = 1.0;             ///< where in the step contact acts, times its length
};

/// Changes of the lag point p, of z and of theta along several directions, some of those that tangents of one step or
/// equilibrium go along. They refer to what their maker keeps alive.
struct ForceChanges {
  std::span<const Points*const> lag, z;  ///< n x 3 each [m], as many as there are directions
  Eigen::Ref<const MatrixX> theta;       ///< one direction a column
  Eigen::Index first = 0;                ///< number of the first one among those that were made ready
};

/// A force of the scene, made affine about a lag point p for one linearly implicit step:
///   f(z | p) = f_p - K_p z.
/// Each term knows its force, its matrix, its potential where it has one, and the two products that differentiation
/// needs. Positions and forces are n x 3 [m], [N]; they may have further rows below, where rigid bodies are unknown.
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
  /// The step that the calls below belong to. What it points to stays alive and unchanged until the next one.
  virtual void begin_step(const StepContext& step) { (void)step; }
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
  /// matrix += scale times -df(x | x)/dx, the exact stiffness, at the lag point.
  /// @param x  the lag point
  virtual void add_tangent_stiffness(const Points& x, double scale, BlockMatrix& matrix) {
    add_matrix(scale, matrix);
    add_lag_matrix(x, scale, matrix);
  }
  /// Energy [J] whose negative gradient is f(x | x), at the lag point; nothing for forces that have none.
  /// @param x  the lag point
  virtual std::optional<double> potential(const Points& x) {
    (void)x;
    return std::nullopt;
  }
  /// force += df for changes of p, z and theta
  virtual void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                                 Points& force) = 0;
  /// Makes ready for `add_force_tangents` at z.
  /// @param d_theta  changes of theta along all directions, one a column
  virtual void prepare_tangents(const Points& z, const Eigen::Ref<const MatrixX>& d_theta) { (void)z, (void)d_theta; }
  /// The same as `add_force_tangent` along several directions at once, each into its own force: elements whose
  /// stiffness is large read it once for all. Once it was made ready, threads may call it side by side, each for
  /// directions of its own, and `add_start_tangent` and `add_reference_tangents` with it.
  /// @param forces  n x 3 each [N], as many as directions
  virtual void add_force_tangents(const Points& z, const ForceChanges& changes, std::span<Points> forces) {
    VectorX direction;
    for (std::size_t c = 0; c < forces.size(); ++c) {
      direction = changes.theta.col(Eigen::Index(c));
      add_force_tangent(z, *changes.lag[c], *changes.z[c], direction, forces[c]);
    }
  }
  /// Adds the cotangents of p, z and theta for the cotangent `w` of f.
  virtual void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar,
                                 VectorX& theta_bar) = 0;

  /// Whether the force depends on the step's start other than through p and z; only then are the two products below
  /// called.
  virtual bool sees_start() const { return false; }
  /// Whether z and the step's start enter only as their difference (p aside), the way since the start: a change of the
  /// start that moves both changes nothing.
  virtual bool sees_way_alone() const { return false; }
  /// force += df for a change of the step's start, p, z and theta staying as they are.
  virtual void add_start_tangent(const Points& z, const Points& d_start, const Points& d_start_velocity,
                                 Points& force) {
    (void)z, (void)d_start, (void)d_start_velocity, (void)force;
  }
  /// Adds the cotangents of the step's start for the cotangent `w` of f.
  virtual void add_start_adjoint(const Points& z, const Points& w, Points& start_bar, Points& start_velocity_bar) {
    (void)z, (void)w, (void)start_bar, (void)start_velocity_bar;
  }

  /// From now on the nodes are stress-free where this body has them, the same but for its reference
  /// (`with_reference`). Only then does a term have derivatives by the reference; most do not depend on it. Parameters
  /// are to be set anew. Throws std::invalid_argument where the term depends on it and has no derivatives.
  virtual void set_reference(const std::shared_ptr<const Body>& body) { (void)body; }
  /// Makes ready for the two products below, about the lag point and z.
  virtual void linearise_reference(const Points& z) { (void)z; }
  /// force += df for a change of the stress-free reference positions, p, z and theta staying as they are, along
  /// several directions at once, each into its own force.
  /// @param d_references  n x 3 each [m], as many as forces [N]
  virtual void add_reference_tangents(std::span<const Points* const> d_references, std::span<Points* const> forces) {
    (void)d_references, (void)forces;
  }
  /// The same along one direction.
  void add_reference_tangent(const Points& d_reference, Points& force) {
    const Points* along = &d_reference;
    Points* into = &force;
    add_reference_tangents({&along, 1}, {&into, 1});
  }
  /// Adds the cotangent of the reference positions for the cotangent `w` of f.
  virtual void add_reference_adjoint(const Points& w, Points& reference_bar) { (void)w, (void)reference_bar; }
};

}  // namespace pliant
