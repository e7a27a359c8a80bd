#pragma once

#include "elasticity/material_law.hpp"

namespace pliant {

/// A law's symmetric tangent dP/dF [Pa], and the same without its negative eigenvalues, which a matrix that has to be
/// positive takes in its place (Teran et al. 2005).
struct TangentProjection {
  Vector9 values;             ///< [Pa], ascending
  Matrix9 vectors, positive;  ///< eigenvectors, one a column; the projected tangent [Pa]

  TangentProjection() = default;
  /// @param F  deformation in the frame of the tangent, of an isotropic law; null: of any law
  TangentProjection(const Matrix9& tangent, const Matrix3* F);

  int negative_count() const { return int((values.array() < 0.0).count()); }
  /// How much of a change between two of its vectors the projection leaves out: 1 less the divided difference of
  /// max(value, 0) (Daleckii & Krein 1965).
  double left_out(int i, int j) const;

 private:
  void decompose(const Matrix9& tangent);
  /// In the frame of the principal stretches the tangent of an isotropic law falls apart (Smith et al. 2019): into 3 x
  /// 3 numbers of the stretches and, for each two of them, one of shear, sym(u v^T), and one of rotation, skew(u v^T).
  void decompose(const Matrix9& tangent, const PrincipalStretches& p);
};

}  // namespace pliant
