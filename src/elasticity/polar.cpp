#include "elasticity/polar.hpp"

#include <Eigen/SVD>
#include <cmath>

namespace pliant {

namespace {

Vector3 twice_axial(const Matrix3& A) { return {A(2, 1) - A(1, 2), A(0, 2) - A(2, 0), A(1, 0) - A(0, 1)}; }

Eigen::Quaterniond exponential(const Vector3& w) {
  const double angle = w.norm();
  const double half_sinc = angle < 1e-6 ? 0.5 - angle * angle / 48.0 : std::sin(0.5 * angle) / angle;
  Eigen::Quaterniond q(std::cos(0.5 * angle), half_sinc * w.x(), half_sinc * w.y(), half_sinc * w.z());
  return q;
}

Matrix3 rate_matrix(const Matrix3& S) { return S.trace() * Matrix3::Identity() - S; }

/// Newton's iteration for R^T F = symmetric; false where it leaves the basin of the closest rotation.
bool newton(const Matrix3& F, double scale, Polar& polar) {
  for (int iteration = 0; iteration < 12; ++iteration) {
    polar.R = polar.quaternion.toRotationMatrix();
    polar.S.noalias() = polar.R.transpose() * F;
    const Vector3 skew = twice_axial(polar.S);
    const Matrix3 H = rate_matrix(0.5 * (polar.S + polar.S.transpose()));
    const double minor2 = H(0, 0) * H(1, 1) - H(0, 1) * H(1, 0), det = H.determinant();
    // At the closest rotation H is positive definite; elsewhere Newton might run to another stationary point.
    if (!(H(0, 0) > 0.0 && minor2 > 0.0 && det > 1e-9 * scale * scale * scale)) return false;
    polar.rate_inverse = H.inverse();
    const Vector3 w = polar.rate_inverse * skew;
    if (w.squaredNorm() < 1e-30) return true;
    polar.quaternion = (polar.quaternion * exponential(w)).normalized();
  }
  return false;
}

void by_svd(const Matrix3& F, double scale, Polar& polar) {
  const Eigen::JacobiSVD<Matrix3> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Matrix3 flip = Matrix3::Identity();
  flip(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  polar.R = svd.matrixU() * flip * svd.matrixV().transpose();
  polar.quaternion = Eigen::Quaterniond(polar.R).normalized();
  polar.S = polar.R.transpose() * F;
  // Pair sums of the signed singular values are the eigenvalues of tr(S) I - S.
  Vector3 s = svd.singularValues();
  s.z() *= flip(2, 2);
  const double floor = 1e-6 * scale;
  Vector3 sums(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
  polar.is_degenerate = sums.minCoeff() < floor;
  const Vector3 inverse =
      sums.unaryExpr([&](double sum) { return sum / (sum * sum + (sum < floor ? floor * floor : 0.0)); });
  polar.rate_inverse = svd.matrixV() * inverse.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace

Polar polar_decomposition(const Matrix3& F, const Eigen::Quaterniond& guess) {
  Polar polar;
  const double scale = F.norm();
  if (!std::isfinite(scale) || scale == 0.0) {
    polar.S = F;
    polar.is_degenerate = true;
    return polar;
  }
  polar.quaternion = guess;
  if (!newton(F, scale, polar)) by_svd(F, scale, polar);
  polar.S = 0.5 * (polar.S + polar.S.transpose().eval());
  return polar;
}

Vector3 rotation_rate(const Polar& polar, const Matrix3& dF) {
  const Matrix3 A = polar.R.transpose() * dF;
  return polar.rate_inverse * twice_axial(A);
}

Matrix3 rotation_derivative(const Polar& polar, const Matrix3& dF) {
  return polar.R * cross_matrix(rotation_rate(polar, dF));
}

Matrix3 rotation_rate_adjoint(const Polar& polar, const Vector3& w_bar) {
  const Vector3 v_bar = polar.rate_inverse.transpose() * w_bar;
  return polar.R * cross_matrix(v_bar);
}

}  // namespace pliant
