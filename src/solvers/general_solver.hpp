#pragma once

#include "solvers/linear_solver.hpp"

namespace pliant {

/// Solves A x = b and A^T x = b for a matrix that is nearly symmetric: exact stiffnesses with the rotations'
/// derivative, whose pattern is symmetric though their numbers are not quite. GMRES without restarts, preconditioned by
/// a factorisation of the symmetric part; where A is symmetric that is one back-substitution. Of large bodies solves by
/// multigrid stand in for the factorisation (`stiffness_solver`).
class GeneralSolver {
 public:
  /// @param kind  of the factorisation, as `stiffness_solver` reads it
  GeneralSolver(std::shared_ptr<const BlockPattern> pattern, SolverKind kind);

  /// See `LinearSolver::set_positions`.
  void set_positions(const Points& positions) { factor_->set_positions(positions); }
  /// Takes a copy of the matrix. Where its symmetric part is not positive definite, `substitute` (symmetric positive
  /// definite, same pattern) is factorised in its place as preconditioner. False where that fails, too.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix, const BlockMatrix& substitute);
  bool symmetric_part_is_definite() const { return is_definite_; }

  /// x = P^-1 b with what was factorised: the matrix' symmetric part, or the substitute.
  void precondition(const VectorX& b, VectorX& x) const;

  enum class Side { Plain, Transposed };
  /// @param tolerance  of |b - A x| / |b|
  /// @param x          out; 3 n
  SolveSummary solve(const VectorX& b, VectorX& x, double tolerance, Side side = Side::Plain);

 private:
  void transpose();

  std::shared_ptr<const BlockPattern> pattern_;
  std::unique_ptr<LinearSolver> factor_;
  BlockMatrix matrix_, symmetric_;
  std::vector<int> transposed_block_;  // of each block
  bool is_definite_ = false;
  MatrixX basis_, preconditioned_;
  VectorX guess_, product_;
};

}  // namespace pliant
