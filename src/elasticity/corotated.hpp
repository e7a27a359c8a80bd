#pragma once

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "elasticity/polar.hpp"

namespace pliant {

/// Corotated linear elasticity with one rotation an element (Weiss 2020, eq. 31), rotations lagged:
///   f(z | p) = - sum_e R_e(p) K_e (R_e(p)^T z - X).
class CorotatedElasticity : public ForceTerm {
 public:
  explicit CorotatedElasticity(std::shared_ptr<const Body> body);

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::Blended; }
  void set_parameters(const VectorX& theta) override;
  void linearise(const Points& lag) override;
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

  /// Elastic energy [J] of the positions with the rotations of the lag point.
  double energy(const Points& z) const;
  const Polar& rotation(int element) const { return polar_[element]; }

 private:
  using Vector24 = Eigen::Matrix<double, 24, 1>;
  struct Stiffness {
    Matrix24 K, dK;                     ///< for E = 1, and derivative by Poisson's ratio
    Eigen::Matrix<double, 40, 9> upper; ///< entry (i, j) in column 3 i + j of the 36 blocks a <= b, padded
  };
  const Stiffness& stiffness(int element) const { return stiffness_[body_->element_class[element]]; }
  double modulus(int element) const { return youngs_modulus_ * body_->relative_modulus[element]; }
  /// R^T z for the element's nodes.
  Vector24 unrotated(int element, const Points& z) const;

  std::shared_ptr<const Body> body_;
  double youngs_modulus_ = 0.0, poissons_ratio_ = -1.0;
  std::vector<Stiffness> stiffness_;
  std::vector<Vector24> reference_;                 // X of the element's nodes, relative to the first
  std::vector<std::array<int, 64>> block_of_pair_;  // where block (a, b) of the element goes in the matrix
  std::vector<Polar> polar_;
};

}  // namespace pliant
