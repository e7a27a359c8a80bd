#include <Eigen/LU>
#include <stdexcept>

#include "elasticity/third_derivatives.hpp"

namespace pliant {

void NeoHookeanLaw::check(const MatrixX& table) const {
  if (table.cols() != 2) throw std::invalid_argument("the neo-Hookean law has two parameters an element");
  for (Eigen::Index e = 0; e < table.rows(); ++e)
    if (!(table(e, 0) > 0.0 && table(e, 1) > -2.0 / 3.0 * table(e, 0)))
      throw std::invalid_argument("the neo-Hookean law needs mu > 0 and lambda > -2 mu / 3");
}

/// With C the cofactors of F, the derivative of J: P = mu F + ((lambda + mu) (J - 1) - mu) C.
void NeoHookeanLaw::stress(int e, const Matrix3& F, bool with_tangent, PointStress& out) const {
  const double mu = table_(e, 0), sum = table_(e, 1) + mu, growth = F.determinant() - 1.0;
  const Matrix3 C = cofactors(F);
  const double pressure = sum * growth - mu;
  out.energy = 0.5 * mu * (F.squaredNorm() - 3.0) - mu * growth + 0.5 * sum * growth * growth;
  out.P = mu * F + pressure * C;
  if (!with_tangent) return;
  out.left.setIdentity();
  out.right.setIdentity();
  out.tangent = mu * Matrix9::Identity() + sum * vec(C) * vec(C).transpose();
  add_cofactor_derivative(pressure, F, out.tangent);
}

void NeoHookeanLaw::parameter_derivatives(int, const Matrix3& F, std::span<Matrix3> out) const {
  const double growth = F.determinant() - 1.0;
  const Matrix3 C = cofactors(F);
  out[0] = F + (growth - 1.0) * C;
  out[1] = growth * C;
}

Matrix9 NeoHookeanLaw::tangent_derivative(int e, const Matrix3& F, const Matrix3& dF) const {
  const double mu = table_(e, 0), sum = table_(e, 1) + mu, growth = F.determinant() - 1.0;
  const Matrix3 C = cofactors(F), dC = cofactor_change(F, dF);
  Matrix9 change = sum * (vec(dC) * vec(C).transpose() + vec(C) * vec(dC).transpose());
  add_cofactor_derivative(sum * C.cwiseProduct(dF).sum(), F, change);
  add_cofactor_derivative(sum * growth - mu, dF, change);
  return change;
}

void NeoHookeanLaw::parameter_derivative_changes(int, const Matrix3& F, const Matrix3& dF,
                                                 std::span<Matrix3> out) const {
  const double growth = F.determinant() - 1.0;
  const Matrix3 C = cofactors(F), dC = cofactor_change(F, dF);
  const double d_growth = C.cwiseProduct(dF).sum();
  out[0] = dF + d_growth * C + (growth - 1.0) * dC;
  out[1] = d_growth * C + growth * dC;
}

SmallStrainModuli NeoHookeanLaw::small_strain(int e) const {
  const double mu = table_(e, 0), lambda = table_(e, 1);
  return {mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu), 0.5 * lambda / (lambda + mu)};
}

}  // namespace pliant
