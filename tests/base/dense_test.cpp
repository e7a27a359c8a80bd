#include "base/dense.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/tolerance.hpp"

namespace pliant::dense_test {
namespace {

using test::tolerance;

/// Entries without symmetry or structure.
MatrixX generic(Eigen::Index rows, Eigen::Index columns) {
  MatrixX A(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < columns; ++j)
      A(i, j) = std::sin(1.0 + double(3 * i + 7 * j * j)) + 0.2 * double(i == j);
  return A;
}

/// Symmetric, with eigenvalues of both signs.
MatrixX symmetric(Eigen::Index n) {
  const MatrixX A = generic(n, n);
  return A + A.transpose();
}

TEST(Dense, SymmetricSystemsAreSolved) {
  const MatrixX A = symmetric(7), X = generic(7, 3);
  const MatrixX found = solve_symmetric(A, MatrixX(A * X));
  EXPECT_LT((found - X).norm(), tolerance(1e-12) * X.norm());
  const VectorX x = X.col(0);
  EXPECT_LT((solve_symmetric(A, VectorX(A * x)) - x).norm(), tolerance(1e-12) * x.norm());
}

TEST(Dense, LogarithmsOfDeterminantsAddUp) {
  MatrixX A = symmetric(5);
  EXPECT_NEAR(log_determinant(A), std::log(std::abs(A.determinant())), tolerance(1e-12));
  EXPECT_NEAR(log_determinant(2.0 * A), log_determinant(A) + 5.0 * std::log(2.0), tolerance(1e-12));
}

TEST(Dense, InversesAreInverse) {
  const MatrixX A = generic(6, 6);
  EXPECT_LT((inverse(A) * A - MatrixX::Identity(6, 6)).norm(), tolerance(1e-12));
}

/// Its four defining equations, of a matrix of rank 2 that is neither tall nor wide enough.
TEST(Dense, PseudoInversesAreMooreAndPenroses) {
  const MatrixX A = generic(5, 2) * generic(2, 4), P = pseudo_inverse(A);
  ASSERT_EQ(P.rows(), 4);
  ASSERT_EQ(P.cols(), 5);
  EXPECT_LT((A * P * A - A).norm(), tolerance(1e-12) * A.norm());
  EXPECT_LT((P * A * P - P).norm(), tolerance(1e-12) * P.norm());
  EXPECT_LT((A * P - (A * P).transpose()).norm(), tolerance(1e-12));
  EXPECT_LT((P * A - (P * A).transpose()).norm(), tolerance(1e-12));
}

TEST(Dense, ComplementsAreOrthonormalAndOrthogonal) {
  const MatrixX A = generic(6, 2), Q = orthogonal_complement(A);
  ASSERT_EQ(Q.rows(), 4);
  EXPECT_LT((Q * Q.transpose() - MatrixX::Identity(4, 4)).norm(), tolerance(1e-13));
  EXPECT_LT((Q * A).norm(), tolerance(1e-13) * A.norm());
}

}  // namespace
}  // namespace pliant::dense_test
