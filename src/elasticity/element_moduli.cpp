#include "elasticity/element_moduli.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pliant {

ElementModuli::ElementModuli(std::shared_ptr<const Body> body, const MaterialBlocks& blocks)
    : body_(std::move(body)), blocks_(blocks.youngs_moduli) {
  if (int(blocks_.size()) != body_->modulus.controls)
    throw std::invalid_argument("a body of " + std::to_string(body_->modulus.controls) + " control moduli and " +
                                std::to_string(blocks_.size()) + " parameter blocks for them");
}

void ElementModuli::set_parameters(const VectorX& parameters) {
  const ModulusField& field = body_->modulus;
  const Eigen::Map<const VectorX> relative(field.relative.data(), Eigen::Index(field.relative.size()));
  controls_.resize(field.controls);
  for (int k = 0; k < field.controls; ++k) controls_[k] = parameters[blocks_[std::size_t(k)]];
  if (is_homogeneous())
    values_ = controls_[0] * relative;
  else
    values_ = relative.array() * (field.weights * controls_.array().log().matrix()).array().exp();
}

void ElementModuli::set_changes(const Eigen::Ref<const MatrixX>& d_theta) {
  const int m = body_->modulus.controls;
  controls_change_.resize(m, d_theta.cols());
  for (int k = 0; k < m; ++k)
    controls_change_.row(k) = d_theta.row(Eigen::Index(blocks_[std::size_t(k)])) / controls_[k];
  if (is_homogeneous())
    log_changes_ = controls_change_;
  else
    log_changes_.noalias() = body_->modulus.weights * controls_change_;
}

void ElementModuli::end_adjoint(VectorX& theta_bar) const {
  const int m = body_->modulus.controls;
  if (m == 1) {
    theta_bar[blocks_.front()] += log_bar_[0] / controls_[0];
    return;
  }
  const VectorX bar = body_->modulus.weights.transpose() * log_bar_;
  for (int k = 0; k < m; ++k) theta_bar[blocks_[std::size_t(k)]] += bar[k] / controls_[k];
}

ModulusStatistics modulus_statistics(const std::shared_ptr<const Body>& body, const MaterialBlocks& blocks,
                                     const VectorX& theta, const MatrixX& log_covariance) {
  ElementModuli moduli(body, blocks);
  moduli.set_parameters(theta);
  const int elements = body->element_count(), controls = body->modulus.controls;
  ModulusStatistics s;
  s.value.resize(elements);
  s.std = VectorX::Zero(elements);
  VectorX by_log = VectorX::Zero(controls);  // of the mean
  const double total = body->volume();
  for (int e = 0; e < elements; ++e) {
    s.value[e] = moduli[e];
    const VectorX weights = controls == 1 ? VectorX::Ones(1) : VectorX(body->modulus.weights.row(e).transpose());
    const double share = body->element_volume[std::size_t(e)] / total;
    s.mean += share * s.value[e];
    by_log += share * s.value[e] * weights;
    if (log_covariance.size() > 0)
      s.std[e] = s.value[e] * std::sqrt(std::max(0.0, weights.dot(log_covariance * weights)));
  }
  if (log_covariance.size() > 0) s.mean_std = std::sqrt(std::max(0.0, by_log.dot(log_covariance * by_log)));
  return s;
}

}  // namespace pliant
