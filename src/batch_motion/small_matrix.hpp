#pragma once

#include "batch_motion/lane.hpp"

// 3 x 3 matrices row by row, entry (i, j) in [3 i + j]; vectors of three.

namespace pliant::batch_motion {

/// A v.
template <class Real, class Vector>
PLIANT_DEVICE void times(const Real* A, const Vector* v, Real* out) {
  for (int i = 0; i < 3; ++i) out[i] = A[3 * i] * v[0] + A[3 * i + 1] * v[1] + A[3 * i + 2] * v[2];
}
/// A^T v.
template <class Real>
PLIANT_DEVICE void transposed_times(const Real* A, const Real* v, Real* out) {
  for (int i = 0; i < 3; ++i) out[i] = A[i] * v[0] + A[3 + i] * v[1] + A[6 + i] * v[2];
}
template <class Real, class Vector>
PLIANT_DEVICE void cross(const Real* a, const Vector* b, Real* out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}
template <class Real>
PLIANT_DEVICE Real dot(const Real* a, const Real* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Symmetric matrices as 00 01 02 11 12 22: the adjugate, and the determinant that goes with it.
template <class Real>
PLIANT_DEVICE Real adjugate(const Real* H, Real* out) {
  out[0] = H[3] * H[5] - H[4] * H[4];
  out[1] = H[2] * H[4] - H[1] * H[5];
  out[2] = H[1] * H[4] - H[2] * H[3];
  out[3] = H[0] * H[5] - H[2] * H[2];
  out[4] = H[1] * H[2] - H[0] * H[4];
  out[5] = H[0] * H[3] - H[1] * H[1];
  return H[0] * out[0] + H[1] * out[1] + H[2] * out[2];
}
template <class Real>
PLIANT_DEVICE void symmetric_times(const Real* H, const Real* v, Real* out) {
  out[0] = H[0] * v[0] + H[1] * v[1] + H[2] * v[2];
  out[1] = H[1] * v[0] + H[3] * v[1] + H[4] * v[2];
  out[2] = H[2] * v[0] + H[4] * v[1] + H[5] * v[2];
}

}  // namespace pliant::batch_motion
