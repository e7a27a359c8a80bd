#pragma once

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "geometry/key_frames.hpp"
#include "parameters/motion_blocks.hpp"

namespace pliant {

/// A force that does not depend on where the object is. Its potential is -f . (x - X).
class DeadLoad : public ForceTerm {
 public:
  /// @param rest  where the potential is zero, n x 3 [m]; positions may have further rows
  explicit DeadLoad(Points rest) : rest_(std::move(rest)) {}
  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  void linearise(const Points&) override {}
  void add_matrix(double, BlockMatrix&) override {}
  std::optional<double> potential(const Points& x) override;

 private:
  Points rest_, force_;
};

/// Forces at nodes that are given as they are.
class NodalLoad : public DeadLoad {
 public:
  explicit NodalLoad(const Body& body) : DeadLoad(body.nodes), forces_(Points::Zero(body.node_count(), 3)) {}
  /// @param forces  n x 3 [N]
  void set_forces(Points forces) { forces_ = std::move(forces); }
  const Points& forces() const { return forces_; }
  void set_parameters(const VectorX&) override {}
  void add_force(const Points&, Points& force) override { force.topRows(forces_.rows()) += forces_; }
  void add_force_tangent(const Points&, const Points&, const Points&, const VectorX&, Points&) override {}
  void add_force_adjoint(const Points&, const Points&, Points&, Points&, VectorX&) override {}

 private:
  Points forces_;
};

/// Weight: f = rho M1 g(t).
class Gravity : public DeadLoad {
 public:
  /// @param change  of gravity over time, added to that of the parameter vector [m/s^2]
  Gravity(const Body& body, const MotionBlocks& blocks, KeyFrames<3> change = {});
  void set_parameters(const VectorX& theta) override;
  void begin_step(const StepContext& step) override { change_now_ = change_.at(step.time + 0.5 * step.dt); }
  void add_force(const Points& z, Points& force) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

 private:
  ParameterHandle density_block_, gravity_block_;
  VectorX nodal_volume_;  // M1 summed over columns [m^3]
  double density_ = 0.0;
  Vector3 gravity_ = Vector3::Zero();
  KeyFrames<3> change_;
  Vector3 change_now_ = Vector3::Zero();
};

/// A point mass attached to the object.
struct PointMass {
  Vector3 at;         ///< rest position [m]
  double mass = 0.0;  ///< [kg]
};

/// Weights hung from the object: f = sum_i m_i g at their points. Their inertia is the stepper's (`Stepper::carry`).
class PointWeights : public DeadLoad {
 public:
  /// @param gravity  3, [m/s^2]
  /// @param change   see `Gravity`
  PointWeights(const Body& body, const std::vector<PointMass>& weights, const ParameterHandle& gravity,
               KeyFrames<3> change = {});
  const Embedding& points() const { return points_; }
  const std::vector<double>& masses() const { return mass_; }
  /// Nothing hangs while it is not active.
  void set_active(bool active) { is_active_ = active; }
  void set_parameters(const VectorX& theta) override { gravity_ = gravity_block_.vector(theta); }
  void begin_step(const StepContext& step) override { change_now_ = change_.at(step.time + 0.5 * step.dt); }
  void add_force(const Points& z, Points& force) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

 private:
  ParameterHandle gravity_block_;
  Embedding points_;
  std::vector<double> mass_;
  Vector3 gravity_ = Vector3::Zero();
  KeyFrames<3> change_;
  Vector3 change_now_ = Vector3::Zero();
  bool is_active_ = true;
};

}  // namespace pliant
