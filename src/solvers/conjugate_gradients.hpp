#pragma once

#include "solvers/linear_solver.hpp"

namespace pliant {

/// Conjugate gradients preconditioned by a factorisation at hand, of a nearby matrix: for systems that follow each
/// other closely. Keeps its vectors from call to call.
class PreconditionedConjugateGradients {
 public:
  /// Solves A x = b from x = 0.
  /// @param preconditioner  a direct solver that has factorised a nearby matrix and does not need it any more
  /// @param tolerance       of |b - A x| / |b|
  /// Not converged within `max_iterations`, or where A is not positive definite along the way: x is of no use.
  SolveSummary solve(const BlockMatrix& A, LinearSolver& preconditioner, const VectorX& b, VectorX& x, double tolerance,
                     int max_iterations);

 private:
  VectorX r_, z_, p_, product_;
};

}  // namespace pliant
