#include "elasticity/polar.hpp"

#include <Eigen/SVD>
#include <cmath>
#include <cstdint>

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

// ---- several at once

constexpr std::size_t lanes = 8;
typedef double Pack __attribute__((vector_size(lanes * sizeof(double))));
typedef std::int64_t Mask __attribute__((vector_size(lanes * sizeof(double))));

bool all(const Mask& mask) {
  std::int64_t every = -1;
  for (std::size_t l = 0; l < lanes; ++l) every &= mask[l];
  return every != 0;
}

/// One number of each lane; matrices row by row, symmetric ones as 00 01 02 11 12 22.
struct PackedPolar {
  Pack w, x, y, z;  // quaternion, of length about one
  Pack R[9], S[6], rate_inverse[6];
  Mask converged = {};

  /// The same iteration as for one, but for Cayley's map in place of the exponential, which it meets as steps shrink.
  void newton(const Pack (&F)[9]) {
    Pack squares = {};
    for (const Pack& f : F) squares += f * f;
    Mask in_basin = squares > 0.0;
    for (int iteration = 0; iteration < 12; ++iteration) {
      const Pack two = 2.0 / (w * w + x * x + y * y + z * z);
      R[0] = 1.0 - two * (y * y + z * z), R[1] = two * (x * y - w * z), R[2] = two * (x * z + w * y);
      R[3] = two * (x * y + w * z), R[4] = 1.0 - two * (x * x + z * z), R[5] = two * (y * z - w * x);
      R[6] = two * (x * z - w * y), R[7] = two * (y * z + w * x), R[8] = 1.0 - two * (x * x + y * y);
      const auto product = [&](int i, int j) { return R[i] * F[j] + R[3 + i] * F[3 + j] + R[6 + i] * F[6 + j]; };
      const Pack s01 = product(0, 1), s10 = product(1, 0), s02 = product(0, 2), s20 = product(2, 0),
                 s12 = product(1, 2), s21 = product(2, 1);
      S[0] = product(0, 0), S[3] = product(1, 1), S[5] = product(2, 2);
      S[1] = 0.5 * (s01 + s10), S[2] = 0.5 * (s02 + s20), S[4] = 0.5 * (s12 + s21);
      const Pack a = S[3] + S[5], b = S[0] + S[5], c = S[0] + S[3];  // diagonal of tr(S) I - S
      const Pack c00 = b * c - S[4] * S[4], c01 = S[2] * S[4] + S[1] * c, c02 = S[1] * S[4] + S[2] * b,
                 c11 = a * c - S[2] * S[2], c12 = S[1] * S[2] + a * S[4], c22 = a * b - S[1] * S[1];
      const Pack det = a * c00 - S[1] * c01 - S[2] * c02;
      // det > 1e-9 |F|^3, without the root.
      in_basin &= (a > 0.0) & (c22 > 0.0) & (det > 0.0) & (det * det > 1e-18 * squares * squares * squares);
      const Pack inverse = 1.0 / det;
      rate_inverse[0] = c00 * inverse, rate_inverse[1] = c01 * inverse, rate_inverse[2] = c02 * inverse;
      rate_inverse[3] = c11 * inverse, rate_inverse[4] = c12 * inverse, rate_inverse[5] = c22 * inverse;
      const Pack u = s21 - s12, v = s02 - s20, t = s10 - s01;
      const Pack p = 0.5 * (rate_inverse[0] * u + rate_inverse[1] * v + rate_inverse[2] * t),
                 q = 0.5 * (rate_inverse[1] * u + rate_inverse[3] * v + rate_inverse[4] * t),
                 r = 0.5 * (rate_inverse[2] * u + rate_inverse[4] * v + rate_inverse[5] * t);
      const Pack turned = p * p + q * q + r * r;  // a quarter of the square of the angle
      converged = in_basin & (turned < 0.25e-30);
      if (all(converged | ~in_basin)) return;
      const Pack w1 = w - x * p - y * q - z * r, x1 = x + w * p + y * r - z * q, y1 = y + w * q + z * p - x * r,
                 z1 = z + w * r + x * q - y * p;
      const Pack shorten = 1.0 / (1.0 + 0.5 * turned);  // to a length of about one; R divides by what it is
      w = w1 * shorten, x = x1 * shorten, y = y1 * shorten, z = z1 * shorten;
    }
  }
};

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

void polar_decompositions(std::span<const Matrix3> gradients, std::span<Polar> polars) {
  std::size_t first = 0;
  for (; first + lanes <= polars.size(); first += lanes) {
    PackedPolar packed;
    Pack F[9];
    for (std::size_t l = 0; l < lanes; ++l) {
      const Matrix3& gradient = gradients[first + l];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) F[3 * i + j][l] = gradient(i, j);
      const Eigen::Quaterniond& guess = polars[first + l].quaternion;
      packed.w[l] = guess.w(), packed.x[l] = guess.x(), packed.y[l] = guess.y(), packed.z[l] = guess.z();
    }
    packed.newton(F);
    for (std::size_t l = 0; l < lanes; ++l) {
      Polar& polar = polars[first + l];
      if (!packed.converged[l]) {
        polar = polar_decomposition(gradients[first + l], polar.quaternion);
        continue;
      }
      polar.quaternion = Eigen::Quaterniond(packed.w[l], packed.x[l], packed.y[l], packed.z[l]).normalized();
      polar.is_degenerate = false;
      static constexpr int symmetric[9] = {0, 1, 2, 1, 3, 4, 2, 4, 5};
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          polar.R(i, j) = packed.R[3 * i + j][l];
          polar.S(i, j) = packed.S[symmetric[3 * i + j]][l];
          polar.rate_inverse(i, j) = packed.rate_inverse[symmetric[3 * i + j]][l];
        }
    }
  }
  for (; first < polars.size(); ++first)
    polars[first] = polar_decomposition(gradients[first], polars[first].quaternion);
}

Vector3 rotation_rate(const Polar& polar, const Matrix3& dF) {
  const Matrix3 A = polar.R.transpose() * dF;
  return polar.rate_inverse * twice_axial(A);
}

Matrix3 rotation_rate_adjoint(const Polar& polar, const Vector3& w_bar) {
  const Vector3 v_bar = polar.rate_inverse.transpose() * w_bar;
  return polar.R * cross_matrix(v_bar);
}

}  // namespace pliant
