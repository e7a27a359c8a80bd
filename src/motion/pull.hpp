#pragma once

#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"

namespace pliant {

/// What holds an object in the pose from which it is released: forces spread smoothly about a few nodes,
///   f_n = E_0 sum_k w_k(X_n) V_n c_k / s_k,
/// with w_k a Gaussian about node k, V_n the node's volume, and s_k (of each axis) such that a unit c_k would move the
/// object by its size, by linear elasticity from rest. E_0 is the geometric mean of the control moduli, so that the
/// pose hardly depends on how stiff the object is thought to be.
class Pull : public ForceTerm {
 public:
  /// @param about        nodes, see `pull_nodes`
  /// @param held         nodes that stay where they are
  /// @param first_index  of the pulls c_k in theta, three each
  /// Throws InputError where the held nodes do not hold the object.
  Pull(const std::shared_ptr<const Body>& body, const std::vector<int>& about, const std::vector<int>& held,
       int first_index);

  /// Nothing pulls while it is not active.
  void set_active(bool active) { is_active_ = active; }

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  void set_parameters(const VectorX& theta) override;
  void linearise(const Points&) override {}
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double, BlockMatrix&) override {}
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

 private:
  Eigen::Index count() const { return spread_.cols(); }
  int moduli_, first_index_;
  bool is_active_ = true;
  MatrixX spread_;     // n x k: w_k(X_n) V_n [m^3]
  Points strength_;    // k x 3: 1 / s_k [1/m]
  Points pulls_;       // k x 3: c_k / s_k
  VectorX moduli_at_;  // [Pa]
  double mean_ = 0.0;  // of the moduli
};

/// Nodes about which a released object is pulled: far from what is held and from each other.
std::vector<int> pull_nodes(const Body& body, const std::vector<int>& held, int count);

}  // namespace pliant
