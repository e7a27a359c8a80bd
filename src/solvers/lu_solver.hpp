#pragma once

#include <memory>

#include "solvers/block_matrix.hpp"

namespace pliant {

/// Solves A x = b and A^T x = b for any invertible matrix of a block pattern, by sparse LU factors: UMFPACK's where
/// SuiteSparse is built in, Eigen's elsewhere.
class LuSolver {
 public:
  explicit LuSolver(std::shared_ptr<const BlockPattern> pattern);
  ~LuSolver();
  LuSolver(LuSolver&&) noexcept;

  /// False where the matrix is singular.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix);
  enum class Refined {
    Yes,  ///< the solution's residual is lowered to what rounding leaves
    No    ///< as the factors have it: enough for a preconditioner, in a third of the time
  };
  /// @param b  3 n
  [[nodiscard]] VectorX solve(const VectorX& b, Refined refined = Refined::Yes) const;
  [[nodiscard]] VectorX solve_transposed(const VectorX& b, Refined refined = Refined::Yes) const;

 private:
  struct Factors;
  std::unique_ptr<Factors> factors_;
};

}  // namespace pliant
