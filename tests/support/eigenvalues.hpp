#pragma once

#include "base/types.hpp"

namespace pliant::test {

// Eigen's solvers for dense matrices, compiled once for all tests.

/// Eigenvalues of a symmetric matrix, the smallest first.
VectorX eigenvalues(const MatrixX& A);

/// Eigenvalues of K x = lambda M x, the smallest first, and eigenvectors with x^T M x = 1 in columns.
/// K symmetric, M symmetric and positive definite.
struct GeneralisedEigen {
  VectorX values;
  MatrixX vectors;
};
GeneralisedEigen generalised_eigen(const MatrixX& K, const MatrixX& M);

}  // namespace pliant::test
