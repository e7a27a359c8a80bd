#include "support/eigenvalues.hpp"

#include <Eigen/Eigenvalues>

namespace pliant::test {

VectorX eigenvalues(const MatrixX& A) { return Eigen::SelfAdjointEigenSolver<MatrixX>(A).eigenvalues(); }

GeneralisedEigen generalised_eigen(const MatrixX& K, const MatrixX& M) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixX> solver(K, M);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace pliant::test
