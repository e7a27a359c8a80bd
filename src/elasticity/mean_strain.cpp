#include "elasticity/mean_strain.hpp"

#include <cmath>

#include "elasticity/third_derivatives.hpp"

namespace pliant {

namespace {

Matrix3 linear_stress(double lambda, double mu, const Matrix3& strain) {
  Matrix3 stress = 2.0 * mu * strain;
  stress.diagonal().array() += lambda * strain.trace();
  return stress;
}

}  // namespace

MeanStrainCorrection::MeanStrainCorrection(const Matrix3& F, const Polar& polar, const UnitLame& lame)
    : F_(F), polar_(&polar), lame_(lame), cofactors_(pliant::cofactors(F)), strain_(polar.S - Matrix3::Identity()) {
  constexpr double rounding = 0.05;  // e
  J_ = F.col(0).dot(cofactors_.col(0));
  const double root = std::hypot(J_ - 1.0, rounding);
  q_ = root - rounding, dq_ = (J_ - 1.0) / root;
  linear_ = linear_stress(lame.lambda, lame.mu, strain_);
  stress_ = lame.mu * F + ((lame.lambda + lame.mu) * (J_ - 1.0) - lame.mu) * cofactors_ - polar.R * linear_;
}

/// Symmetric as a map of 3 x 3 matrices: a second derivative of `energy`.
Matrix3 MeanStrainCorrection::own_tangent(const Matrix3& dF) const {
  const Matrix3 turn = cross_matrix(rotation_rate(*polar_, dF));
  const Matrix3 d_strain = polar_->R.transpose() * dF - turn * polar_->S;
  const Matrix3 d_linear = turn * linear_ + linear_stress(lame_.lambda, lame_.mu, d_strain);
  return law_tangent(dF) - polar_->R * d_linear;
}

Matrix3 MeanStrainCorrection::law_tangent(const Matrix3& dF) const {
  const double sum = lame_.lambda + lame_.mu;
  return lame_.mu * dF + sum * cofactors_.cwiseProduct(dF).sum() * cofactors_ +
         (sum * (J_ - 1.0) - lame_.mu) * cofactor_change(F_, dF);
}

Matrix3 MeanStrainCorrection::tangent(const Matrix3& H, const Matrix3& dF, const Matrix3& dH) const {
  const Matrix3 dC = cofactor_change(F_, dF);
  const double along = cofactors_.cwiseProduct(H).sum(), dJ = cofactors_.cwiseProduct(dF).sum();
  return own_tangent(dF) + ahead(factor(), dH) +
         factor() * (dC.cwiseProduct(H).sum() * cofactors_ + along * dC + dq_ * dJ * H);
}

MeanStrainCorrection::Cotangents MeanStrainCorrection::adjoint(const Matrix3& H, const Matrix3& W) const {
  const double along = cofactors_.cwiseProduct(H).sum(), across = cofactors_.cwiseProduct(W).sum();
  return {own_tangent(W) + factor() * (across * cofactor_change(F_, H) + along * cofactor_change(F_, W) +
                                       dq_ * H.cwiseProduct(W).sum() * cofactors_),
          ahead(factor(), W)};
}

Matrix3 MeanStrainCorrection::by_poissons_ratio(const Matrix3& H) const {
  const double d_sum = lame_.d_lambda + lame_.d_mu;
  return lame_.d_mu * F_ + (d_sum * (J_ - 1.0) - lame_.d_mu) * cofactors_ -
         polar_->R * linear_stress(lame_.d_lambda, lame_.d_mu, strain_) + ahead(d_sum, H);
}

double MeanStrainCorrection::energy() const {
  const double neo_hookean = 0.5 * lame_.mu * (F_.squaredNorm() - 3.0) - lame_.mu * (J_ - 1.0) +
                             0.5 * (lame_.lambda + lame_.mu) * (J_ - 1.0) * (J_ - 1.0);
  return neo_hookean - 0.5 * strain_.cwiseProduct(linear_).sum();
}

}  // namespace pliant
