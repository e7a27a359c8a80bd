#include "elasticity/element_moduli.hpp"

namespace pliant {

void ElementModuli::set_parameters(const VectorX& parameters) {
  const ModulusField& field = body_->modulus;
  const Eigen::Map<const VectorX> relative(field.relative.data(), Eigen::Index(field.relative.size()));
  controls_.resize(field.controls);
  for (int k = 0; k < field.controls; ++k)
    controls_[k] = parameters[theta::modulus(k, field.controls, parameters.size())];
  if (is_homogeneous())
    values_ = controls_[0] * relative;
  else
    values_ = relative.array() * (field.weights * controls_.array().log().matrix()).array().exp();
}

void ElementModuli::set_change(const VectorX& d_theta) {
  const int m = body_->modulus.controls;
  VectorX d_log(m);
  for (int k = 0; k < m; ++k) d_log[k] = d_theta[theta::modulus(k, m, d_theta.size())] / controls_[k];
  uniform_change_ = d_log[0];
  if (m > 1) log_change_.noalias() = body_->modulus.weights * d_log;
}

void ElementModuli::end_adjoint(VectorX& theta_bar) const {
  const int m = body_->modulus.controls;
  if (m == 1) {
    theta_bar[theta::youngs_modulus] += log_bar_[0] / controls_[0];
    return;
  }
  const VectorX bar = body_->modulus.weights.transpose() * log_bar_;
  for (int k = 0; k < m; ++k) theta_bar[theta::modulus(k, m, theta_bar.size())] += bar[k] / controls_[k];
}

}  // namespace pliant
