#include "solvers/incomplete_cholesky.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>

#include "base/parallel.hpp"
#include "solvers/wide.hpp"

namespace pliant {

namespace {
using Block = Eigen::Map<Matrix3>;
}  // namespace

IncompleteCholesky::IncompleteCholesky(const BlockPattern& pattern)
    : rows_(pattern.rows), parts_(std::size_t(rows_), rows_of_a_part) {
  row_start_.push_back(0);
  product_start_.push_back(0);
  std::vector<int> position(rows_, -1);  // of column k in the row at hand
  for (int i = 0; i < rows_; ++i) {
    const int first = int(column_.size()), first_of_part = int(std::size_t(i) / parts_.size * parts_.size);
    for (int b = pattern.row_start[i]; b < pattern.diagonal[i]; ++b) {
      const int j = pattern.column[b];
      if (j < first_of_part) continue;
      for (int l = row_start_[j]; l < row_start_[j + 1]; ++l)
        if (position[column_[l]] >= 0) products_.push_back({position[column_[l]], l});
      position[j] = int(column_.size());
      column_.push_back(j);
      source_.push_back(b);
      product_start_.push_back(int(products_.size()));
    }
    for (int l = first; l < int(column_.size()); ++l) position[column_[l]] = -1;
    source_diagonal_.push_back(pattern.diagonal[i]);
    row_start_.push_back(int(column_.size()));
  }
  forward_.resize(9 * column_.size() + 3);
  backward_.resize(9 * column_.size() + 3);
  inverse_diagonal_.resize(9 * std::size_t(rows_));
  work_.resize(4 * std::size_t(rows_));
}

bool IncompleteCholesky::factorise(const BlockMatrix& matrix) {
  for (double shift = 0.0; shift < 1.0; shift = shift == 0.0 ? 1e-3 : 4.0 * shift)
    if (try_factorise(matrix, shift)) return true;
  return false;
}

bool IncompleteCholesky::try_factorise(const BlockMatrix& matrix, double shift) {
  std::atomic<bool> done = true;
  for_parts(parts_, [&](std::size_t first, std::size_t last) {
    if (!factorise_rows(matrix, shift, int(first), int(last))) done = false;
  });
  return done;
}

namespace {

/// The columns of a block (3 x 3, column by column), a wide number each. Nothing beyond the block is read.
template <class Real>
inline void load_block(const Real* block, Wide<double>* columns) {
  const Wide<Real> last = load_wide(block + 5);
  columns[0] = __builtin_convertvector(load_wide(block), Wide<double>);
  columns[1] = __builtin_convertvector(load_wide(block + 3), Wide<double>);
  columns[2] = Wide<double>{last[1], last[2], last[3], 0.0};
}

/// sum -= x y^T; `y` entry by entry, column by column.
template <class Entry>
inline void subtract_product(const Wide<double>* x, const Entry& y, Wide<double>* sum) {
  for (int c = 0; c < 3; ++c) sum[c] -= x[0] * y(c, 0) + x[1] * y(c, 1) + x[2] * y(c, 2);
}

}  // namespace

bool IncompleteCholesky::factorise_rows(const BlockMatrix& matrix, double shift, int first, int last) {
  for (int i = first; i < last; ++i) {
    Wide<double> pivots[3];
    load_block(matrix.block(source_diagonal_[i]), pivots);
    for (int d = 0; d < 3; ++d) pivots[d][d] *= 1.0 + shift;
    for (int l = row_start_[i]; l < row_start_[i + 1]; ++l) {
      Wide<double> sum[3], left[3];
      load_block(matrix.block(source_[l]), sum);
      for (int p = product_start_[l]; p < product_start_[l + 1]; ++p) {
        load_block(&forward_[9 * std::size_t(products_[p].left)], left);
        const float* right = &forward_[9 * std::size_t(products_[p].right)];
        subtract_product(
            left, [&](int c, int k) { return double(right[3 * k + c]); }, sum);
      }
      const double* inverse = &inverse_diagonal_[9 * std::size_t(column_[l])];
      const Wide<double> lower[3] = {sum[0] * inverse[0], sum[0] * inverse[1] + sum[1] * inverse[4],
                                     sum[0] * inverse[2] + sum[1] * inverse[5] + sum[2] * inverse[8]};
      float *forward = &forward_[9 * std::size_t(l)], *backward = &backward_[9 * std::size_t(l)];
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) forward[3 * c + r] = backward[3 * r + c] = float(lower[c][r]);
      subtract_product(
          lower, [&](int c, int k) { return lower[k][c]; }, pivots);
    }
    Matrix3 pivot;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) pivot(r, c) = pivots[c][r];
    const double scale = pivot.trace();
    const double l00 = pivot(0, 0);
    if (!(l00 > 1e-12 * scale)) return false;
    const double a = std::sqrt(l00), b = pivot(1, 0) / a, c = pivot(2, 0) / a;
    const double l11 = pivot(1, 1) - b * b;
    if (!(l11 > 1e-12 * scale)) return false;
    const double d = std::sqrt(l11), e = (pivot(2, 1) - b * c) / d;
    const double l22 = pivot(2, 2) - c * c - e * e;
    if (!(l22 > 1e-12 * scale)) return false;
    const double f = std::sqrt(l22);
    Block inverse(&inverse_diagonal_[9 * std::size_t(i)]);
    inverse << 1 / a, 0, 0, -b / (a * d), 1 / d, 0, (b * e - c * d) / (a * d * f), -e / (d * f), 1 / f;
  }
  return true;
}

void IncompleteCholesky::apply(const std::vector<double>& r, std::vector<double>& z) const {
  for_parts(parts_, [&](std::size_t first, std::size_t last) { sweep(r.data(), z.data(), int(first), int(last)); });
}

void IncompleteCholesky::sweep(const double* r, double* z, int first, int last) const {
  float* w = work_.data();
  for (int i = first; i < last; ++i) {
    const double* ri = &r[4 * std::size_t(i)];
    Wide<float> sum = {float(ri[0]), float(ri[1]), float(ri[2]), 0.0f};
    for (int l = row_start_[i]; l < row_start_[i + 1]; ++l) {
      const float* v = &w[4 * std::size_t(column_[l])];
      sum -= block_times(&forward_[9 * std::size_t(l)], v[0], v[1], v[2]);
    }
    const double* inv = &inverse_diagonal_[9 * std::size_t(i)];
    float* wi = &w[4 * std::size_t(i)];
    wi[0] = float(inv[0]) * sum[0];
    wi[1] = float(inv[1]) * sum[0] + float(inv[4]) * sum[1];
    wi[2] = float(inv[2]) * sum[0] + float(inv[5]) * sum[1] + float(inv[8]) * sum[2];
  }
  for (int i = last - 1; i >= first; --i) {
    const double* inv = &inverse_diagonal_[9 * std::size_t(i)];
    float* wi = &w[4 * std::size_t(i)];
    const float x0 = float(inv[0]) * wi[0] + float(inv[1]) * wi[1] + float(inv[2]) * wi[2];
    const float x1 = float(inv[4]) * wi[1] + float(inv[5]) * wi[2];
    const float x2 = float(inv[8]) * wi[2];
    for (int l = row_start_[i]; l < row_start_[i + 1]; ++l) {
      float* v = &w[4 * std::size_t(column_[l])];
      store_wide(v, load_wide(v) - block_times(&backward_[9 * std::size_t(l)], x0, x1, x2));
    }
    double* zi = &z[4 * std::size_t(i)];
    zi[0] = x0, zi[1] = x1, zi[2] = x2, zi[3] = 0.0;
  }
}

namespace {

/// Sum over j of column j of a block (3 x 3, column by column) times a wide number each: entry d of the product in
/// sum[d][0] + sum[d][1] + sum[d][2], which do not wait for each other.
template <class Real>
using LaneSums = Wide<Real>[3][3];

template <class Real>
inline void add_block_times(const Real* block, const Wide<Real>* v, LaneSums<Real>& sum) {
  for (int d = 0; d < 3; ++d)
    for (int j = 0; j < 3; ++j) sum[d][j] += block[3 * j + d] * v[j];
}

template <class Real>
inline Wide<Real> total(const LaneSums<Real>& sum, int d) {
  return sum[d][0] + sum[d][1] + sum[d][2];
}

template <class Real>
inline void load_lanes(const Real* p, Wide<Real>* v) {
  for (int d = 0; d < 3; ++d) v[d] = load_wide(p + 4 * d);
}

inline Wide<float> narrow(Wide<double> w) { return __builtin_convertvector(w, Wide<float>); }
inline Wide<double> widen(Wide<float> w) { return __builtin_convertvector(w, Wide<double>); }

}  // namespace

void IncompleteCholesky::apply_to_lanes(const std::vector<double>& r, std::vector<double>& z,
                                        std::vector<float>& work) const {
  work.resize(12 * std::size_t(rows_));
  for_parts(parts_, [&](std::size_t first, std::size_t last) {
    sweep_lanes(r.data(), z.data(), work.data(), int(first), int(last));
  });
}

void IncompleteCholesky::sweep_lanes(const double* r, double* z, float* w, int first, int last) const {
  for (int i = first; i < last; ++i) {
    LaneSums<float> sum{};
    for (int l = row_start_[i]; l < row_start_[i + 1]; ++l) {
      Wide<float> v[3];
      load_lanes(&w[12 * std::size_t(column_[l])], v);
      add_block_times(&forward_[9 * std::size_t(l)], v, sum);
    }
    const double* inv = &inverse_diagonal_[9 * std::size_t(i)];
    Wide<float> left[3];
    for (int d = 0; d < 3; ++d) left[d] = narrow(load_wide(&r[12 * std::size_t(i) + 4 * d])) - total<float>(sum, d);
    float* wi = &w[12 * std::size_t(i)];
    store_wide(wi, float(inv[0]) * left[0]);
    store_wide(wi + 4, float(inv[1]) * left[0] + float(inv[4]) * left[1]);
    store_wide(wi + 8, float(inv[2]) * left[0] + float(inv[5]) * left[1] + float(inv[8]) * left[2]);
  }
  for (int i = last - 1; i >= first; --i) {
    const double* inv = &inverse_diagonal_[9 * std::size_t(i)];
    Wide<float> own[3];
    load_lanes(&w[12 * std::size_t(i)], own);
    const Wide<float> x[3] = {float(inv[0]) * own[0] + float(inv[1]) * own[1] + float(inv[2]) * own[2],
                              float(inv[4]) * own[1] + float(inv[5]) * own[2], float(inv[8]) * own[2]};
    for (int l = row_start_[i]; l < row_start_[i + 1]; ++l) {
      float* v = &w[12 * std::size_t(column_[l])];
      const float* block = &backward_[9 * std::size_t(l)];
      for (int d = 0; d < 3; ++d)
        store_wide(v + 4 * d, load_wide(v + 4 * d) - (block[d] * x[0] + block[3 + d] * x[1] + block[6 + d] * x[2]));
    }
    for (int d = 0; d < 3; ++d) store_wide(&z[12 * std::size_t(i) + 4 * d], widen(x[d]));
  }
}

IterativeSolver::IterativeSolver(std::shared_ptr<const BlockPattern> pattern, const SolverOptions& options)
    : pattern_(std::move(pattern)), options_(options), preconditioner_(*pattern_), parts_(std::size_t(pattern_->rows)) {
  if (options_.derivative_tolerance <= 0.0) options_.derivative_tolerance = options_.tolerance;
  const std::size_t size = 4 * std::size_t(pattern_->rows);
  for (auto* v : {&x_, &r_, &z_, &p_, &ap_}) v->assign(size, 0.0);
}

std::unique_ptr<LinearSolver> IterativeSolver::clone() const {
  return std::make_unique<IterativeSolver>(pattern_, options_);
}

bool IterativeSolver::factorise(const BlockMatrix& matrix) {
  matrix_ = &matrix;
  return preconditioner_.factorise(matrix);
}

/// ap = A p; returns p . ap.
double IterativeSolver::multiply(const std::vector<double>& p, std::vector<double>& ap) const {
  const BlockPattern& pattern = *pattern_;
  const int* column = pattern.column.data();
  return sum_parts(parts_, [&](std::size_t first, std::size_t last) {
    double dot = 0.0;
    for (std::size_t row = first; row < last; ++row) {
      Wide<double> sum{};
      for (int b = pattern.row_start[row]; b < pattern.row_start[row + 1]; ++b) {
        const double* v = &p[4 * std::size_t(column[b])];
        sum += block_times(matrix_->block(b), v[0], v[1], v[2]);
      }
      sum[3] = 0.0;
      store_wide(&ap[4 * row], sum);
      const double* pr = &p[4 * row];
      dot += pr[0] * sum[0] + pr[1] * sum[1] + pr[2] * sum[2];
    }
    return dot;
  });
}

SolveSummary IterativeSolver::solve(const VectorX& b, VectorX& x) { return solve(b, x, options_.tolerance); }

SolveSummary IterativeSolver::solve(const Eigen::Ref<const VectorX>& b, Eigen::Ref<VectorX> x, double tolerance) {
  const int n = pattern_->rows;
  for (int i = 0; i < n; ++i)
    for (int d = 0; d < 3; ++d) x_[4 * std::size_t(i) + d] = x[3 * Eigen::Index(i) + d];
  multiply(x_, ap_);
  double b_norm = 0.0, r_norm = 0.0;
  for (int i = 0; i < n; ++i)
    for (int d = 0; d < 3; ++d) {
      const double bi = b[3 * Eigen::Index(i) + d];
      const double ri = bi - ap_[4 * std::size_t(i) + d];
      r_[4 * std::size_t(i) + d] = ri;
      b_norm += bi * bi, r_norm += ri * ri;
    }
  SolveSummary summary;
  const double target = tolerance * tolerance * b_norm;
  double rz = 0.0;
  for (;; ++summary.iterations) {
    summary.converged = r_norm <= target;
    if (summary.converged || summary.iterations >= options_.max_iterations || !std::isfinite(r_norm)) break;
    precondition(r_, z_);
    const double rz_new = sum_parts(parts_, [&](std::size_t first, std::size_t last) {
      double sum = 0.0;
      for (std::size_t i = 4 * first; i < 4 * last; ++i) sum += r_[i] * z_[i];
      return sum;
    });
    const double beta = summary.iterations == 0 ? 0.0 : rz_new / rz;
    rz = rz_new;
    for_parts(parts_, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = 4 * first; i < 4 * last; ++i) p_[i] = z_[i] + beta * p_[i];
    });
    const double curvature = multiply(p_, ap_);
    if (!(curvature > 0.0)) break;
    const double alpha = rz / curvature;
    r_norm = sum_parts(parts_, [&](std::size_t first, std::size_t last) {
      double sum = 0.0;
      for (std::size_t i = 4 * first; i < 4 * last; ++i) {
        x_[i] += alpha * p_[i];
        r_[i] -= alpha * ap_[i];
        sum += r_[i] * r_[i];
      }
      return sum;
    });
  }
  summary.residual = b_norm > 0.0 ? std::sqrt(r_norm / b_norm) : 0.0;
  for (int i = 0; i < n; ++i)
    for (int d = 0; d < 3; ++d) x[3 * Eigen::Index(i) + d] = x_[4 * std::size_t(i) + d];
  return summary;
}

namespace {

/// Sum of body(begin, end), a number a lane, over the parts, taken in order.
template <class Body>
Wide<double> sum_lanes(const Parts& parts, const Body& body) {
  if (parts.parts() == 1) return body(std::size_t(0), parts.count);
  std::array<Wide<double>, Parts::most> sums;
  for_parts(parts, [&](std::size_t first, std::size_t last) { sums[first / parts.size] = body(first, last); });
  Wide<double> sum{};
  for (std::size_t i = 0; i < parts.parts(); ++i) sum += sums[i];
  return sum;
}

}  // namespace

auto IterativeSolver::multiply_lanes(const std::vector<double>& p, std::vector<double>& ap) const
    -> std::array<double, lanes> {
  const int *const column = pattern_->column.data(), *const row_start = pattern_->row_start.data();
  const double* const from = p.data();
  double* const to = ap.data();
  const BlockMatrix& matrix = *matrix_;
  const Wide<double> dot = sum_lanes(parts_, [=, &matrix](std::size_t first, std::size_t last) {
    Wide<double> part{};
    for (std::size_t row = first; row < last; ++row) {
      LaneSums<double> sum{};
      for (int b = row_start[row]; b < row_start[row + 1]; ++b) {
        Wide<double> v[3];
        load_lanes(&from[12 * std::size_t(column[b])], v);
        add_block_times(matrix.block(b), v, sum);
      }
      for (std::size_t d = 0; d < 3; ++d) {
        const Wide<double> product = total<double>(sum, int(d));
        store_wide(&to[12 * row + 4 * d], product);
        part += load_wide(&from[12 * row + 4 * d]) * product;
      }
    }
    return part;
  });
  return {dot[0], dot[1], dot[2], dot[3]};
}

SolveSummary IterativeSolver::solve_lanes(Lanes& own) {
  const double* const b = own.b.data();
  double *const x = own.x.data(), *const r = own.r.data(), *const z = own.z.data(), *const p = own.p.data(),
                *const ap = own.ap.data();
  multiply_lanes(own.x, own.ap);
  constexpr std::size_t of_a_row = 3 * lanes;
  const auto squares = [&](const double* v) {
    return sum_lanes(parts_, [=](std::size_t first, std::size_t last) {
      Wide<double> sum{};
      for (std::size_t i = of_a_row * first; i < of_a_row * last; i += lanes)
        sum += load_wide(&v[i]) * load_wide(&v[i]);
      return sum;
    });
  };
  for_parts(parts_, [=](std::size_t first, std::size_t last) {
    for (std::size_t i = of_a_row * first; i < of_a_row * last; ++i) r[i] = b[i] - ap[i];
  });
  const Wide<double> b_norm = squares(b);
  Wide<double> r_norm = squares(r);
  SolveSummary summary;
  const double squared = options_.derivative_tolerance * options_.derivative_tolerance;
  std::array<bool, lanes> goes_on{};
  Wide<double> rz{};
  for (;; ++summary.iterations) {
    bool any = false;
    for (std::size_t l = 0; l < lanes; ++l) {  // those that are done stay where they are
      const bool is_left = r_norm[l] > squared * b_norm[l] && std::isfinite(r_norm[l]);
      goes_on[l] = is_left && (summary.iterations == 0 || goes_on[l]);
      any = any || goes_on[l];
    }
    if (!any || summary.iterations >= options_.max_iterations) break;
    precondition_lanes(own.r, own.z, own.work);
    const Wide<double> rz_new = sum_lanes(parts_, [=](std::size_t first, std::size_t last) {
      Wide<double> sum{};
      for (std::size_t i = of_a_row * first; i < of_a_row * last; i += lanes)
        sum += load_wide(&r[i]) * load_wide(&z[i]);
      return sum;
    });
    Wide<double> alpha{}, beta{};
    for (std::size_t l = 0; l < lanes && summary.iterations > 0; ++l) beta[l] = goes_on[l] ? rz_new[l] / rz[l] : 0.0;
    rz = rz_new;
    for_parts(parts_, [=](std::size_t first, std::size_t last) {
      for (std::size_t i = of_a_row * first; i < of_a_row * last; i += lanes)
        store_wide(&p[i], load_wide(&z[i]) + beta * load_wide(&p[i]));
    });
    const std::array<double, lanes> curvature = multiply_lanes(own.p, own.ap);
    for (std::size_t l = 0; l < lanes; ++l) {
      goes_on[l] = goes_on[l] && curvature[l] > 0.0;
      alpha[l] = goes_on[l] ? rz[l] / curvature[l] : 0.0;
    }
    r_norm = sum_lanes(parts_, [=](std::size_t first, std::size_t last) {
      Wide<double> sum{};
      for (std::size_t i = of_a_row * first; i < of_a_row * last; i += lanes) {
        store_wide(&x[i], load_wide(&x[i]) + alpha * load_wide(&p[i]));
        const Wide<double> ri = load_wide(&r[i]) - alpha * load_wide(&ap[i]);
        store_wide(&r[i], ri);
        sum += ri * ri;
      }
      return sum;
    });
  }
  summary.converged = true;
  for (std::size_t l = 0; l < lanes; ++l) {
    summary.converged = summary.converged && r_norm[l] <= squared * b_norm[l];
    if (b_norm[l] > 0.0) summary.residual = std::max(summary.residual, std::sqrt(r_norm[l] / b_norm[l]));
  }
  return summary;
}

SolveSummary IterativeSolver::solve_lanes(const Columns& B, Solutions X, Lanes& own) {
  const std::size_t size = lanes * std::size_t(B.rows());
  for (auto* v : {&own.b, &own.x, &own.r, &own.z, &own.ap}) v->resize(size);
  own.p.assign(size, 0.0);
  for (Eigen::Index i = 0; i < B.rows(); ++i)
    for (std::size_t l = 0; l < lanes; ++l) {
      const bool is_there = Eigen::Index(l) < B.cols();
      own.b[lanes * std::size_t(i) + l] = is_there ? B(i, Eigen::Index(l)) : 0.0;
      own.x[lanes * std::size_t(i) + l] = is_there ? X(i, Eigen::Index(l)) : 0.0;
    }
  const SolveSummary summary = solve_lanes(own);
  for (Eigen::Index i = 0; i < B.rows(); ++i)
    for (Eigen::Index l = 0; l < B.cols(); ++l) X(i, l) = own.x[lanes * std::size_t(i) + std::size_t(l)];
  return summary;
}

SolveSummary IterativeSolver::solve_columns(const MatrixX& B, MatrixX& X) {
  const std::size_t columns = std::size_t(B.cols()), count = (columns + lanes - 1) / lanes;
  if (lanes_.size() < count) lanes_.resize(count);
  summaries_.assign(count, {});
  const auto solve_some = [&](std::size_t i) {
    const auto first = Eigen::Index(i * lanes), some = Eigen::Index(std::min(lanes, columns - i * lanes));
    if (some == 1)  // at most one of them all: it has the memory of single systems for itself
      summaries_[i] = solve(B.col(first), X.col(first), options_.derivative_tolerance);
    else
      summaries_[i] = solve_lanes(B.middleCols(first, some), X.middleCols(first, some), lanes_[i]);
  };
  if (takes_fours_beside_each_other())
    parallel_tasks(count, std::cref(solve_some));
  else
    for (std::size_t i = 0; i < count; ++i) solve_some(i);
  SolveSummary all{true, 0, 0.0};
  for (const SolveSummary& one : summaries_)
    all = {all.converged && one.converged, all.iterations + one.iterations, std::max(all.residual, one.residual)};
  return all;
}

}  // namespace pliant
