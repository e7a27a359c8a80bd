#include "solvers/linear_solver.hpp"

#include <atomic>
#include <random>
#include <thread>
#include <vector>

#include "base/dense.hpp"
#include "elasticity/corotated.hpp"
#include "solvers/incomplete_cholesky.hpp"
#include "support/bodies.hpp"
#include "support/dense.hpp"
#include "support/tolerance.hpp"

namespace pliant::linear_solver_test {
namespace {

using test::tolerance;

VectorX random_vector(Eigen::Index size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  VectorX v(size);
  for (double& x : v) x = uniform(random);
  return v;
}

/// Stiffness + mass of a turned, bent torus: what a time step solves with. `share` of the mass term against stiffness.
BlockMatrix step_matrix(double mass_factor = 2000.0, double cell_size = 0.04) {
  const auto body = test::torus_body(0.1, 0.04, cell_size);
  const MotionLayout layout;
  const auto owned = make_elasticity(body, layout);
  Elasticity& elasticity = *owned;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 1.0);
  theta[layout.poissons_ratio] = 0.4;
  elasticity.set_parameters(theta);
  elasticity.linearise(test::deformed(body->reference_positions(), 0.2));
  BlockMatrix A(body->pattern);
  elasticity.add_matrix(1.0, A);
  for (std::size_t b = 0; b < body->mass.size(); ++b)
    for (int d = 0; d < 3; ++d) A.block(int(b))[4 * d] += mass_factor * body->mass[b];
  return A;
}

/// Nodes in a row, each joined to the next: its factor has no fill.
BlockMatrix chain(int nodes) {
  std::vector<int> links;
  for (int n = 0; n + 1 < nodes; ++n) links.insert(links.end(), {n, n + 1});
  BlockMatrix A(std::make_shared<BlockPattern>(BlockPattern::from_elements(nodes, links, 2)));
  for (int n = 0; n < nodes; ++n) {
    const VectorX r = random_vector(9, 10 + unsigned(n));
    const Matrix3 G = Eigen::Map<const Matrix3>(r.data());
    Eigen::Map<Matrix3>(A.block(A.pattern().find(n, n))) = 5.0 * Matrix3::Identity() + G * G.transpose();
    if (n + 1 == nodes) continue;
    Eigen::Map<Matrix3>(A.block(A.pattern().find(n, n + 1))) = G;
    Eigen::Map<Matrix3>(A.block(A.pattern().find(n + 1, n))) = G.transpose();
  }
  return A;
}

TEST(BlockPattern, JoinsTheNodesOfElements) {
  const std::vector<int> nodes = {0, 2, 3, 3, 1, 2};
  const BlockPattern p = BlockPattern::from_elements(5, nodes, 3);
  EXPECT_EQ(p.rows, 5);
  EXPECT_EQ(p.row_start.size(), 6u);
  for (const auto& [a, b] : {std::pair{0, 2}, std::pair{0, 3}, std::pair{1, 2}, std::pair{1, 3}, std::pair{2, 3}}) {
    ASSERT_GE(p.find(a, b), 0);
    ASSERT_GE(p.find(b, a), 0);
    EXPECT_EQ(p.column[p.find(a, b)], b);
  }
  EXPECT_EQ(p.find(0, 1), -1);
  EXPECT_EQ(p.find(4, 0), -1);
  for (int row = 0; row < 5; ++row) {
    EXPECT_EQ(p.column[p.diagonal[row]], row) << "also of the node that no element has";
    EXPECT_TRUE(std::is_sorted(p.column.begin() + p.row_start[row], p.column.begin() + p.row_start[row + 1]));
  }
  EXPECT_EQ(p.block_count(), 5 + 2 * 5);
}

TEST(BlockMatrix, MultipliesAsTheDenseMatrix) {
  for (const BlockMatrix& A : {step_matrix(), chain(7)}) {
    const VectorX x = random_vector(A.rows(), 1);
    VectorX y;
    A.multiply(x, y);
    const VectorX expected = test::dense(A) * x;
    ASSERT_GT(expected.norm(), 0.0);
    EXPECT_LT((y - expected).norm(), tolerance(1e-14) * expected.norm());
  }
}

TEST(BlockMatrix, ConstrainLeavesTheIdentityAndNothingElse) {
  BlockMatrix A = chain(6);
  MatrixX expected = test::dense(A);
  A.constrain(2);
  expected.middleRows(6, 3).setZero();
  expected.middleCols(6, 3).setZero();
  expected.block(6, 6, 3, 3).setIdentity();
  EXPECT_EQ((test::dense(A) - expected).norm(), 0.0);
}

class EverySolver : public ::testing::TestWithParam<SolverKind> {
 protected:
  std::unique_ptr<LinearSolver> make(const BlockMatrix& A, double relative = 1e-13) const {
    return make_linear_solver(A.shared_pattern(), {GetParam(), relative, 1000});
  }
};

TEST_P(EverySolver, AgreesWithTheDenseSolution) {
  for (const BlockMatrix& A : {step_matrix(), chain(9)}) {
    const VectorX b = random_vector(A.rows(), 2);
    const VectorX exact = solve_symmetric(test::dense(A), b);
    const auto solver = make(A);
    ASSERT_TRUE(solver->factorise(A));
    VectorX x = random_vector(A.rows(), 3);  // a bad guess
    const SolveSummary summary = solver->solve(b, x);
    EXPECT_TRUE(summary.converged);
    EXPECT_EQ(summary.iterations > 0, GetParam() != SolverKind::Cholmod && GetParam() != SolverKind::Simplicial);
    EXPECT_LT((x - exact).norm(), tolerance(1e-10) * exact.norm());  // tolerance times the condition
  }
}

TEST_P(EverySolver, SolvesColumnsAsItSolvesEachAlone) {
  const BlockMatrix A = step_matrix();
  const MatrixX dense = test::dense(A);
  for (const Eigen::Index columns : {0, 1, 2, 4, 5, 7}) {
    const auto solver = make(A, 1e-11);
    ASSERT_TRUE(solver->factorise(A));
    MatrixX B(A.rows(), columns), X(A.rows(), columns);
    for (Eigen::Index c = 0; c < columns; ++c) {
      B.col(c) = std::pow(10.0, double(c)) * random_vector(A.rows(), 20 + unsigned(c));
      X.col(c) = random_vector(A.rows(), 40 + unsigned(c));
    }
    if (columns > 2) B.col(2).setZero(), X.col(2).setZero();
    if (columns > 3) X.col(3) = solve_symmetric(dense, VectorX(B.col(3)));  // nothing left to do
    const MatrixX guesses = X;
    const SolveSummary summary = solver->solve_columns(B, X);
    EXPECT_TRUE(summary.converged) << columns << ' ' << summary.residual << ' ' << summary.iterations;
    for (Eigen::Index c = 0; c < columns; ++c) {
      VectorX alone = guesses.col(c);
      ASSERT_TRUE(solver->solve(B.col(c), alone).converged) << c << " of " << columns;
      EXPECT_LT((X.col(c) - alone).norm(), tolerance(1e-10) * alone.norm() + 1e-12) << c << " of " << columns;
      EXPECT_LE((dense * X.col(c) - B.col(c)).norm(), tolerance(1e-10) * B.col(c).norm()) << c << " of " << columns;
    }
  }
}

TEST_P(EverySolver, TakesAnotherMatrixOfThePattern) {
  BlockMatrix A = chain(9);
  const auto solver = make(A);
  ASSERT_TRUE(solver->factorise(A));
  BlockMatrix B = A;
  for (int n = 0; n < 9; ++n) Eigen::Map<Matrix3>(B.block(B.pattern().diagonal[n])) += 3.0 * Matrix3::Identity();
  ASSERT_TRUE(solver->factorise(B));
  const VectorX b = random_vector(B.rows(), 4);
  VectorX x = VectorX::Zero(B.rows());
  solver->solve(b, x);
  EXPECT_LT((test::dense(B) * x - b).norm(), tolerance(1e-11) * b.norm());
}

TEST_P(EverySolver, CloneWorksOnItsOwn) {
  const BlockMatrix A = chain(9);
  const auto solver = make(A);
  const auto clone = solver->clone();
  EXPECT_EQ(clone->name(), solver->name());
  BlockMatrix other = chain(9);
  for (int n = 0; n < 9; ++n) Eigen::Map<Matrix3>(other.block(other.pattern().diagonal[n])) *= 2.0;
  ASSERT_TRUE(solver->factorise(A));
  ASSERT_TRUE(clone->factorise(other));
  const VectorX b = random_vector(A.rows(), 5);
  VectorX x = VectorX::Zero(A.rows()), y = x;
  solver->solve(b, x);
  clone->solve(b, y);
  EXPECT_LT((test::dense(A) * x - b).norm(), tolerance(1e-11) * b.norm());
  EXPECT_LT((test::dense(other) * y - b).norm(), tolerance(1e-11) * b.norm());
}

/// As recordings do that are simulated side by side: clones share nothing, nor do the libraries that they call.
TEST_P(EverySolver, ClonesWorkAtTheSameTime) {
  const BlockMatrix A = step_matrix(2000.0, 0.02);  // large enough for dense blocks that BLAS cuts up
  const VectorX b = random_vector(A.rows(), 6);
  const auto solver = make(A);
  ASSERT_TRUE(solver->factorise(A));
  VectorX alone = VectorX::Zero(A.rows());
  solver->solve(b, alone);
  std::atomic<int> failures = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, clone = std::shared_ptr(solver->clone())] {
      for (int repetition = 0; repetition < 10; ++repetition) {
        VectorX x = VectorX::Zero(A.rows());
        failures += !(clone->factorise(A) && clone->solve(b, x).converged && x == alone);
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(failures, 0);
}

TEST_P(EverySolver, ReportsAnIndefiniteMatrix) {
  BlockMatrix A = chain(9);
  A.block(A.pattern().diagonal[4])[4] = -50.0;
  EXPECT_FALSE(make(A)->factorise(A));
}

TEST_P(EverySolver, ReportsNumbersThatAreNone) {
  BlockMatrix A = chain(9);
  A.block(A.pattern().diagonal[4])[0] = std::nan("");
  const auto solver = make(A);
  bool fine = solver->factorise(A);
  if (fine) {
    VectorX x = VectorX::Zero(A.rows());
    fine = solver->solve(random_vector(A.rows(), 6), x).converged && x.allFinite();
  }
  EXPECT_FALSE(fine);
}

INSTANTIATE_TEST_SUITE_P(Kinds, EverySolver,
                         ::testing::Values(SolverKind::Automatic, SolverKind::Iterative, SolverKind::Multigrid,
                                           SolverKind::Cholmod, SolverKind::Simplicial));

TEST(LinearSolvers, AreWhatTheirNamesSay) {
  const BlockMatrix A = chain(3);
  std::set<std::string> names;
  for (const SolverKind kind :
       {SolverKind::Iterative, SolverKind::Multigrid, SolverKind::Cholmod, SolverKind::Simplicial})
    names.insert(make_linear_solver(A.shared_pattern(), {kind})->name());
  EXPECT_EQ(names.size(), 4u);
}

/// A stiff body without mass takes many iterations; a light one few.
TEST(LinearSolvers, AutomaticFactorisesWhereIterationsCostMore) {
  for (const bool is_hard : {false, true}) {
    const BlockMatrix A = step_matrix(is_hard ? 1e-3 : 2000.0);
    SolverOptions options;
    options.tolerance = 1e-10;
    options.max_iterations = 5000;
    const auto solver = make_linear_solver(A.shared_pattern(), options);
    const VectorX b = random_vector(A.rows(), 4);
    for (int step = 0; step < 6; ++step) {
      ASSERT_TRUE(solver->factorise(A));
      for (unsigned side = 0; side < 4; ++side) {
        VectorX x = VectorX::Zero(A.rows()), product;
        EXPECT_TRUE(solver->solve(b, x).converged);
        A.multiply(x, product);
        EXPECT_LT((product - b).norm(), tolerance(1e-9) * b.norm());
      }
    }
    EXPECT_EQ(solver->name().starts_with("conjugate"), !is_hard);
  }
}

TEST(IncompleteCholesky, IsExactWithoutFill) {
  const BlockMatrix A = chain(12);
  IncompleteCholesky factor(A.pattern());
  ASSERT_TRUE(factor.factorise(A));
  const VectorX b = random_vector(A.rows(), 7), exact = solve_symmetric(test::dense(A), b);
  std::vector<double> r(4 * 12, 0.0), z(4 * 12, 0.0);
  for (int n = 0; n < 12; ++n)
    for (int d = 0; d < 3; ++d) r[4 * n + d] = b[3 * n + d];
  factor.apply(r, z);
  VectorX x(A.rows());
  for (int n = 0; n < 12; ++n)
    for (int d = 0; d < 3; ++d) x[3 * n + d] = z[4 * n + d];
  EXPECT_LT((x - exact).norm(), tolerance(1e-5) * exact.norm());  // single precision
}

TEST(IncompleteCholesky, RaisesTheDiagonalWhereItBreaksDown) {
  const BlockMatrix A = step_matrix(10.0);  // almost the stiffness alone
  IterativeSolver solver(A.shared_pattern(), {SolverKind::Iterative, 1e-10, 2000});
  ASSERT_TRUE(solver.factorise(A));
  const VectorX b = random_vector(A.rows(), 8);
  VectorX x = VectorX::Zero(A.rows());
  EXPECT_TRUE(solver.solve(b, x).converged);
  EXPECT_LT((test::dense(A) * x - b).norm(), tolerance(1e-9) * b.norm());
}

TEST(IterativeSolver, TakesFewIterationsAndReportsItsResidual) {
  const BlockMatrix A = step_matrix();
  const VectorX b = random_vector(A.rows(), 9);
  IterativeSolver solver(A.shared_pattern(), {SolverKind::Iterative, 1e-8, 500});
  ASSERT_TRUE(solver.factorise(A));
  VectorX x = VectorX::Zero(A.rows());
  const SolveSummary summary = solver.solve(b, x);
  EXPECT_LT(summary.iterations, 40);
  EXPECT_GT(summary.iterations, 2);
  EXPECT_NEAR(summary.residual, (test::dense(A) * x - b).norm() / b.norm(), 1e-3 * summary.residual);
  EXPECT_LE(summary.residual, 1e-8);
  EXPECT_EQ(solver.solve(b, x).iterations, 0) << "the solution as a guess needs nothing more";
  x.setZero();
  IterativeSolver hasty(A.shared_pattern(), {SolverKind::Iterative, 1e-8, 3});
  ASSERT_TRUE(hasty.factorise(A));
  const SolveSummary unfinished = hasty.solve(b, x);
  EXPECT_FALSE(unfinished.converged);
  EXPECT_EQ(unfinished.iterations, 3);
}

TEST(IterativeSolver, ColumnsThatDoNotConvergeAreToldOf) {
  const BlockMatrix A = step_matrix();
  IterativeSolver hasty(A.shared_pattern(), {SolverKind::Iterative, 1e-8, 3});
  ASSERT_TRUE(hasty.factorise(A));
  MatrixX B = MatrixX::Zero(A.rows(), 3), X = B;
  B.col(1) = random_vector(A.rows(), 9);
  const SolveSummary summary = hasty.solve_columns(B, X);
  EXPECT_FALSE(summary.converged);
  EXPECT_EQ(summary.iterations, 3);
  EXPECT_NEAR(summary.residual, (test::dense(A) * X.col(1) - B.col(1)).norm() / B.col(1).norm(), 1e-9);
  EXPECT_EQ(X.col(0).norm() + X.col(2).norm(), 0.0);
}

TEST(IterativeSolver, NothingToSolve) {
  const BlockMatrix A = chain(4);
  IterativeSolver solver(A.shared_pattern(), {});
  ASSERT_TRUE(solver.factorise(A));
  VectorX x = VectorX::Zero(A.rows());
  const SolveSummary summary = solver.solve(VectorX::Zero(A.rows()), x);
  EXPECT_TRUE(summary.converged);
  EXPECT_EQ(x.norm(), 0.0);
}

}  // namespace
}  // namespace pliant::linear_solver_test
