#pragma once

#include <Eigen/Geometry>
#include <span>

#include "base/types.hpp"

namespace pliant {

/// F = R S, R a rotation (det R = +1 also where F is inverted; then S is indefinite), S symmetric.
struct Polar {
  Eigen::Quaterniond quaternion = Eigen::Quaterniond::Identity();
  Matrix3 R = Matrix3::Identity();
  Matrix3 S = Matrix3::Identity();
  Matrix3 rate_inverse = 0.5 * Matrix3::Identity();  ///< (tr(S) I - S)^-1, damped where that is singular
  bool is_degenerate = false;                        ///< two singular values sum to (nearly) zero
};

/// The rotation closest to F.
/// @param guess  a rotation to start from, typically that of the last step; Newton's iteration from it converges
///               quadratically, and the singular value decomposition steps in where it does not
/// Never throws. A non-finite F gives the identity, marked degenerate.
[[nodiscard]] Polar polar_decomposition(const Matrix3& F,
                                        const Eigen::Quaterniond& guess = Eigen::Quaterniond::Identity());

/// Those of many gradients, each from the rotation in its `polars[i].quaternion`: several at once in the processor's
/// wide registers. Differs from the above by rounding only. Both spans have the same length.
void polar_decompositions(std::span<const Matrix3> gradients, std::span<Polar> polars);

/// w with dR = R [w]x for a change dF:  (tr(S) I - S) w = vee(R^T dF - dF^T R).
/// Where the system is singular it is damped (`polar.is_degenerate`).
[[nodiscard]] Vector3 rotation_rate(const Polar& polar, const Matrix3& dF);

/// Adjoint of `rotation_rate`: the cotangent of F for a cotangent of w.
[[nodiscard]] Matrix3 rotation_rate_adjoint(const Polar& polar, const Vector3& w_bar);

}  // namespace pliant
