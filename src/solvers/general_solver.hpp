#pragma once

#include "solvers/linear_solver.hpp"
#include "solvers/lu_solver.hpp"

namespace pliant {

/// Solves A x = b and A^T x = b for a matrix that is nearly symmetric: exact stiffnesses with the rotations'
/// derivative, whose pattern is symmetric though their numbers are not quite. GMRES without restarts, preconditioned by
/// a factorisation of the symmetric part; where A is symmetric that is one back-substitution. Of large bodies solves by
/// multigrid stand in for the factorisation (`stiffness_solver`). Where the symmetric part is indefinite, LU factors of
/// A or of a matrix before it, or a matrix that is definite and nearby.
class GeneralSolver {
 public:
  /// @param kind  of the factorisation, as `stiffness_solver` reads it
  GeneralSolver(std::shared_ptr<const BlockPattern> pattern, SolverKind kind);

  /// See `LinearSolver::set_positions`.
  void set_positions(const Points& positions) { factor_->set_positions(positions); }
  /// Takes a copy of the matrix. Where its symmetric part is not positive definite, `substitute` (symmetric positive
  /// definite, same pattern) is factorised in its place as preconditioner. False where that fails, too.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix, const BlockMatrix& substitute);
  /// What is preconditioned by where the symmetric part was indefinite.
  enum class Lu {
    Own,    ///< LU factors of the matrix itself
    Before  ///< those that are there, of a matrix before: as long as a few iterations get to the tolerance
  };
  /// Takes a copy of the matrix. Its LU factors are taken where the symmetric part is not positive definite, or where
  /// iterations about that do not get to the tolerance of a solve. False where the matrix is singular.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix, Lu lu = Lu::Own);
  /// Of the last matrix whose symmetric part was factorised.
  bool symmetric_part_is_definite() const { return is_definite_; }

  /// x = P^-1 b with what was factorised: the matrix' symmetric part, or the substitute.
  void precondition(const VectorX& b, VectorX& x) const;

  enum class Side { Plain, Transposed };
  /// @param tolerance  of |b - A x| / |b|
  /// @param x          out; 3 n
  SolveSummary solve(const VectorX& b, VectorX& x, double tolerance, Side side = Side::Plain);

 private:
  void take(const BlockMatrix& matrix);
  [[nodiscard]] bool factorise_itself();
  [[nodiscard]] bool factorise_by_lu();
  SolveSummary iterate(const VectorX& b, VectorX& x, double tolerance, Side side);
  void transpose();

  std::shared_ptr<const BlockPattern> pattern_;
  std::unique_ptr<LinearSolver> factor_;
  std::unique_ptr<LuSolver> lu_;  // made where it is asked for
  BlockMatrix matrix_, symmetric_;
  std::vector<int> transposed_block_;  // of each block
  bool is_definite_ = false;
  bool has_substitute_ = false, goes_by_lu_ = false, lu_is_own_ = false;
  MatrixX basis_, preconditioned_;
  VectorX guess_, product_;
};

}  // namespace pliant
