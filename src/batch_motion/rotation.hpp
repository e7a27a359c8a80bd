#pragma once

#include "batch_motion/small_matrix.hpp"

namespace pliant::batch_motion {

/// Rotation matrix of a quaternion (w, x, y, z) of any length but zero.
template <class Real>
PLIANT_DEVICE void rotation_matrix(const Real* q, Real* R) {
  const Real w = q[0], x = q[1], y = q[2], z = q[3];
  const Real two = Real(2.0) / (w * w + x * x + y * y + z * z), one = Real(1.0);
  R[0] = one - two * (y * y + z * z), R[1] = two * (x * y - w * z), R[2] = two * (x * z + w * y);
  R[3] = two * (x * y + w * z), R[4] = one - two * (x * x + z * z), R[5] = two * (y * z - w * x);
  R[6] = two * (x * z - w * y), R[7] = two * (y * z + w * x), R[8] = one - two * (x * x + y * y);
}

/// tr(S) I - S with S the symmetric part of R^T F, as 00 01 02 11 12 22; `skew` is twice the axial vector of R^T F.
template <class Real>
PLIANT_DEVICE void rate_matrix(const Real* R, const Real* F, Real* H, Real* skew) {
  Real S[9];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) S[3 * i + j] = R[i] * F[j] + R[3 + i] * F[3 + j] + R[6 + i] * F[6 + j];
  H[0] = S[4] + S[8], H[3] = S[0] + S[8], H[5] = S[0] + S[4];
  H[1] = Real(-0.5) * (S[1] + S[3]), H[2] = Real(-0.5) * (S[2] + S[6]), H[4] = Real(-0.5) * (S[5] + S[7]);
  skew[0] = S[7] - S[5], skew[1] = S[2] - S[6], skew[2] = S[3] - S[1];
}

/// Whether H, of a gradient whose squares sum to `squares`, is safely positive: the closest rotation is at hand or near
/// (`polar_decomposition` has the same bounds).
template <class Real, class Mask>
PLIANT_DEVICE Mask is_in_basin(const Real* H, const Real* adjoint, const Real& det, const Real& squares) {
  return (H[0] > Real(0.0)) & (adjoint[5] > Real(0.0)) & (det > Real(0.0)) &
         (det * det > Real(1e-18) * squares * squares * squares);
}

/// The closest rotation's quaternion: the eigenvector of the largest eigenvalue of Horn's matrix (Horn 1987, section
/// 4.B), by Jacobi's rotations. Of any finite F, also an inverted one; of zero the identity.
PLIANT_DEVICE void closest_quaternion(const double* F, double* q) {
  double A[4][4] = {{F[0] + F[4] + F[8], F[7] - F[5], F[2] - F[6], F[3] - F[1]},
                    {0, F[0] - F[4] - F[8], F[1] + F[3], F[2] + F[6]},
                    {0, 0, F[4] - F[0] - F[8], F[5] + F[7]},
                    {0, 0, 0, F[8] - F[0] - F[4]}};
  double V[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < i; ++j) A[i][j] = A[j][i];
  for (int sweep = 0; sweep < 12; ++sweep)
    for (int i = 0; i < 3; ++i)
      for (int j = i + 1; j < 4; ++j) {
        if (A[i][j] == 0.0) continue;
        const double h = (A[j][j] - A[i][i]) / (2.0 * A[i][j]);
        const double t = (h >= 0.0 ? 1.0 : -1.0) / (fabs(h) + sqrt(h * h + 1.0));
        const double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
        for (int k = 0; k < 4; ++k) {
          const double a = A[k][i], b = A[k][j];
          A[k][i] = c * a - s * b, A[k][j] = s * a + c * b;
        }
        for (int k = 0; k < 4; ++k) {
          const double a = A[i][k], b = A[j][k];
          A[i][k] = c * a - s * b, A[j][k] = s * a + c * b;
          const double v = V[k][i], w = V[k][j];
          V[k][i] = c * v - s * w, V[k][j] = s * v + c * w;
        }
      }
  int largest = 0;
  for (int i = 1; i < 4; ++i)
    if (A[i][i] > A[largest][largest]) largest = i;
  for (int k = 0; k < 4; ++k) q[k] = V[k][largest];
}

/// The rotation closest to F (`polar_decomposition`): Newton's iteration from the quaternion at hand by Cayley's map,
/// and Horn's eigenvector where that leaves the basin. Members whose iteration has ended stay as they are.
/// @param q  in: a guess; out: of the rotation, of length about one
template <class Real, class Mask>
PLIANT_DEVICE void closest_rotation(const Real* F, Real* q, Real* R) {
  Real squares = Real(0.0);
  for (int k = 0; k < 9; ++k) squares += F[k] * F[k];
  Mask done = Mask(false), in_basin = squares > Real(0.0);
  for (int iteration = 0; iteration < 12; ++iteration) {
    rotation_matrix(q, R);
    Real H[6], adjoint[6], skew[3], p[3];
    rate_matrix(R, F, H, skew);
    const Real det = adjugate(H, adjoint);
    in_basin = in_basin & (done | is_in_basin<Real, Mask>(H, adjoint, det, squares));
    symmetric_times(adjoint, skew, p);
    const Real half = Real(0.5) / det;
    for (int i = 0; i < 3; ++i) p[i] *= half;
    const Real turned = dot(p, p);  // a quarter of the square of the angle
    done = done | (in_basin & (turned < Real(0.25e-30)));
    if (all(done | negated(in_basin))) break;
    const Real shorten = Real(1.0) / (Real(1.0) + Real(0.5) * turned);
    const Real next[4] = {(q[0] - q[1] * p[0] - q[2] * p[1] - q[3] * p[2]) * shorten,
                          (q[1] + q[0] * p[0] + q[2] * p[2] - q[3] * p[1]) * shorten,
                          (q[2] + q[0] * p[1] + q[3] * p[0] - q[1] * p[2]) * shorten,
                          (q[3] + q[0] * p[2] + q[1] * p[1] - q[2] * p[0]) * shorten};
    const Mask goes_on = in_basin & negated(done);
    for (int k = 0; k < 4; ++k) q[k] = select(goes_on, next[k], q[k]);
  }
  if (all(done)) return;
  for (int l = 0; l < lane_count(q[0]); ++l) {
    if (lane_of(done, l)) continue;
    double gradient[9], quaternion[4];
    for (int k = 0; k < 9; ++k) gradient[k] = lane_of(F[k], l);
    closest_quaternion(gradient, quaternion);
    for (int k = 0; k < 4; ++k) set_lane(q[k], l, quaternion[k]);
  }
  rotation_matrix(q, R);
}

/// (tr(S) I - S)^-1, as 00 01 02 11 12 22; damped where two singular values sum to (nearly) zero or less.
template <class Real, class Mask>
PLIANT_DEVICE void rate_inverse(const Real* R, const Real* F, Real* inverse) {
  Real H[6], skew[3], adjoint[6], squares = Real(0.0);
  for (int k = 0; k < 9; ++k) squares += F[k] * F[k];
  rate_matrix(R, F, H, skew);
  const Real det = adjugate(H, adjoint);
  const Mask is_safe = is_in_basin<Real, Mask>(H, adjoint, det, squares);
  for (int k = 0; k < 6; ++k) inverse[k] = adjoint[k] / det;
  if (all(is_safe)) return;
  const Real floor = Real(1e-12) * squares;  // (H^2 + (1e-6 |F|)^2 I)^-1 H
  Real G[6] = {H[0] * H[0] + H[1] * H[1] + H[2] * H[2] + floor, H[0] * H[1] + H[1] * H[3] + H[2] * H[4],
               H[0] * H[2] + H[1] * H[4] + H[2] * H[5],         H[1] * H[1] + H[3] * H[3] + H[4] * H[4] + floor,
               H[1] * H[2] + H[3] * H[4] + H[4] * H[5],         H[2] * H[2] + H[4] * H[4] + H[5] * H[5] + floor};
  Real A[6], B[6];
  const Real det2 = adjugate(G, A);
  B[0] = A[0] * H[0] + A[1] * H[1] + A[2] * H[2];
  B[1] = A[0] * H[1] + A[1] * H[3] + A[2] * H[4];
  B[2] = A[0] * H[2] + A[1] * H[4] + A[2] * H[5];
  B[3] = A[1] * H[1] + A[3] * H[3] + A[4] * H[4];
  B[4] = A[1] * H[2] + A[3] * H[4] + A[4] * H[5];
  B[5] = A[2] * H[2] + A[4] * H[4] + A[5] * H[5];
  for (int k = 0; k < 6; ++k) inverse[k] = select(is_safe, inverse[k], B[k] / det2);
}

}  // namespace pliant::batch_motion
