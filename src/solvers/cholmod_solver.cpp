#include "solvers/cholmod_solver.hpp"

#include <stdexcept>

#ifdef PLIANT_WITH_CHOLMOD
#include <cholmod.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <utility>

#include "solvers/blas.hpp"
#endif

namespace pliant {

#ifdef PLIANT_WITH_CHOLMOD

namespace {

class CholmodSolver : public LinearSolver {
 public:
  explicit CholmodSolver(std::shared_ptr<const BlockPattern> pattern) : pattern_(std::move(pattern)) {
    const BlasCall blas;
    cholmod_start(&common_);
    common_.supernodal = CHOLMOD_SUPERNODAL;
    common_.print = 0;
    order_nodes();
    build_structure();
    common_.nmethods = 1;
    common_.method[0].ordering = CHOLMOD_NATURAL;
    common_.postorder = 0;
    factor_ = cholmod_analyze(matrix_, &common_);
  }
  ~CholmodSolver() override {
    cholmod_free_dense(&solution_, &common_);
    cholmod_free_dense(&work_y_, &common_);
    cholmod_free_dense(&work_e_, &common_);
    cholmod_free_factor(&factor_, &common_);
    cholmod_free_sparse(&matrix_, &common_);
    cholmod_finish(&common_);
  }
  CholmodSolver(const CholmodSolver&) = delete;
  CholmodSolver& operator=(const CholmodSolver&) = delete;

  [[nodiscard]] bool factorise(const BlockMatrix& matrix) override {
    auto* values = static_cast<double*>(matrix_->x);
    const double* from = matrix.block(0);
    for (std::size_t k = 0; k < source_.size(); ++k) values[k] = from[source_[k]];
    const BlasCall blas;
    return cholmod_factorize(matrix_, factor_, &common_) && common_.status == CHOLMOD_OK;
  }

  SolveSummary solve(const VectorX& b, VectorX& x) override {
    x.resize(b.size());
    return solve_dense(b, x.data());
  }
  SolveSummary solve_columns(const MatrixX& B, MatrixX& X) override {
    return B.cols() == 0 ? SolveSummary{true, 0, 0.0} : solve_dense(B, X.data());
  }

  std::string name() const override { return "CHOLMOD supernodal Cholesky"; }
  FactorCounts counts() const { return {common_.lnz, common_.fl}; }
  std::unique_ptr<LinearSolver> clone() const override { return std::make_unique<CholmodSolver>(pattern_); }

 private:
  /// @param x  out: as large as B, columns one after the other
  template <class Dense>
  SolveSummary solve_dense(const Dense& B, double* x) {
    const Eigen::Index n = B.rows();
    rhs_.resize(n, B.cols());
    for (Eigen::Index c = 0; c < B.cols(); ++c)
      for (Eigen::Index k = 0; k < n; ++k) rhs_(k, c) = B(order_[std::size_t(k)], c);
    cholmod_dense rhs{};
    rhs.nrow = rhs.d = std::size_t(n);
    rhs.ncol = std::size_t(B.cols());
    rhs.nzmax = std::size_t(B.size());
    rhs.x = rhs_.data();
    rhs.xtype = CHOLMOD_REAL;
    rhs.dtype = CHOLMOD_DOUBLE;
    const BlasCall blas;
    if (!cholmod_solve2(CHOLMOD_A, factor_, &rhs, nullptr, &solution_, nullptr, &work_y_, &work_e_, &common_))
      return {false, 0, 0.0};
    const auto* found = static_cast<const double*>(solution_->x);
    for (Eigen::Index c = 0; c < B.cols(); ++c)
      for (Eigen::Index k = 0; k < n; ++k) x[c * n + order_[std::size_t(k)]] = found[c * n + k];
    return {true, 0, 0.0};
  }

  /// An order of the unknowns with little fill, postordered, by the pattern's upper triangle.
  void order_nodes() {
    const BlockPattern& pattern = *pattern_;
    const std::size_t n = 3 * std::size_t(pattern.rows);
    std::size_t count = 0;
    for (int row = 0; row < pattern.rows; ++row)
      count += 9 * std::size_t(pattern.diagonal[row] - pattern.row_start[row]) + 6;
    cholmod_sparse* upper = cholmod_allocate_sparse(n, n, count, true, true, 1, CHOLMOD_PATTERN, &common_);
    auto* start = static_cast<int*>(upper->p);
    auto* index = static_cast<int*>(upper->i);
    int filled = 0;
    for (int row = 0; row < pattern.rows; ++row)
      for (int c = 0; c < 3; ++c) {
        start[3 * row + c] = filled;
        for (int b = pattern.row_start[row]; b <= pattern.diagonal[row]; ++b)
          for (int r = 0; r < 3; ++r)
            if (pattern.column[b] != row || r <= c) index[filled++] = 3 * pattern.column[b] + r;
      }
    start[n] = filled;
    order_.resize(n);
    std::iota(order_.begin(), order_.end(), 0);
    if (cholmod_factor* factor = cholmod_analyze(upper, &common_)) {
      std::copy_n(static_cast<const int*>(factor->Perm), n, order_.begin());
      cholmod_free_factor(&factor, &common_);
    }
    cholmod_free_sparse(&upper, &common_);
  }

  /// The lower triangle in that order, by columns: the one form that CHOLMOD factorises as it stands. Of any other it
  /// makes a permuted copy each time, a tenth of the work where the factor has little fill.
  void build_structure() {
    const BlockPattern& pattern = *pattern_;
    const std::size_t n = order_.size();
    std::vector<int> place(n);
    for (std::size_t k = 0; k < n; ++k) place[std::size_t(order_[k])] = int(k);
    std::size_t count = 0;
    for (int row = 0; row < pattern.rows; ++row)
      count += 9 * std::size_t(pattern.diagonal[row] - pattern.row_start[row]) + 6;
    matrix_ = cholmod_allocate_sparse(n, n, count, true, true, -1, CHOLMOD_REAL, &common_);
    auto* start = static_cast<int*>(matrix_->p);
    auto* index = static_cast<int*>(matrix_->i);
    source_.reserve(count);
    std::vector<std::pair<int, std::uint32_t>> column;  // row in the order, and where its entry comes from
    for (std::size_t k = 0; k < n; ++k) {
      const int node = order_[k] / 3, c = order_[k] % 3;
      column.clear();
      for (int b = pattern.row_start[node]; b < pattern.row_start[node + 1]; ++b) {
        const int* places = place.data() + 3 * std::size_t(pattern.column[b]);
        for (int r = 0; r < 3; ++r)
          if (places[r] >= int(k))
            column.emplace_back(places[r], 9 * std::uint32_t(b) + 3 * std::uint32_t(r) + std::uint32_t(c));  // (c, r)
      }
      std::ranges::sort(column);
      start[k] = int(source_.size());
      for (const auto& [at, from] : column) {
        index[source_.size()] = at;
        source_.push_back(from);
      }
    }
    start[n] = int(source_.size());
  }

  std::shared_ptr<const BlockPattern> pattern_;
  cholmod_common common_{};
  cholmod_sparse* matrix_ = nullptr;
  cholmod_factor* factor_ = nullptr;
  cholmod_dense *solution_ = nullptr, *work_y_ = nullptr, *work_e_ = nullptr;
  std::vector<int> order_;             // unknowns in the order in which they are eliminated
  std::vector<std::uint32_t> source_;  // where each stored entry comes from among the block matrix's values
  MatrixX rhs_;                        // in that order
};

}  // namespace

std::unique_ptr<LinearSolver> make_cholmod_solver(std::shared_ptr<const BlockPattern> pattern) {
  return std::make_unique<CholmodSolver>(std::move(pattern));
}

FactorCounts count_factor(std::shared_ptr<const BlockPattern> pattern) {
  return CholmodSolver(std::move(pattern)).counts();
}

#else

namespace {
[[noreturn]] void refuse() {
  throw std::invalid_argument(
      "this build has no CHOLMOD (PLIANT_WITH_CHOLMOD=OFF); choose `iterative` or `simplicial`");
}
}  // namespace

std::unique_ptr<LinearSolver> make_cholmod_solver(std::shared_ptr<const BlockPattern>) { refuse(); }
FactorCounts count_factor(std::shared_ptr<const BlockPattern>) { refuse(); }

#endif

}  // namespace pliant
