#pragma once

#include "elasticity/lame.hpp"
#include "elasticity/polar.hpp"

namespace pliant {

/// What the neo-Hookean law adds to the stress of the corotated one, for a unit Young's modulus, made affine about F:
/// at F + H
///   P = mu F + ((lambda + mu)(J - 1) - mu) cof F - R (2 mu (S - I) + lambda tr(S - I) I)
///       + (lambda + mu) ((cof F : H) cof F + q(J) H),   q(J) = sqrt((J - 1)^2 + e^2) - e,  F = R S.
/// The first line is exact at F, and zero to first order about any rotation. The second is no smaller than what the
/// first one leaves out of the law's stiffness beside the corotated one's, and positive, so that a step which takes it
/// along is stable; where H is of second order in the step, so is its error.
class MeanStrainCorrection {
 public:
  /// The decomposition stays alive.
  MeanStrainCorrection(const Matrix3& F, const Polar& polar, const UnitLame& lame);

  /// P at H = 0 [-].
  const Matrix3& stress() const { return stress_; }
  Matrix3 stress(const Matrix3& H) const { return stress_ + ahead(lame_.lambda + lame_.mu, H); }
  /// Its change for those of F and H.
  Matrix3 tangent(const Matrix3& H, const Matrix3& dF, const Matrix3& dH) const;
  /// Change of the whole law's P at F for that of F, without what the corotated one takes away.
  Matrix3 law_tangent(const Matrix3& dF) const;
  /// Cotangents of F and H for W, that of P.
  struct Cotangents {
    Matrix3 F, H;
  };
  Cotangents adjoint(const Matrix3& H, const Matrix3& W) const;
  /// Change of P by Poisson's ratio.
  Matrix3 by_poissons_ratio(const Matrix3& H) const;
  /// Energy density that P at H = 0 is the derivative of [-].
  double energy() const;
  /// Of the symmetric dP/dH, g_a . dP/dH . g_b = diagonal (g_a . g_b) I + factor (C g_a)(C g_b)^T, C = cof F.
  double diagonal() const { return factor() * q_; }
  double factor() const { return lame_.lambda + lame_.mu; }
  const Matrix3& cofactors() const { return cofactors_; }

 private:
  /// sum ((C : H) C + q H)
  Matrix3 ahead(double sum, const Matrix3& H) const {
    return sum * (cofactors_.cwiseProduct(H).sum() * cofactors_ + q_ * H);
  }
  Matrix3 own_tangent(const Matrix3& dF) const;

  Matrix3 F_;
  const Polar* polar_;
  UnitLame lame_;
  double J_, q_, dq_;
  Matrix3 cofactors_, strain_, linear_, stress_;  // strain: S - I; linear: the corotated stress in the turned frame
};

}  // namespace pliant
