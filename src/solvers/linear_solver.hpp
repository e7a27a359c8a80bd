#pragma once

#include <memory>
#include <string>

#include "solvers/block_matrix.hpp"

namespace pliant {

/// What one solve did.
struct SolveSummary {
  bool converged = false;
  int iterations = 0;     ///< 0 for direct solvers
  double residual = 0.0;  ///< |b - A x| / |b|, as the iteration saw it; 0 for direct solvers
};

/// Solves A x = b for symmetric positive definite A with an unchanging pattern.
class LinearSolver {
 public:
  virtual ~LinearSolver() = default;
  /// Where the rows' nodes are [m], n x 3, for solvers that move parts of a body rigidly; to be said before `factorise`
  /// where nodes have moved far. There may be fewer than rows.
  virtual void set_positions(const Points& positions) { (void)positions; }
  /// Numerical factorisation (or preconditioner) of a matrix; it must stay alive and unchanged while solving.
  /// Returns false where the matrix is not positive definite.
  [[nodiscard]] virtual bool factorise(const BlockMatrix& matrix) = 0;
  /// @param x  in: a first guess; out: the solution, 3 n
  virtual SolveSummary solve(const VectorX& b, VectorX& x) = 0;
  /// A X = B, column by column; all 3 n x p. Solvers may take columns together, which costs less than one by one, and
  /// some beside others, in several threads.
  /// @param X  in: first guesses; out: the solutions
  /// `converged` is true where all columns are; the residual is the largest.
  virtual SolveSummary solve_columns(const MatrixX& B, MatrixX& X);
  virtual std::string name() const = 0;
  /// A solver of the same kind and pattern, for another thread.
  virtual std::unique_ptr<LinearSolver> clone() const = 0;
};

enum class SolverKind {
  Automatic,   ///< iterative, until that has cost more than factorisations (of large bodies multigrid) several times
               ///< in a row
  Iterative,   ///< conjugate gradients with an incomplete Cholesky factor of 3 x 3 blocks
  Multigrid,   ///< the same with rigid motions of aggregates on coarser and coarser levels: large or stiff bodies
  Cholmod,     ///< supernodal sparse Cholesky (needs PLIANT_WITH_CHOLMOD)
  Simplicial,  ///< Eigen's sparse Cholesky
};

/// The fastest factorisation that is built in.
SolverKind best_direct_kind();

struct SolverOptions {
  SolverKind kind = SolverKind::Automatic;
  double tolerance = 1e-8;   ///< relative residual of the iterative solver, (0, 1)
  int max_iterations = 500;  ///< of the iterative solver, >= 1
  /// Of derivatives, that is of `solve_columns` and of steps' tangents and adjoints, as `tolerance` otherwise; 0: that,
  /// and 1e-12 for fully implicit steps.
  double derivative_tolerance = 0.0;
};

/// How equilibria solve with their stiffness, whose conditioning no mass helps: by a factorisation, and of bodies whose
/// factor would be too large, or where that is asked for, by multigrid.
/// @param tolerance  relative residual, where it iterates, (0, 1)
SolverOptions stiffness_solver(SolverKind asked, const BlockPattern& pattern, double tolerance);

/// Throws std::invalid_argument where the kind was not built in.
std::unique_ptr<LinearSolver> make_linear_solver(std::shared_ptr<const BlockPattern> pattern,
                                                 const SolverOptions& options = {});

}  // namespace pliant
