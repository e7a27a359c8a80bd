#pragma once

#include <array>

#include "base/parallel.hpp"
#include "solvers/linear_solver.hpp"

namespace pliant {

/// Incomplete Cholesky factor with 3 x 3 blocks and no fill, A ~ L L^T, in single precision: as a preconditioner it
/// loses nothing and its sweeps move half the memory. Of large bodies each part of the rows has a factor of its own,
/// what couples the parts left out, so that several threads share the work; the parts depend on the rows alone.
class IncompleteCholesky {
 public:
  explicit IncompleteCholesky(const BlockPattern& pattern);
  /// Where a pivot is not positive the diagonal is raised, step by step; false where even that does not help.
  [[nodiscard]] bool factorise(const BlockMatrix& matrix);
  /// z = (L L^T)^-1 r, vectors with four entries a node.
  void apply(const std::vector<double>& r, std::vector<double>& z) const;
  /// The same for four vectors at once: number d of a node in vector l is entry 12 node + 4 d + l. Several threads may
  /// do so, each with memory of its own.
  void apply_to_lanes(const std::vector<double>& r, std::vector<double>& z, std::vector<float>& work) const;

 private:
  static constexpr std::size_t rows_of_a_part = 131072;
  [[nodiscard]] bool try_factorise(const BlockMatrix& matrix, double shift);
  [[nodiscard]] bool factorise_rows(const BlockMatrix& matrix, double shift, int first, int last);
  void sweep(const double* r, double* z, int first, int last) const;
  void sweep_lanes(const double* r, double* z, float* work, int first, int last) const;

  struct Product {
    int left, right;  // L_ik and L_jk, k < j < i
  };
  int rows_;
  Parts parts_;
  std::vector<int> row_start_, column_;        // strictly lower blocks
  std::vector<int> source_, source_diagonal_;  // where they are in the matrix
  std::vector<int> product_start_;             // for each lower block, its products
  std::vector<Product> products_;
  std::vector<float> forward_, backward_;  // 9 a block, column by column and row by row
  std::vector<double> inverse_diagonal_;   // inverse of each row's lower triangular pivot, column by column
  mutable std::vector<float> work_;
};

/// Conjugate gradients with that preconditioner.
class IterativeSolver : public LinearSolver {
 public:
  IterativeSolver(std::shared_ptr<const BlockPattern> pattern, const SolverOptions& options);
  [[nodiscard]] bool factorise(const BlockMatrix& matrix) override;
  SolveSummary solve(const VectorX& b, VectorX& x) override;
  /// Four at a time, in the lanes of wide registers: the matrix is read once for them. Fours go beside each other where
  /// the preconditioner allows it, and of large bodies the rows of each are shared out.
  SolveSummary solve_columns(const MatrixX& B, MatrixX& X) override;
  std::string name() const override { return "conjugate gradients, 3x3-block incomplete Cholesky"; }
  std::unique_ptr<LinearSolver> clone() const override;

 protected:
  /// z = P^-1 r, four entries a node.
  virtual void precondition(const std::vector<double>& r, std::vector<double>& z) { preconditioner_.apply(r, z); }
  static constexpr std::size_t lanes = 4;
  /// The same for four vectors, entries as in `IncompleteCholesky::apply_to_lanes`.
  virtual void precondition_lanes(const std::vector<double>& r, std::vector<double>& z, std::vector<float>& work) {
    preconditioner_.apply_to_lanes(r, z, work);
  }
  /// Whether `precondition_lanes` may be called by several threads at a time.
  virtual bool takes_fours_beside_each_other() const { return true; }

  std::shared_ptr<const BlockPattern> pattern_;
  SolverOptions options_;
  IncompleteCholesky preconditioner_;
  const BlockMatrix* matrix_ = nullptr;

 private:
  /// What is at hand of four systems, entries as in `IncompleteCholesky::apply_to_lanes`.
  struct Lanes {
    std::vector<double> b, x, r, z, p, ap;
    std::vector<float> work;  // of the preconditioner
  };
  using Columns = Eigen::Ref<const MatrixX>;
  using Solutions = Eigen::Ref<MatrixX>;
  /// `b` and `x` as `solve` has them.
  SolveSummary solve(const Eigen::Ref<const VectorX>& b, Eigen::Ref<VectorX> x, double tolerance);
  double multiply(const std::vector<double>& p, std::vector<double>& ap) const;
  /// ap = A p for four vectors; their products p . ap.
  std::array<double, lanes> multiply_lanes(const std::vector<double>& p, std::vector<double>& ap) const;
  /// At most four columns; lanes that are left over have nothing to solve.
  SolveSummary solve_lanes(const Columns& B, Solutions X, Lanes& own);
  SolveSummary solve_lanes(Lanes& own);

  Parts parts_;
  std::vector<double> x_, r_, z_, p_, ap_;  // four entries a node
  std::vector<Lanes> lanes_;                // of four columns each; none until needed
  std::vector<SolveSummary> summaries_;     // likewise
};

}  // namespace pliant
