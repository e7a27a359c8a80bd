#pragma once

#include <vector>

#include "elasticity/material_law.hpp"

// Second and third derivatives of isotropic energies, in closed form: a tangent dP/dF, columns of F first, in the frame
// of the world, and how it changes with F.

namespace pliant {

/// Cofactors of F, the derivative of det F by F; and their change for a change of F.
Matrix3 cofactors(const Matrix3& F);
Matrix3 cofactor_change(const Matrix3& F, const Matrix3& dF);
/// tangent += factor times the derivative of the cofactors by F.
void add_cofactor_derivative(double factor, const Matrix3& F, Matrix9& tangent);

/// tangent += factor A(i, l) B(k, j) at (ij, kl): with A = B = G = F^-T, minus the derivative of G.
void add_crossed(double factor, const Matrix3& A, const Matrix3& B, Matrix9& tangent);

/// Of an energy of ln J alone, J = det F > 0, with its derivatives by ln J.
/// @param first, second, third  [Pa]
Matrix9 volumetric_tangent_change(double first, double second, double third, const Matrix3& F, const Matrix3& dF);

/// f(x) = sum of c sign(x) |x|^p, an odd function, and its divided differences, which are smooth where points meet.
class OddPowers {
 public:
  void add(double factor, double exponent) { terms_.push_back({factor, exponent}); }
  double operator()(double x) const;
  double divided(double x, double y) const;
  /// Of points other than 0; to some 1e-13 of what its terms are, however close they are.
  double divided(double x, double y, double z) const;

 private:
  struct Term {
    double factor, exponent;
  };
  static double divided(const Term& term, double x, double y);
  static double divided(const Term& term, double x, double y, double z);
  std::vector<Term> terms_;
};

/// Of an energy of the principal stretches one by one, sum of phi(l_k) with phi' = f; F = U diag(l) V^T. f, being odd,
/// is a function of the symmetric matrix [0 F; F^T 0], whose eigenvalues are l and -l: the second derivative is that of
/// Daleckii and Krein (1965).
Matrix9 spectral_tangent_change(const OddPowers& f, const Vector3& stretch, const Matrix3& U, const Matrix3& V,
                                const Matrix3& dF);

}  // namespace pliant
