#include "solvers/linear_solver.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
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

/// Iterates, until that has cost more than a factorisation several times in a row; from then on factorises. What counts
/// are iterations, not time, so that every run takes the same way.
class AutomaticSolver : public LinearSolver {
 public:
  AutomaticSolver(std::shared_ptr<const BlockPattern> pattern, const SolverOptions& options)
      : pattern_(std::move(pattern)), options_(options), iterative_(pattern_, options) {
    // As measured (docs/performance.md): a factorisation costs about as much as so many iterations.
    const double by_kind = best_direct_kind() == SolverKind::Cholmod ? 4.0 : 12.0;
    worth_a_factor_ = int(by_kind * std::sqrt(double(pattern_->rows)));
  }

  [[nodiscard]] bool factorise(const BlockMatrix& matrix) override {
    matrix_ = &matrix;
    if (direct_) return direct_->factorise(matrix);
    constexpr int often_enough = 3;
    too_long_ = iterations_ > worth_a_factor_ ? too_long_ + 1 : 0;
    iterations_ = 0;
    return too_long_ >= often_enough ? turn_direct() : iterative_.factorise(matrix);
  }
  SolveSummary solve(const VectorX& b, VectorX& x) override {
    if (direct_) return direct_->solve(b, x);
    const SolveSummary summary = iterative_.solve(b, x);
    iterations_ += summary.iterations;
    if (summary.converged || !turn_direct()) return summary;
    return direct_->solve(b, x);
  }
  SolveSummary solve_columns(const MatrixX& B, MatrixX& X) override {
    if (direct_) return direct_->solve_columns(B, X);
    const SolveSummary summary = iterative_.solve_columns(B, X);
    iterations_ += summary.iterations;
    if (summary.converged || !turn_direct()) return summary;
    return direct_->solve_columns(B, X);
  }
  std::string name() const override { return direct_ ? direct_->name() : iterative_.name(); }
  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<AutomaticSolver>(pattern_, options_); }

 private:
  bool turn_direct() {
    SolverOptions direct = options_;
    direct.kind = best_direct_kind();
    direct_ = make_linear_solver(pattern_, direct);
    return direct_->factorise(*matrix_);
  }

  std::shared_ptr<const BlockPattern> pattern_;
  SolverOptions options_;
  ConjugateGradients iterative_;
  std::unique_ptr<LinearSolver> direct_;
  const BlockMatrix* matrix_ = nullptr;
  int worth_a_factor_, iterations_ = 0, too_long_ = 0;
};

}  // namespace

SolveSummary LinearSolver::solve_columns(const MatrixX& B, MatrixX& X) {
  SolveSummary all{true, 0, 0.0};
  VectorX b, x;
  for (Eigen::Index c = 0; c < B.cols(); ++c) {
    b = B.col(c), x = X.col(c);
    const SolveSummary one = solve(b, x);
    X.col(c) = x;
    all = {all.converged && one.converged, all.iterations + one.iterations, std::max(all.residual, one.residual)};
  }
  return all;
}

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
    case SolverKind::Automatic:
      return std::make_unique<AutomaticSolver>(std::move(pattern), options);
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
