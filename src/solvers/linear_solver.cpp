#include "solvers/linear_solver.hpp"

#include <Eigen/SparseCholesky>
#include <stdexcept>

#include "solvers/cholmod_solver.hpp"
#include "solvers/incomplete_cholesky.hpp"

namespace pliant {

namespace {

/// Eigen's simplicial Cholesky: the direct solver of builds without CHOLMOD.
class SimplicialSolver : public LinearSolver {
 public:
  explicit SimplicialSolver(std::shared_ptr<const BlockPattern> pattern) : pattern_(std::move(pattern)) {}

  [[nodiscard]] bool factorise(const BlockMatrix& matrix) override {
    const BlockPattern& pattern = *pattern_;
    std::vector<Eigen::Triplet<double>> entries;
    for (int row = 0; row < pattern.rows; ++row)
      for (int b = pattern.row_start[row]; b <= pattern.diagonal[row]; ++b)
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i)
            entries.emplace_back(3 * row + i, 3 * pattern.column[b] + j, matrix.block(b)[3 * j + i]);
    Eigen::SparseMatrix<double> a(matrix.rows(), matrix.rows());
    a.setFromTriplets(entries.begin(), entries.end());
    if (!analysed_) factor_.analyzePattern(a);
    analysed_ = true;
    factor_.factorize(a);
    return factor_.info() == Eigen::Success;
  }
  SolveSummary solve(const VectorX& b, VectorX& x) override {
    x = factor_.solve(b);
    return {true, 0, 0.0};
  }
  std::string name() const override { return "Eigen simplicial Cholesky"; }
  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<SimplicialSolver>(pattern_); }

 private:
  std::shared_ptr<const BlockPattern> pattern_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> factor_;
  bool analysed_ = false;
};

}  // namespace

SolverKind best_direct_kind() {
#ifdef PLIANT_WITH_CHOLMOD
  return SolverKind::Cholmod;
#else
  return SolverKind::Simplicial;
#endif
}

std::unique_ptr<LinearSolver> make_linear_solver(std::shared_ptr<const BlockPattern> pattern,
                                                 const SolverOptions& options) {
  switch (options.kind) {
    case SolverKind::Automatic:  // faster than a factorisation at every size measured, see docs/performance.md
    case SolverKind::Iterative:
      return std::make_unique<ConjugateGradients>(std::move(pattern), options);
    case SolverKind::Simplicial:
      return std::make_unique<SimplicialSolver>(std::move(pattern));
    case SolverKind::Cholmod:
      return make_cholmod_solver(std::move(pattern));
  }
  throw std::invalid_argument("unknown kind of linear solver");
}

}  // namespace pliant
