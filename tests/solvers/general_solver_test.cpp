#include "solvers/general_solver.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>

#include "solvers/lu_solver.hpp"
#include "support/dense.hpp"
#include "support/tolerance.hpp"

namespace pliant::general_solver_test {
namespace {

using test::tolerance;

/// A chain of nodes whose stiffness is symmetric but for this share of noise.
struct Chain {
  explicit Chain(double asymmetry, double shift = 0.0) {
    std::vector<int> nodes;
    for (int i = 0; i + 1 < 30; ++i) nodes.insert(nodes.end(), {i, i + 1});
    pattern = std::make_shared<BlockPattern>(BlockPattern::from_elements(30, nodes, 2));
    matrix = BlockMatrix(pattern), spd = BlockMatrix(pattern);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int row = 0; row < pattern->rows; ++row)
      for (int b = pattern->row_start[row]; b < pattern->row_start[row + 1]; ++b)
        for (int k = 0; k < 9; ++k) {
          const bool diagonal = pattern->column[b] == row;
          const double symmetric =
              (k % 4 == 0 ? (diagonal ? 2.5 : -1.0) : 0.0) - (diagonal && k % 4 == 0 ? shift : 0.0);
          spd.block(b)[k] = symmetric + (diagonal && k % 4 == 0 ? shift : 0.0);
          matrix.block(b)[k] = symmetric + asymmetry * uniform(random);
        }
  }
  std::shared_ptr<const BlockPattern> pattern;
  BlockMatrix matrix, spd;
};

/// Solves for random numbers on the right, to ten times the tolerance that is asked for at most.
SolveSummary expect_solved(GeneralSolver& solver, const Chain& chain, double to) {
  const MatrixX A = test::dense(chain.matrix);
  const VectorX b = VectorX::Random(A.rows());
  VectorX x;
  const SolveSummary summary = solver.solve(b, x, to);
  EXPECT_TRUE(summary.converged);
  EXPECT_LT((A * x - b).norm(), tolerance(10.0 * to) * b.norm());
  return summary;
}

class General : public ::testing::TestWithParam<SolverKind> {};

TEST_P(General, SolvesBothSidesOfAnUnsymmetricMatrix) {
  for (const double asymmetry : {0.0, 0.02, 0.15}) {
    const Chain chain(asymmetry);
    GeneralSolver solver(chain.pattern, GetParam());
    ASSERT_TRUE(solver.factorise(chain.matrix, chain.spd));
    EXPECT_TRUE(solver.symmetric_part_is_definite());
    const MatrixX A = test::dense(chain.matrix);
    const VectorX b = VectorX::Random(A.rows());
    VectorX x;
    const SolveSummary plain = solver.solve(b, x, 1e-12);
    ASSERT_TRUE(plain.converged) << asymmetry;
    EXPECT_LT((A * x - b).norm(), tolerance(1e-11) * b.norm());
    if (asymmetry == 0.0) {
      EXPECT_EQ(plain.iterations, 1);
    }
    ASSERT_TRUE(solver.solve(b, x, 1e-12, GeneralSolver::Side::Transposed).converged);
    EXPECT_LT((A.transpose() * x - b).norm(), tolerance(1e-11) * b.norm());
    ASSERT_TRUE(solver.solve(b, x, 1e-12).converged) << "after the transposed solve the matrix is itself again";
    EXPECT_LT((A * x - b).norm(), tolerance(1e-11) * b.norm());
  }
}

TEST_P(General, TakesTheSubstituteWhereTheMatrixIsIndefinite) {
  const Chain chain(0.0, 1.0);
  GeneralSolver solver(chain.pattern, GetParam());
  ASSERT_TRUE(solver.factorise(chain.matrix, chain.spd));
  EXPECT_FALSE(solver.symmetric_part_is_definite());
  expect_solved(solver, chain, 1e-10);
}

/// An indefinite matrix, one nearby, and one that is far from both: the factors of the first serve the second.
TEST_P(General, TakesLuFactorsOfAMatrixBeforeAsLongAsTheyServe) {
  const Chain first(0.3, 2.0), far(0.1, 3.5);
  Chain nearby(0.3, 2.0);
  for (int b = 0; b < nearby.pattern->block_count(); ++b)
    for (int k = 0; k < 9; ++k) nearby.matrix.block(b)[k] *= 1.0 + 1e-3 * std::sin(7.0 * k + b);
  GeneralSolver solver(first.pattern, GetParam());
  VectorX x;
  for (const Chain* chain : std::initializer_list<const Chain*>{&first, &nearby, &far}) {
    ASSERT_TRUE(solver.factorise(chain->matrix, GeneralSolver::Lu::Before));
    EXPECT_FALSE(solver.symmetric_part_is_definite());
    const MatrixX A = test::dense(chain->matrix);
    const VectorX b = VectorX::Random(A.rows());
    const SolveSummary plain = solver.solve(b, x, 1e-12);
    ASSERT_TRUE(plain.converged);
    EXPECT_LT((A * x - b).norm(), tolerance(1e-10) * b.norm());
    if (chain == &nearby) {
      EXPECT_GT(plain.iterations, 0) << "about other factors";
    } else {
      EXPECT_EQ(plain.iterations, 0) << "by its own factors";
    }
    ASSERT_TRUE(solver.solve(b, x, 1e-12, GeneralSolver::Side::Transposed).converged);
    EXPECT_LT((A.transpose() * x - b).norm(), tolerance(1e-10) * b.norm());
  }
  ASSERT_TRUE(solver.factorise(nearby.matrix));
  EXPECT_EQ(solver.solve(VectorX::Ones(90), x, 1e-12).iterations, 0) << "its own factors, where they are asked for";
}

/// Definite, but so far from symmetric that iterations about the symmetric part do not end.
TEST_P(General, TakesLuFactorsWhereIterationsDoNotEnd) {
  Chain chain(0.0);
  for (int row = 0; row < chain.pattern->rows; ++row)
    for (int b = chain.pattern->row_start[row]; b < chain.pattern->row_start[row + 1]; ++b)
      for (int k = 0; k < 9; ++k)
        if (const int column = chain.pattern->column[b]; column != row)
          chain.matrix.block(b)[k] +=
              (column > row ? 1.0 : -1.0) * double(k % 4 == 0) * (40.0 + 7.0 * std::min(row, column) + 3.0 * k);
  GeneralSolver solver(chain.pattern, GetParam());
  ASSERT_TRUE(solver.factorise(chain.matrix));
  EXPECT_TRUE(solver.symmetric_part_is_definite());
  EXPECT_EQ(expect_solved(solver, chain, 1e-12).iterations, 0) << "by its own factors";
}

TEST_P(General, NothingOnTheRightIsNothing) {
  const Chain chain(0.1);
  GeneralSolver solver(chain.pattern, GetParam());
  ASSERT_TRUE(solver.factorise(chain.matrix, chain.spd));
  VectorX x;
  EXPECT_TRUE(solver.solve(VectorX::Zero(90), x, 1e-12).converged);
  EXPECT_EQ(x.norm(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, General, ::testing::Values(SolverKind::Automatic, SolverKind::Simplicial));

/// Matrices that no factorisation of their symmetric part comes near.
TEST(LuSolver, SolvesBothSidesOfAnyMatrix) {
  for (const double asymmetry : {0.0, 1.5}) {
    const Chain chain(asymmetry, 2.0);
    LuSolver solver(chain.pattern);
    for (int again = 0; again < 2; ++again) {
      ASSERT_TRUE(solver.factorise(chain.matrix));
      const MatrixX A = test::dense(chain.matrix);
      const VectorX b = VectorX::Random(A.rows());
      EXPECT_LT((A * solver.solve(b) - b).norm(), tolerance(1e-10) * b.norm());
      EXPECT_LT((A.transpose() * solver.solve_transposed(b) - b).norm(), tolerance(1e-10) * b.norm());
    }
  }
}

TEST(LuSolver, ASingularMatrixIsRefused) {
  Chain chain(0.3);
  for (int b = 0; b < chain.pattern->block_count(); ++b)
    if (chain.pattern->column[b] == 7)
      for (int k = 0; k < 9; ++k) chain.matrix.block(b)[k] = 0.0;
  LuSolver solver(chain.pattern);
  EXPECT_FALSE(solver.factorise(chain.matrix));
}

}  // namespace
}  // namespace pliant::general_solver_test
