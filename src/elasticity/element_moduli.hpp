#pragma once

#include "elasticity/body.hpp"
#include "parameters/motion_blocks.hpp"

namespace pliant {

/// Young's modulus of every element out of a parameter vector, with its derivatives (`ModulusField`).
class ElementModuli {
 public:
  /// Throws std::invalid_argument where there is not one block for each control of the body's field.
  ElementModuli(std::shared_ptr<const Body> body, const MaterialBlocks& blocks);

  void set_parameters(const VectorX& theta);
  double operator[](int element) const { return values_[std::size_t(element)]; }  ///< [Pa]

  /// Sets the change of every element's ln E for changes of theta, one a column.
  void set_changes(const Eigen::Ref<const MatrixX>& d_theta);
  /// Along one of them.
  double log_change(int element, Eigen::Index direction = 0) const {
    return log_changes_(is_homogeneous() ? 0 : element, direction);
  }

  /// Collects cotangents of ln E_e ...
  void begin_adjoint() { log_bar_.setZero(is_homogeneous() ? 1 : body_->element_count()); }
  void add_log_adjoint(int element, double bar) { log_bar_[is_homogeneous() ? 0 : element] += bar; }
  /// ... and hands them on to theta.
  void end_adjoint(VectorX& theta_bar) const;

 private:
  bool is_homogeneous() const { return body_->modulus.controls == 1; }

  std::shared_ptr<const Body> body_;
  std::vector<ParameterHandle> blocks_;  // of the control moduli
  VectorX controls_, values_, log_bar_;
  MatrixX controls_change_, log_changes_;  // of ln E: controls, and elements or the one of all, x directions
};

/// Young's modulus over a body and how sure it is, to first order in the deviations.
struct ModulusStatistics {
  VectorX value, std;                 ///< of each element [Pa]
  double mean = 0.0, mean_std = 0.0;  ///< weighted by volume [Pa]
};

/// @param log_covariance  of ln E_k of the control moduli; m x m, or empty: nothing is known, deviations are zero
ModulusStatistics modulus_statistics(const std::shared_ptr<const Body>& body, const MaterialBlocks& blocks,
                                     const VectorX& theta, const MatrixX& log_covariance);

}  // namespace pliant
