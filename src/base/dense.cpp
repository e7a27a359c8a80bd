#include "base/dense.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>

namespace pliant {

VectorX solve_symmetric(const MatrixX& A, const VectorX& b) { return A.ldlt().solve(b); }
MatrixX solve_symmetric(const MatrixX& A, const MatrixX& B) { return A.ldlt().solve(B); }

double log_determinant(const MatrixX& A) { return A.ldlt().vectorD().array().abs().log().sum(); }

SymmetricEigen symmetric_eigen(const MatrixX& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixX> solver(A);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

MatrixX inverse(const MatrixX& A) { return A.inverse(); }

MatrixX pseudo_inverse(const MatrixX& A) { return A.completeOrthogonalDecomposition().pseudoInverse(); }

MatrixX orthogonal_complement(const MatrixX& A) {
  const Eigen::HouseholderQR<MatrixX> qr(A);
  const MatrixX q = qr.householderQ();
  return q.rightCols(A.rows() - A.cols()).transpose();
}

}  // namespace pliant
