#include "solvers/linear_solver.hpp"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "solvers/cholmod_solver.hpp"
#include "solvers/incomplete_cholesky.hpp"
#include "solvers/multigrid_solver.hpp"

namespace pliant {

namespace {

/// From so many block rows on multigrid may be the other way than iterating.
constexpr int rows_for_multigrid = 8192;
/// From so many on a factor of a stiffness is too large: some ten kilobytes a node, and more the more there are.
constexpr int rows_too_many_to_factorise = 32768;

/// No factor is worth fewer iterations, however small.
constexpr int least_worth_of_a_factor = 50;

constexpr double infinite = std::numeric_limits<double>::infinity();

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

/// So many iterations with the incomplete factor take about as long as a factorisation and a solve with it, as measured
/// (docs/performance.md): slender and thin bodies have small factors, and matrices of large ones come from beyond the
/// caches.
double iterations_worth_a_factor(const std::shared_ptr<const BlockPattern>& pattern) {
  if (best_direct_kind() != SolverKind::Cholmod) return 12.0 * std::sqrt(double(pattern->rows));
  const FactorCounts factor = count_factor(pattern);
  const double by_entry = pattern->rows < rows_for_multigrid ? 5.0 : 3.0;
  return std::max({double(least_worth_of_a_factor), by_entry * factor.entries / pattern->block_count(),
                   factor.operations / (200.0 * pattern->block_count())});
}

/// Iterates, until that has cost more than another way several times in a row, which it goes from then on: a
/// factorisation, which serves all right-hand sides of a matrix, or, of large bodies that are not slender, multigrid,
/// which shortens each solve. What counts are iterations, not time, so that every run takes the same way.
class AutomaticSolver : public LinearSolver {
 public:
  AutomaticSolver(std::shared_ptr<const BlockPattern> pattern, const SolverOptions& options)
      : pattern_(std::move(pattern)), options_(options), iterative_(pattern_, options) {}

  void set_positions(const Points& positions) override {
    if (other_)
      other_->set_positions(positions);
    else if (is_large())
      positions_ = positions;
  }
  [[nodiscard]] bool factorise(const BlockMatrix& matrix) override {
    matrix_ = &matrix;
    if (other_) return other_->factorise(matrix);
    constexpr int often_enough = 3;
    too_long_ = is_too_long() ? too_long_ + 1 : 0;
    iterations_ = longest_ = 0;
    return too_long_ >= often_enough ? turn() : iterative_.factorise(matrix);
  }
  SolveSummary solve(const VectorX& b, VectorX& x) override {
    if (other_) return other_->solve(b, x);
    const SolveSummary summary = iterative_.solve(b, x);
    iterations_ += summary.iterations;
    longest_ = std::max(longest_, summary.iterations);
    if (summary.converged || !turn()) return summary;
    return other_->solve(b, x);
  }
  SolveSummary solve_columns(const MatrixX& B, MatrixX& X) override {
    if (other_) return other_->solve_columns(B, X);
    const SolveSummary summary = iterative_.solve_columns(B, X);
    iterations_ += summary.iterations;
    if (summary.converged || !turn()) return summary;
    return other_->solve_columns(B, X);
  }
  std::string name() const override { return other_ ? other_->name() : iterative_.name(); }
  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<AutomaticSolver>(pattern_, options_); }

 private:
  /// Where multigrid takes over. What it takes grows with how slender a body is, what a factor takes is certain: that
  /// is the other way as long as it is worth no more than a hard solve by multigrid.
  static constexpr int multigrid_iterations = 40, hard_multigrid = 200;
  bool is_large() const { return pattern_->rows >= rows_for_multigrid; }
  bool is_too_long() {
    if (iterations_ <= std::min(least_worth_of_a_factor, multigrid_iterations)) return false;
    const int worth = worth_another();
    return (factorises_ ? iterations_ : longest_) > worth;
  }
  /// Iterations that another way is worth.
  int worth_another() {
    if (worth_another_) return *worth_another_;
    double factor = infinite;
    if (pattern_->rows <= rows_too_many_to_factorise && (!is_large() || best_direct_kind() == SolverKind::Cholmod))
      factor = iterations_worth_a_factor(pattern_);
    factorises_ = !is_large() || factor <= hard_multigrid;
    return *(worth_another_ = factorises_ ? int(factor) : multigrid_iterations);
  }
  bool turn() {
    SolverOptions other = options_;
    (void)worth_another();
    other.kind = factorises_ ? best_direct_kind() : SolverKind::Multigrid;
    other_ = make_linear_solver(pattern_, other);
    other_->set_positions(positions_);
    return other_->factorise(*matrix_);
  }

  std::shared_ptr<const BlockPattern> pattern_;
  SolverOptions options_;
  IterativeSolver iterative_;
  std::unique_ptr<LinearSolver> other_;
  Points positions_;  // of large bodies
  const BlockMatrix* matrix_ = nullptr;
  std::optional<int> worth_another_;                 // where it has been asked for
  bool factorises_ = false;                          // as the other way
  int iterations_ = 0, longest_ = 0, too_long_ = 0;  // of the matrix at hand: of all solves, and of the longest one
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

SolverOptions stiffness_solver(SolverKind asked, const BlockPattern& pattern, double tolerance) {
  SolverOptions options;
  options.kind = asked == SolverKind::Simplicial ? SolverKind::Simplicial : best_direct_kind();
  if (asked == SolverKind::Multigrid || (asked == SolverKind::Automatic && pattern.rows > rows_too_many_to_factorise))
    options.kind = SolverKind::Multigrid;
  options.tolerance = tolerance;
  options.max_iterations = 2000;
  return options;
}

std::unique_ptr<LinearSolver> make_linear_solver(std::shared_ptr<const BlockPattern> pattern,
                                                 const SolverOptions& options) {
  switch (options.kind) {
    case SolverKind::Automatic:
      return std::make_unique<AutomaticSolver>(std::move(pattern), options);
    case SolverKind::Iterative:
      return std::make_unique<IterativeSolver>(std::move(pattern), options);
    case SolverKind::Multigrid:
      return std::make_unique<MultigridSolver>(std::move(pattern), options);
    case SolverKind::Simplicial:
      return std::make_unique<SimplicialSolver>(std::move(pattern));
    case SolverKind::Cholmod:
      return make_cholmod_solver(std::move(pattern));
  }
  throw std::invalid_argument("unknown kind of linear solver");
}

}  // namespace pliant
