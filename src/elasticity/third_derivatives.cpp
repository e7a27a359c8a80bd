#include "elasticity/third_derivatives.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace pliant {

namespace {

/// Of (x - m)^order in the Taylor series of x^p about m.
double taylor_coefficient(double p, int order, double m) {
  double product = std::pow(m, p - order);
  for (int k = 0; k < order; ++k) product *= (p - k) / (k + 1);
  return product;
}

}  // namespace

Matrix3 cofactors(const Matrix3& F) {
  Matrix3 C;
  C << F.col(1).cross(F.col(2)), F.col(2).cross(F.col(0)), F.col(0).cross(F.col(1));
  return C;
}

Matrix3 cofactor_change(const Matrix3& F, const Matrix3& dF) {
  Matrix3 dC;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    dC.col(i) = dF.col(j).cross(F.col(k)) + F.col(j).cross(dF.col(k));
  }
  return dC;
}

/// d C(i, j) / d F(k, l) = sum of e(i, k, m) e(j, l, n) F(m, n), e the permutation symbol.
void add_cofactor_derivative(double factor, const Matrix3& F, Matrix9& tangent) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (const int s : {1, 2})
        for (const int t : {1, 2}) {
          const int k = (i + s) % 3, m = (i + 3 - s) % 3, l = (j + t) % 3, n = (j + 3 - t) % 3;
          tangent(i + 3 * j, k + 3 * l) += (s == t ? factor : -factor) * F(m, n);
        }
}

void add_crossed(double factor, const Matrix3& A, const Matrix3& B, Matrix9& tangent) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        for (int l = 0; l < 3; ++l) tangent(i + 3 * j, k + 3 * l) += factor * A(i, l) * B(k, j);
}

/// P = first G,  G = F^-T,  dG = -G dF^T G,  d ln J = G : dF.
Matrix9 volumetric_tangent_change(double first, double second, double third, const Matrix3& F, const Matrix3& dF) {
  const Matrix3 G = F.inverse().transpose(), dG = -G * dF.transpose() * G;
  const double growth = G.cwiseProduct(dF).sum();
  Matrix9 change = second * (vec(dG) * vec(G).transpose() + vec(G) * vec(dG).transpose());
  change += (third * growth) * vec(G) * vec(G).transpose();
  add_crossed(-second * growth, G, G, change);
  add_crossed(-first, dG, G, change);
  add_crossed(-first, G, dG, change);
  return change;
}

double OddPowers::operator()(double x) const {
  double sum = 0.0;
  for (const Term& t : terms_) sum += t.factor * std::copysign(std::pow(std::abs(x), t.exponent), x);
  return sum;
}

double OddPowers::divided(const Term& t, double x, double y) {
  if (x < 0.0) return divided(t, -x, -y);  // of an odd function it is even
  const double at_x = std::pow(x, t.exponent);
  if (y < 0.0) return t.factor * (at_x + std::pow(-y, t.exponent)) / (x - y);
  if (x == y) return t.factor * t.exponent * at_x / x;
  return t.factor * at_x * std::expm1(t.exponent * std::log1p((y - x) / x)) / (y - x);
}

double OddPowers::divided(const Term& t, double x, double y, double z) {
  std::array<double, 3> at = {x, y, z};
  std::ranges::sort(at);
  if (at[2] < 0.0) return -divided(t, -x, -y, -z);
  const double width = at[2] - at[0], mean = (at[0] + at[1] + at[2]) / 3.0;
  constexpr double close = 2e-3;  // up to there the series errs by 1e-13, from there on the quotient does
  if (at[0] < 0.0 || width * std::max(1.0, std::abs(t.exponent)) > close * mean)
    return (divided(t, at[1], at[2]) - divided(t, at[0], at[1])) / width;
  const double dx = at[0] - mean, dy = at[1] - mean, dz = at[2] - mean;
  const double squares = 0.5 * (dx * dx + dy * dy + dz * dz), product = dx * dy * dz;
  return t.factor * (taylor_coefficient(t.exponent, 2, mean) + taylor_coefficient(t.exponent, 4, mean) * squares +
                     taylor_coefficient(t.exponent, 5, mean) * product);
}

double OddPowers::divided(double x, double y) const {
  double sum = 0.0;
  for (const Term& t : terms_) sum += divided(t, x, y);
  return sum;
}

double OddPowers::divided(double x, double y, double z) const {
  double sum = 0.0;
  for (const Term& t : terms_) sum += divided(t, x, y, z);
  return sum;
}

/// With eigenvectors (u_i, s v_i) / sqrt 2 of the eigenvalues s l_i, a change H = U^T dF V is E = [S -A; A -S], S and A
/// its symmetric and its skew part, and f changes along E and E' by
///   R_ij = sum_k f[i, k, j] (E_ik E'_kj + E'_ik E_kj),
/// whose block of F is (R_++ + R_-+ - R_+- - R_--) / 2.
Matrix9 spectral_tangent_change(const OddPowers& f, const Vector3& l, const Matrix3& U, const Matrix3& V,
                                const Matrix3& dF) {
  const auto value = [&](int i) { return i < 3 ? l[i] : -l[i - 3]; };
  std::array<Matrix6, 6> differences;  // by k
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j)
      for (int k = 0; k <= j; ++k) {
        const double d = f.divided(value(i), value(j), value(k));
        differences[k](i, j) = differences[k](j, i) = differences[j](i, k) = d;
        differences[j](k, i) = differences[i](j, k) = differences[i](k, j) = d;
      }
  const auto extended = [](const Matrix3& H) {
    const Matrix3 S = 0.5 * (H + H.transpose()), A = 0.5 * (H - H.transpose());
    Matrix6 E;
    E << S, -A, A, -S;
    return E;
  };
  const Matrix6 E = extended(U.transpose() * dF * V);
  PointStress local;
  local.left = U, local.right = V;
  for (int c = 0; c < 9; ++c) {
    Matrix3 unit = Matrix3::Zero();
    unit.data()[c] = 1.0;
    const Matrix6 other = extended(unit);
    Matrix6 R = Matrix6::Zero();
    for (int k = 0; k < 6; ++k) {
      const Matrix6 product = E.col(k) * other.row(k);
      R += differences[std::size_t(k)].cwiseProduct(product + product.transpose());
    }
    const Matrix3 dP = 0.5 * (R.topLeftCorner<3, 3>() + R.bottomLeftCorner<3, 3>() - R.topRightCorner<3, 3>() -
                              R.bottomRightCorner<3, 3>());
    local.tangent.col(c) = vec(dP);
  }
  return world_tangent(local);
}

}  // namespace pliant
