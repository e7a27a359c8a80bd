#pragma once

#include "solvers/coarse_space.hpp"
#include "solvers/incomplete_cholesky.hpp"

namespace pliant {

/// Conjugate gradients with an incomplete Cholesky factor for what is local and rigid motions of aggregates, on coarser
/// and coarser levels, for what is not: the iterations hardly grow as a mesh is refined. The two are added: one product
/// with the matrix an iteration, and positive definite whatever the factor leaves out.
class MultigridSolver : public ConjugateGradients {
 public:
  MultigridSolver(std::shared_ptr<const BlockPattern> pattern, const SolverOptions& options);
  void set_positions(const Points& positions) override { coarse_.set_positions(positions); }
  [[nodiscard]] bool factorise(const BlockMatrix& matrix) override;
  /// One by one: the corrections of the aggregates have no lanes.
  SolveSummary solve_columns(const MatrixX& B, MatrixX& X) override {
    return LinearSolver::solve_columns(B, X);  // NOLINT(bugprone-parent-virtual-call)
  }
  std::string name() const override;
  std::unique_ptr<LinearSolver> clone() const override;

 protected:
  void precondition(const std::vector<double>& r, std::vector<double>& z) override;

 private:
  CoarseSpace coarse_;
};

}  // namespace pliant
