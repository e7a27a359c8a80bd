#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "elasticity/third_derivatives.hpp"

namespace pliant {

void NeoHookeanLaw::check(const MatrixX& table) const {
  if (table.cols() != 2) throw std::invalid_argument("the neo-Hookean law has two parameters an element");
  for (Eigen::Index e = 0; e < table.rows(); ++e)
    if (!(table(e, 0) > 0.0 && table(e, 1) > -2.0 / 3.0 * table(e, 0)))
      throw std::invalid_argument("the neo-Hookean law needs mu > 0 and lambda > -2 mu / 3");
}

/// P = mu (F - G) + lambda ln J G,  G = F^-T,  dG = -G dF^T G.
void NeoHookeanLaw::stress(int e, const Matrix3& F, bool with_tangent, PointStress& out) const {
  const double mu = table_(e, 0), lambda = table_(e, 1), J = F.determinant();
  if (!(J > 0.0)) {
    out.energy = std::numeric_limits<double>::infinity();
    return;
  }
  const double log_J = std::log(J);
  const Matrix3 G = F.inverse().transpose();
  out.energy = 0.5 * mu * (F.squaredNorm() - 3.0) - mu * log_J + 0.5 * lambda * log_J * log_J;
  out.P = mu * (F - G) + lambda * log_J * G;
  if (!with_tangent) return;
  out.left.setIdentity();
  out.right.setIdentity();
  out.tangent = mu * Matrix9::Identity() + lambda * vec(G) * vec(G).transpose();
  add_crossed(mu - lambda * log_J, G, G, out.tangent);
}

void NeoHookeanLaw::parameter_derivatives(int, const Matrix3& F, std::span<Matrix3> out) const {
  const double J = F.determinant();
  for (Matrix3& derivative : out) derivative.setZero();
  if (!(J > 0.0)) return;
  const Matrix3 G = F.inverse().transpose();
  out[0] = F - G;
  out[1] = std::log(J) * G;
}

Matrix9 NeoHookeanLaw::tangent_derivative(int e, const Matrix3& F, const Matrix3& dF) const {
  const double mu = table_(e, 0), lambda = table_(e, 1), J = F.determinant();
  if (!(J > 0.0)) return Matrix9::Constant(std::numeric_limits<double>::quiet_NaN());
  return volumetric_tangent_change(lambda * std::log(J) - mu, lambda, 0.0, F, dF);
}

void NeoHookeanLaw::parameter_derivative_changes(int, const Matrix3& F, const Matrix3& dF,
                                                 std::span<Matrix3> out) const {
  const Matrix3 G = F.inverse().transpose(), dG = -G * dF.transpose() * G;
  out[0] = dF - dG;
  out[1] = G.cwiseProduct(dF).sum() * G + std::log(F.determinant()) * dG;
}

SmallStrainModuli NeoHookeanLaw::small_strain(int e) const {
  const double mu = table_(e, 0), lambda = table_(e, 1);
  return {mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu), 0.5 * lambda / (lambda + mu)};
}

}  // namespace pliant
