#pragma once

#include "solvers/coarse_space.hpp"
#include "solvers/incomplete_cholesky.hpp"

namespace pliant {

/// Conjugate gradients with an incomplete Cholesky factor for what is local and rigid motions of aggregates, on coarser
/// and coarser levels, for what is not: the iterations hardly grow as a mesh is refined. The two are added: one product
/// with the matrix an iteration, and positive definite whatever the factor leaves out.
class MultigridSolver : public IterativeSolver {
 public:
  MultigridSolver(std::shared_ptr<const BlockPattern> pattern, const SolverOptions& options);
  void set_positions(const Points& positions) override { coarse_.set_positions(positions); }
  [[nodiscard]] bool factorise(const BlockMatrix& matrix) override;
  std::string name() const override;
  std::unique_ptr<LinearSolver> clone() const override;

 protected:
  void precondition(const std::vector<double>& r, std::vector<double>& z) override;
  void precondition_lanes(const std::vector<double>& r, std::vector<double>& z, std::vector<float>& work) override;
  /// Fours of columns follow each other: aggregates have one memory.
  bool takes_fours_beside_each_other() const override { return false; }

 private:
  CoarseSpace coarse_;
};

}  // namespace pliant
