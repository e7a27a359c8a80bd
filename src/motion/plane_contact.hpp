#pragma once

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "parameters/motion_blocks.hpp"

namespace pliant {

struct ContactOptions {
  double stiffness = 0.0;  ///< pressure for a penetration [Pa/m], > 0
  double smoothing = 0.0;  ///< length over which the contact sets in [m], > 0
};

/// Penalty contact of the surface with one plane: pressure k softplus(-gap), the soft minimum of Weiss 2020, eq. 18,
/// integrated over surface samples through the embedding.
/// The force during the step follows from the time derivative (eq. 19), taken further than the paper does: it is
/// linearised about the predicted positions x + w dt v, with its slope in the step's matrix, so that a fast impact is
/// stopped in the step in which it happens and stiff contact stays stable.
class PlaneContact : public ForceTerm {
 public:
  PlaneContact(std::shared_ptr<const Body> body, const PlaneBlock& plane, const ContactOptions& options);

  Lag lag() const override { return Lag::Contact; }
  At at() const override { return At::Contact; }
  void set_parameters(const VectorX& theta) override;
  void linearise(const Points& lag) override;
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

  /// Surface samples that press on the plane at the lag point.
  int active_count() const { return int(active_.size()); }

 private:
  struct Active {
    int point;
    Vector3 lag_position;
    double gap;                      // at the lag point [m]
    double force, slope, curvature;  // k a s(gap) and its derivatives by the gap
  };
  double gap(const Vector3& position) const { return normal_.dot(position - plane_point_); }

  std::shared_ptr<const Body> body_;
  PlaneBlock plane_;
  ContactOptions options_;
  Embedding embedding_;
  std::vector<int> blocks_;  // where each element's blocks go in the matrix
  Vector3 plane_point_ = Vector3::Zero(), normal_ = Vector3::UnitY();
  std::vector<Active> active_;
};

}  // namespace pliant
