#pragma once

#include <functional>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"

namespace pliant {

/// A part of the object that is held, and where.
struct Hold {
  std::function<bool(const Vector3&)> contains;  ///< of a rest position
  Matrix3 rotation = Matrix3::Identity();        ///< from rest to where it is held
  Vector3 translation = Vector3::Zero();
};

/// Nodes inside any hold.
std::vector<int> held_nodes(const Body& body, const std::vector<Hold>& holds);

/// Held regions by Nitsche's method (Weiss 2020, appendix A.3) on the part of the surface inside them, symmetric form,
/// with the penalty also on the volume inside. Linear in the frame in which the region is held:
///   f(z) = - R K (R^T (z - t) - X), K constant.
class FixedRegions : public ForceTerm {
 public:
  /// @param penalty  in units of (lambda + 2 mu) / h; large enough that the form stays positive definite on cut cells
  /// Throws InputError where a hold contains nothing of the object.
  FixedRegions(std::shared_ptr<const Body> body, const std::vector<Hold>& holds, double penalty = 40.0);

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  void set_parameters(const VectorX& theta) override;
  void linearise(const Points&) override {}
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

  int held_cell_count() const { return int(cells_.size()); }

 private:
  struct HeldCell {
    int cell;
    int hold;
    Matrix24 K_lambda, K_mu;  // for unit Lame constants
    Matrix24 K, dK;           // for E = 1 and its derivative by Poisson's ratio
  };
  using Vector24 = Eigen::Matrix<double, 24, 1>;
  Vector24 displacement(const HeldCell& held, const Points& z) const;
  Vector24 rotated_back(const HeldCell& held, const Points& vectors) const;

  std::shared_ptr<const Body> body_;
  std::vector<Hold> holds_;
  std::vector<HeldCell> cells_;
  double youngs_modulus_ = 0.0;
};

}  // namespace pliant
