#include <vector>

#include "base/parallel.hpp"
#include "elasticity/corotated.hpp"
#include "solvers/linear_solver.hpp"
#include "support/bodies.hpp"
#include "support/tolerance.hpp"

namespace pliant::multigrid_test {
namespace {

using test::tolerance;

/// A clamped bar of 4 n x n x n cells of linear tetrahedra, or a slab of hexahedra, turned and bent.
struct System {
  std::shared_ptr<const Body> body;
  BlockMatrix A;
  Points positions;
  VectorX b;

  /// @param mass  of a node against the stiffness of an element: 0 is an equilibrium
  System(std::shared_ptr<const Body> of, double mass, bool is_held = true) : body(std::move(of)), A(body->pattern) {
    const MotionLayout layout;
    const auto elasticity = make_elasticity(body, layout);
    VectorX theta = layout.zero();
    layout.set_moduli(theta, 1.0);
    theta[layout.poissons_ratio] = 0.35;
    elasticity->set_parameters(theta);
    positions = test::deformed(body->nodes, 0.05);
    elasticity->linearise(positions);
    elasticity->add_matrix(1.0, A);
    for (std::size_t k = 0; k < body->mass.size(); ++k)
      for (int d = 0; d < 3; ++d) A.block(int(k))[4 * d] += mass * body->mass[k];
    b.resize(3 * body->node_count());
    for (Eigen::Index i = 0; i < b.size(); ++i) b[i] = std::sin(1.0 + double(i * i % 1009));
    const double end = body->nodes.col(0).minCoeff() + 1e-9;
    for (int n = 0; n < body->node_count() && is_held; ++n)
      if (body->nodes(n, 0) < end) A.constrain(n), b.segment<3>(3 * n).setZero();
  }
  double residual(const VectorX& x) const {
    VectorX product;
    A.multiply(x, product);
    return (product - b).norm() / b.norm();
  }
};

std::shared_ptr<const Body> bar(int cells, bool quadratic = false) {
  return test::tet_body({1.0, 0.25, 0.25}, {4 * cells, cells, cells}, quadratic);
}

SolveSummary solve(const System& system, SolverKind kind, VectorX& x, const Points* positions = nullptr) {
  const auto solver = make_linear_solver(system.A.shared_pattern(), {kind, 1e-8, 5000});
  if (positions) solver->set_positions(*positions);
  EXPECT_TRUE(solver->factorise(system.A));
  x = VectorX::Zero(system.b.size());
  return solver->solve(system.b, x);
}
int iterations(const System& system, SolverKind kind, const Points& positions) {
  VectorX x;
  const SolveSummary summary = solve(system, kind, x, &positions);
  EXPECT_TRUE(summary.converged);
  EXPECT_LT(system.residual(x), 2e-8);  // the iteration's own residual drifts from the true one by rounding
  return summary.iterations;
}

TEST(Multigrid, AgreesWithAFactorisation) {
  for (const auto& body : {bar(6), bar(3, true), test::box_body({0.4, 0.1, 0.1}, 0.02)}) {
    const System system(body, 1e-3);
    VectorX x, exact;
    ASSERT_TRUE(solve(system, SolverKind::Multigrid, x, &system.positions).converged);
    solve(system, SolverKind::Simplicial, exact);
    EXPECT_LT((x - exact).norm(), tolerance(1e-4) * exact.norm());  // 1e-8 times the condition
    EXPECT_LT(system.residual(exact), 1e-10);
  }
}

/// Of equilibria, where the local solver's iterations grow as elements become small.
TEST(Multigrid, IterationsHardlyGrowAsTheMeshIsRefined) {
  const System coarse(bar(5), 0.0), fine(bar(15), 0.0);
  const int at_coarse = iterations(coarse, SolverKind::Multigrid, coarse.positions),
            at_fine = iterations(fine, SolverKind::Multigrid, fine.positions);
  EXPECT_LT(at_fine, 1.6 * at_coarse);
  EXPECT_GT(iterations(fine, SolverKind::Iterative, fine.positions),
            2.0 * iterations(coarse, SolverKind::Iterative, coarse.positions));
  EXPECT_LT(2 * at_fine, iterations(fine, SolverKind::Iterative, fine.positions));
}

/// Rotations of aggregates are about where nodes are, not where they were at rest or nowhere.
TEST(Multigrid, MovesPartsRigidlyWhereTheyAre) {
  const System system(bar(8), 0.0);
  const int there = iterations(system, SolverKind::Multigrid, system.positions);
  EXPECT_GT(iterations(system, SolverKind::Multigrid, system.body->nodes), 1.3 * there);
  EXPECT_GT(iterations(system, SolverKind::Multigrid, Points(0, 3)), 1.3 * there);
}

/// A large body's factor is small where the body is slender; of a bulky one multigrid takes less.
TEST(Multigrid, IsTheOtherWayOfLargeBodiesThatAreNotSlender) {
  if (best_direct_kind() != SolverKind::Cholmod) GTEST_SKIP() << "this build has no CHOLMOD";
  for (const bool is_slender : {true, false}) {
    const System system(is_slender ? test::tet_body({10.0, 0.02, 0.02}, {1000, 2, 2}, false) : bar(13), 0.0);
    ASSERT_GT(system.body->node_count(), 8192);
    const auto solver = make_linear_solver(system.A.shared_pattern(), {SolverKind::Automatic, 1e-8, 60});
    solver->set_positions(system.positions);
    ASSERT_TRUE(solver->factorise(system.A));
    VectorX x = VectorX::Zero(system.b.size());
    (void)solver->solve(system.b, x);  // so few iterations are not enough
    EXPECT_EQ(solver->name().starts_with("CHOLMOD"), is_slender) << solver->name();
    EXPECT_EQ(solver->name().find("multigrid") == std::string::npos, is_slender) << solver->name();
  }
}

TEST(Multigrid, TakesABodyThatNothingHolds) {
  const System system(bar(4), 0.5, false);
  VectorX x;
  EXPECT_TRUE(solve(system, SolverKind::Multigrid, x, &system.positions).converged);
  EXPECT_LT(system.residual(x), 2e-8);
}

/// Nodes in a line, alone, and in pairs: aggregates that cannot turn in all ways.
TEST(Multigrid, TakesAggregatesOfFewNodes) {
  std::vector<int> links;
  for (int n = 0; n + 1 < 300; ++n)
    if (n % 50 != 49 && n < 290) links.insert(links.end(), {n, n + 1});
  BlockMatrix A(std::make_shared<BlockPattern>(BlockPattern::from_elements(300, links, 2)));
  Points line = Points::Zero(300, 3);
  for (int n = 0; n < 300; ++n) line(n, 0) = n;
  for (int row = 0; row < 300; ++row)
    for (int k = A.pattern().row_start[row]; k < A.pattern().row_start[row + 1]; ++k)
      Eigen::Map<Matrix3>(A.block(k)) =
          A.pattern().column[k] == row ? Matrix3(2.1 * Matrix3::Identity()) : Matrix3(-Matrix3::Identity());
  const auto solver = make_linear_solver(A.shared_pattern(), {SolverKind::Multigrid, 1e-10, 500});
  solver->set_positions(line);
  ASSERT_TRUE(solver->factorise(A));
  const VectorX b = VectorX::LinSpaced(900, -1.0, 2.0);
  VectorX x = VectorX::Zero(900), product;
  EXPECT_TRUE(solver->solve(b, x).converged);
  A.multiply(x, product);
  EXPECT_LT((product - b).norm(), 1e-9 * b.norm());
}

MatrixX columns(const System& system, Eigen::Index count) {
  MatrixX B(system.b.size(), count);
  for (Eigen::Index c = 0; c < count; ++c)
    for (Eigen::Index i = 0; i < B.rows(); ++i) B(i, c) = system.b[i] * std::cos(double(c) + 1e-3 * double(i));
  return B;
}

/// Columns are derivatives, which have a tolerance of their own.
TEST(LargeBodies, SolveColumnsToTheTolerancesOfDerivatives) {
  const System system(bar(13), 1.0);
  const MatrixX B = columns(system, 6);
  for (const SolverKind kind : {SolverKind::Iterative, SolverKind::Multigrid}) {
    std::vector<int> iterations;
    for (const double asked : {0.0, 1e-4}) {
      const auto solver = make_linear_solver(system.A.shared_pattern(), {kind, 1e-8, 5000, asked});
      solver->set_positions(system.positions);
      ASSERT_TRUE(solver->factorise(system.A));
      MatrixX X = MatrixX::Zero(B.rows(), B.cols());
      const SolveSummary summary = solver->solve_columns(B, X);
      EXPECT_TRUE(summary.converged);
      VectorX product;
      for (Eigen::Index c = 0; c < B.cols(); ++c) {
        system.A.multiply(X.col(c), product);
        EXPECT_LT((product - B.col(c)).norm(), (asked > 0.0 ? 1.1 * asked : 2e-8) * B.col(c).norm()) << c;
      }
      iterations.push_back(summary.iterations);
    }
    EXPECT_LT(iterations[1], 0.9 * iterations[0]);
  }
}

/// Many right-hand sides of one matrix pay for a factor, which they share; multigrid would have to solve each of them.
TEST(LargeBodies, DoNotTurnToMultigridForManyColumns) {
  const System system(bar(13), 1e3);
  const MatrixX B = columns(system, 12);
  const auto solver = make_linear_solver(system.A.shared_pattern(), {SolverKind::Automatic, 1e-8, 500});
  VectorX x;
  MatrixX X;
  int together = 0;
  for (int matrix = 0; matrix < 5; ++matrix) {
    ASSERT_TRUE(solver->factorise(system.A));
    x.setZero(system.b.size());
    const SolveSummary alone = solver->solve(system.b, x);
    EXPECT_LT(alone.iterations, 40);
    X.setZero(B.rows(), B.cols());
    together = alone.iterations + solver->solve_columns(B, X).iterations;
  }
  EXPECT_GT(together, 60) << "what would make a small body's solver turn";
  EXPECT_EQ(solver->name().find("multigrid"), std::string::npos) << solver->name();
}

/// Large enough that loops over rows and aggregates are cut into parts; the incomplete factor's are larger.
TEST(LargeBodies, SolveToTheSameBitsByAnyNumberOfThreads) {
  const System system(bar(17), 1.0);
  ASSERT_GT(std::size_t(system.body->node_count()), 4 * Parts::least);
  for (const SolverKind kind : {SolverKind::Iterative, SolverKind::Multigrid}) {
    std::vector<VectorX> x(3);
    for (int threads = 1; threads <= 3; ++threads) {
      const ThreadLimit limit(threads);
      EXPECT_TRUE(solve(system, kind, x[std::size_t(threads) - 1], &system.positions).converged);
    }
    EXPECT_TRUE(x[0] == x[1]);
    EXPECT_TRUE(x[0] == x[2]);
    EXPECT_LT(system.residual(x[0]), 2e-8);
  }
}
TEST(LargeBodies, SolveColumnsToTheSameBitsByAnyNumberOfThreads) {
  const System system(bar(17), 1.0);
  const MatrixX B = columns(system, 6);
  for (const SolverKind kind : {SolverKind::Iterative, SolverKind::Multigrid}) {
    std::vector<MatrixX> X(3, MatrixX::Zero(B.rows(), B.cols()));
    for (int threads = 1; threads <= 3; ++threads) {
      const ThreadLimit limit(threads);
      const auto solver = make_linear_solver(system.A.shared_pattern(), {kind, 1e-8, 5000});
      solver->set_positions(system.positions);
      ASSERT_TRUE(solver->factorise(system.A));
      EXPECT_TRUE(solver->solve_columns(B, X[std::size_t(threads) - 1]).converged);
    }
    EXPECT_TRUE(X[0] == X[1]);
    EXPECT_TRUE(X[0] == X[2]);
  }
}

}  // namespace
}  // namespace pliant::multigrid_test
