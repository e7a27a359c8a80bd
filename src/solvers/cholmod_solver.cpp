#include "solvers/cholmod_solver.hpp"

#include <stdexcept>

#ifdef PLIANT_WITH_CHOLMOD
#include <cholmod.h>

#include <algorithm>

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
    build_structure();
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
    for (std::size_t k = 0; k < source_.size(); ++k) values[k] = matrix.block(0)[source_[k]];
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
    cholmod_dense rhs{};
    rhs.nrow = rhs.d = std::size_t(B.rows());
    rhs.ncol = std::size_t(B.cols());
    rhs.nzmax = std::size_t(B.size());
    rhs.x = const_cast<double*>(B.data());
    rhs.xtype = CHOLMOD_REAL;
    rhs.dtype = CHOLMOD_DOUBLE;
    const BlasCall blas;
    const bool done =
        cholmod_solve2(CHOLMOD_A, factor_, &rhs, nullptr, &solution_, nullptr, &work_y_, &work_e_, &common_);
    if (done) std::copy_n(static_cast<const double*>(solution_->x), B.size(), x);
    return {done, 0, 0.0};
  }

  /// The upper triangle by columns, which CHOLMOD permutes in one pass (the lower one in two): by symmetry a block
  /// row's blocks on and left of the diagonal, transposed.
  void build_structure() {
    const BlockPattern& pattern = *pattern_;
    std::size_t count = 0;
    for (int row = 0; row < pattern.rows; ++row) {
      const std::size_t left = std::size_t(pattern.diagonal[row] - pattern.row_start[row]);
      count += 9 * left + 6;
    }
    const std::size_t n = 3 * std::size_t(pattern.rows);
    matrix_ = cholmod_allocate_sparse(n, n, count, true, true, 1, CHOLMOD_REAL, &common_);
    auto* start = static_cast<int*>(matrix_->p);
    auto* index = static_cast<int*>(matrix_->i);
    source_.reserve(count);
    int filled = 0;
    for (int row = 0; row < pattern.rows; ++row)
      for (int c = 0; c < 3; ++c) {
        start[3 * row + c] = filled;
        for (int b = pattern.row_start[row]; b <= pattern.diagonal[row]; ++b)
          for (int r = 0; r < 3; ++r) {
            if (pattern.column[b] == row && r > c) continue;
            index[filled++] = 3 * pattern.column[b] + r;
            source_.push_back(9 * std::size_t(b) + 3 * std::size_t(r) + std::size_t(c));  // entry (c, r) of the block
          }
      }
    start[n] = filled;
  }

  std::shared_ptr<const BlockPattern> pattern_;
  cholmod_common common_{};
  cholmod_sparse* matrix_ = nullptr;
  cholmod_factor* factor_ = nullptr;
  cholmod_dense *solution_ = nullptr, *work_y_ = nullptr, *work_e_ = nullptr;
  std::vector<std::size_t> source_;  // where each stored entry comes from among the block matrix's values
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
