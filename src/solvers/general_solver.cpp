#include "solvers/general_solver.hpp"

#include <Eigen/Jacobi>
#include <cmath>
#include <utility>

namespace pliant {

namespace {
constexpr int most_iterations = 60;
constexpr int most_about_others = 10;  // by LU factors of another matrix: more take about as long as factors anew
}  // namespace

GeneralSolver::GeneralSolver(std::shared_ptr<const BlockPattern> pattern, SolverKind kind)
    : pattern_(std::move(pattern)), matrix_(pattern_), symmetric_(pattern_) {
  constexpr double inner_tolerance = 1e-6;
  factor_ = make_linear_solver(pattern_, stiffness_solver(kind, *pattern_, inner_tolerance));
  for (int row = 0; row < pattern_->rows; ++row)
    for (int b = pattern_->row_start[row]; b < pattern_->row_start[row + 1]; ++b)
      transposed_block_.push_back(pattern_->find(pattern_->column[b], row));
}

void GeneralSolver::take(const BlockMatrix& matrix) {
  matrix_ = matrix;
  for (int b = 0; b < pattern_->block_count(); ++b) {
    const Eigen::Map<const Matrix3> block(matrix.block(b)), mirror(matrix.block(transposed_block_[std::size_t(b)]));
    Eigen::Map<Matrix3>(symmetric_.block(b)) = 0.5 * (block + mirror.transpose());
  }
}

bool GeneralSolver::factorise(const BlockMatrix& matrix, const BlockMatrix& substitute) {
  take(matrix);
  has_substitute_ = true;
  goes_by_lu_ = false;
  is_definite_ = factor_->factorise(symmetric_);
  return is_definite_ || factor_->factorise(substitute);
}

bool GeneralSolver::factorise(const BlockMatrix& matrix, Lu lu) {
  take(matrix);
  has_substitute_ = false;
  if (!goes_by_lu_ || lu == Lu::Own) return factorise_itself();
  lu_is_own_ = false;
  return true;
}

bool GeneralSolver::factorise_itself() {
  goes_by_lu_ = false;
  is_definite_ = factor_->factorise(symmetric_);
  return is_definite_ || factorise_by_lu();
}

bool GeneralSolver::factorise_by_lu() {
  if (!lu_) lu_ = std::make_unique<LuSolver>(pattern_);
  return goes_by_lu_ = lu_is_own_ = lu_->factorise(matrix_);
}

void GeneralSolver::transpose() {
  for (int b = 0; b < pattern_->block_count(); ++b) {
    const int mirror = transposed_block_[std::size_t(b)];
    if (mirror < b) continue;
    const Matrix3 one = Eigen::Map<const Matrix3>(matrix_.block(b)),
                  other = Eigen::Map<const Matrix3>(matrix_.block(mirror));
    Eigen::Map<Matrix3>(matrix_.block(b)) = other.transpose();
    Eigen::Map<Matrix3>(matrix_.block(mirror)) = one.transpose();
  }
}

void GeneralSolver::precondition(const VectorX& b, VectorX& x) const {
  x.setZero(b.size());
  factor_->solve(b, x);
}

SolveSummary GeneralSolver::solve(const VectorX& b, VectorX& x, double tolerance, Side side) {
  if (goes_by_lu_ && lu_is_own_) {
    x = side == Side::Plain ? lu_->solve(b) : lu_->solve_transposed(b);
    return {x.allFinite(), 0, 0.0};
  }
  const SolveSummary summary = iterate(b, x, tolerance, side);
  if (summary.converged || has_substitute_) return summary;
  const bool is_factorised = goes_by_lu_ ? factorise_itself() : factorise_by_lu();
  return is_factorised ? solve(b, x, tolerance, side) : summary;
}

SolveSummary GeneralSolver::iterate(const VectorX& b, VectorX& x, double tolerance, Side side) {
  const Eigen::Index n = b.size();
  const int most = goes_by_lu_ ? most_about_others : most_iterations;
  x.setZero(n);
  const double scale = b.norm();
  if (!(scale > 0.0)) return {scale == 0.0, 0, 0.0};
  if (side == Side::Transposed) transpose();  // for the while

  basis_.resize(n, most + 1);
  preconditioned_.resize(n, most);
  MatrixX R = MatrixX::Zero(most + 1, most);
  VectorX residual = VectorX::Zero(most + 1);
  std::vector<Eigen::JacobiRotation<double>> rotations;
  basis_.col(0) = b / scale;
  residual[0] = scale;
  SolveSummary summary;
  int k = 0;
  while (k < most && std::abs(residual[k]) > tolerance * scale) {
    if (goes_by_lu_) {
      guess_ = side == Side::Plain ? lu_->solve(basis_.col(k), LuSolver::Refined::No)
                                   : lu_->solve_transposed(basis_.col(k), LuSolver::Refined::No);
    } else {
      guess_.setZero(n);
      factor_->solve(basis_.col(k), guess_);
    }
    preconditioned_.col(k) = guess_;
    matrix_.multiply(guess_, product_);
    for (int pass = 0; pass < 2; ++pass)  // orthogonalised twice: once loses digits
      for (int i = 0; i <= k; ++i) {
        const double share = basis_.col(i).dot(product_);
        R(i, k) += share;
        product_ -= share * basis_.col(i);
      }
    const double left = product_.norm();
    R(k + 1, k) = left;
    for (int i = 0; i < k; ++i) R.col(k).applyOnTheLeft(i, i + 1, rotations[std::size_t(i)].adjoint());
    rotations.emplace_back();
    rotations.back().makeGivens(R(k, k), R(k + 1, k));
    R.col(k).applyOnTheLeft(k, k + 1, rotations.back().adjoint());
    residual.applyOnTheLeft(k, k + 1, rotations.back().adjoint());
    if (left > 0.0) basis_.col(k + 1) = product_ / left;
    ++k;
    if (left == 0.0) break;
  }
  if (side == Side::Transposed) transpose();
  summary.iterations = k;
  summary.residual = std::abs(residual[k]) / scale;
  if (k > 0) {
    const VectorX y = R.topLeftCorner(k, k).triangularView<Eigen::Upper>().solve(residual.head(k));
    x.noalias() = preconditioned_.leftCols(k) * y;
  }
  summary.converged = summary.residual <= tolerance && x.allFinite();
  return summary;
}

}  // namespace pliant
