#pragma once

#include "base/types.hpp"

namespace pliant {

// Decompositions of dense matrices whose size is known at run time. Eigen's templates for them are slow to compile:
// they are compiled here alone.

/// A^-1 b of a symmetric matrix, by L D L^T with pivots. The lower triangle of A is read.
VectorX solve_symmetric(const MatrixX& A, const VectorX& b);
MatrixX solve_symmetric(const MatrixX& A, const MatrixX& B);

/// ln |det A| of a symmetric matrix, by L D L^T; minus infinity where it is singular.
double log_determinant(const MatrixX& A);

/// Eigenvalues of a symmetric matrix, ascending, and orthonormal eigenvectors. The lower triangle is read.
struct SymmetricEigen {
  VectorX values;
  MatrixX vectors;
};
SymmetricEigen symmetric_eigen(const MatrixX& A);

/// A^-1 of a regular matrix, by LU with row pivots.
MatrixX inverse(const MatrixX& A);

/// Moore and Penrose's inverse A^+ of any matrix, by a complete orthogonal decomposition.
MatrixX pseudo_inverse(const MatrixX& A);

/// Orthonormal rows that span what is orthogonal to the columns of A, n x m with n >= m: (n - m) x n.
MatrixX orthogonal_complement(const MatrixX& A);

}  // namespace pliant
