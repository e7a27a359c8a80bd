// What members that share a mesh gain in the lanes of wide registers: four or eight matrices of one pattern, the copy
// index fastest, against the program's own solver one by one. Preconditioner and conjugate gradients are those of
// `IterativeSolver` (single-precision incomplete Cholesky of 3 x 3 blocks, the same order of operations in each
// lane), so that a member's solution is the same to the last bit where its iterations are as many; members that have
// converged stay as they are while others go on.

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>

#include "elasticity/corotated.hpp"
#include "solvers/incomplete_cholesky.hpp"
#include "support/bodies.hpp"

namespace pliant {
namespace {

template <class Real, int width>
struct LanesOf {
  typedef Real type __attribute__((vector_size(sizeof(Real) * width)));
};

/// Conjugate gradients of `width` systems with one pattern. An entry of a matrix or vector is a number a member.
template <int width>
class LaneSolver {
 public:
  using Lanes = typename LanesOf<double, width>::type;
  using Narrow = typename LanesOf<float, width>::type;

  explicit LaneSolver(const BlockPattern& pattern) : pattern_(pattern), rows_(pattern.rows) {
    std::vector<int> position(std::size_t(rows_), -1);
    for (int i = 0; i < rows_; ++i) {
      for (int k = pattern.row_start[i]; k < pattern.diagonal[i]; ++k) {
        const int j = pattern.column[k];
        for (int l = row_start_[j]; l < row_start_[j + 1]; ++l)
          if (position[column_[l]] >= 0) products_.push_back({position[column_[l]], l});
        position[j] = int(column_.size());
        column_.push_back(j), source_.push_back(k);
        product_start_.push_back(int(products_.size()));
      }
      for (int l = row_start_[i]; l < int(column_.size()); ++l) position[column_[l]] = -1;
      row_start_.push_back(int(column_.size()));
    }
    matrix.resize(9 * pattern.column.size());
    lower_.resize(9 * column_.size());
    for (auto* v : {&b, &x, &r_, &z_, &p_, &ap_}) v->resize(3 * std::size_t(rows_));
    work_.resize(3 * std::size_t(rows_));
    inverse_.resize(9 * std::size_t(rows_)), narrow_inverse_.resize(9 * std::size_t(rows_));
  }

  std::vector<Lanes> matrix;  ///< 9 a block, column by column
  std::vector<Lanes> b, x;    ///< 3 a node

  void factorise() {
    for (int i = 0; i < rows_; ++i) {
      Lanes pivot[9];
      for (int k = 0; k < 9; ++k) pivot[k] = matrix[9 * std::size_t(pattern_.diagonal[i]) + k];
      for (int l = row_start_[i]; l < row_start_[i + 1]; ++l) {
        Lanes sum[9], block[9];
        for (int k = 0; k < 9; ++k) sum[k] = matrix[9 * std::size_t(source_[l]) + k];
        for (int p = product_start_[l]; p < product_start_[l + 1]; ++p) {
          const Narrow *left = &lower_[9 * std::size_t(products_[p][0])],
                       *right = &lower_[9 * std::size_t(products_[p][1])];
          for (int c = 0; c < 3; ++c)
            for (int a = 0; a < 3; ++a)
              for (int k = 0; k < 3; ++k) sum[3 * c + a] -= wide(left[3 * k + a]) * wide(right[3 * k + c]);
        }
        const Lanes* inverse = &inverse_[9 * std::size_t(column_[l])];
        for (int c = 0; c < 3; ++c)
          for (int a = 0; a < 3; ++a) {
            Lanes entry = sum[a] * inverse[c];
            for (int k = 1; k <= c; ++k) entry += sum[3 * k + a] * inverse[3 * k + c];
            block[3 * c + a] = entry;
            lower_[9 * std::size_t(l) + 3 * c + a] = __builtin_convertvector(entry, Narrow);
          }
        for (int c = 0; c < 3; ++c)
          for (int a = c; a < 3; ++a)
            for (int k = 0; k < 3; ++k) pivot[3 * c + a] -= block[3 * k + a] * block[3 * k + c];
      }
      const Lanes a = root(pivot[0]), d10 = pivot[1] / a, d20 = pivot[2] / a, d = root(pivot[4] - d10 * d10),
                  d21 = (pivot[5] - d10 * d20) / d, f = root(pivot[8] - d20 * d20 - d21 * d21);
      const Lanes inverse[9] = {1.0 / a, -d10 / (a * d), (d10 * d21 - d20 * d) / (a * d * f),
                                Lanes{}, 1.0 / d,        -d21 / (d * f),
                                Lanes{}, Lanes{},        1.0 / f};
      for (int k = 0; k < 9; ++k) {
        inverse_[9 * std::size_t(i) + k] = inverse[k];
        narrow_inverse_[9 * std::size_t(i) + k] = __builtin_convertvector(inverse[k], Narrow);
      }
    }
  }

  /// From zero, until the last member's residual is small enough.
  int solve(double tolerance) {
    Lanes b_norm{}, r_norm{}, rz{};
    for (std::size_t i = 0; i < b.size(); ++i) x[i] = p_[i] = Lanes{}, r_[i] = b[i], b_norm += b[i] * b[i];
    r_norm = b_norm;
    std::array<bool, width> goes_on;
    goes_on.fill(true);
    for (int iterations = 0;; ++iterations) {
      bool any = false;
      for (std::size_t l = 0; l < width; ++l) {
        goes_on[l] = goes_on[l] && r_norm[l] > tolerance * tolerance * b_norm[l];
        any = any || goes_on[l];
      }
      if (!any) return iterations;
      precondition();
      Lanes rz_new{}, alpha{}, beta{};
      for (std::size_t i = 0; i < b.size(); ++i) rz_new += r_[i] * z_[i];
      for (std::size_t l = 0; l < width && iterations > 0; ++l) beta[l] = goes_on[l] ? rz_new[l] / rz[l] : 0.0;
      rz = rz_new;
      for (std::size_t i = 0; i < b.size(); ++i) p_[i] = z_[i] + beta * p_[i];
      const Lanes curvature = multiply();
      for (std::size_t l = 0; l < width; ++l) alpha[l] = goes_on[l] ? rz[l] / curvature[l] : 0.0;
      r_norm = Lanes{};
      for (std::size_t i = 0; i < b.size(); ++i)
        x[i] += alpha * p_[i], r_[i] -= alpha * ap_[i], r_norm += r_[i] * r_[i];
    }
  }

 private:
  static Lanes wide(Narrow v) { return __builtin_convertvector(v, Lanes); }
  static Lanes root(Lanes v) {
    for (int l = 0; l < width; ++l) v[l] = std::sqrt(v[l]);
    return v;
  }
  template <class Number>
  static void subtract(const Number* block, const Number* v, Number* from) {
    for (int d = 0; d < 3; ++d) from[d] -= block[d] * v[0] + block[3 + d] * v[1] + block[6 + d] * v[2];
  }

  void precondition() {
    Narrow* w = work_.data();
    for (int i = 0; i < rows_; ++i) {
      Narrow sum[3];
      for (int d = 0; d < 3; ++d) sum[d] = __builtin_convertvector(r_[3 * std::size_t(i) + d], Narrow);
      for (int l = row_start_[i]; l < row_start_[i + 1]; ++l)
        subtract(&lower_[9 * std::size_t(l)], &w[3 * std::size_t(column_[l])], sum);
      const Narrow* inverse = &narrow_inverse_[9 * std::size_t(i)];
      Narrow* wi = &w[3 * std::size_t(i)];
      wi[0] = inverse[0] * sum[0];
      wi[1] = inverse[1] * sum[0] + inverse[4] * sum[1];
      wi[2] = inverse[2] * sum[0] + inverse[5] * sum[1] + inverse[8] * sum[2];
    }
    for (int i = rows_ - 1; i >= 0; --i) {
      const Narrow *inverse = &narrow_inverse_[9 * std::size_t(i)], *wi = &w[3 * std::size_t(i)];
      const Narrow v[3] = {inverse[0] * wi[0] + inverse[1] * wi[1] + inverse[2] * wi[2],
                           inverse[4] * wi[1] + inverse[5] * wi[2], inverse[8] * wi[2]};
      for (int l = row_start_[i]; l < row_start_[i + 1]; ++l) {
        const Narrow* m = &lower_[9 * std::size_t(l)];
        const Narrow transposed[9] = {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]};
        subtract(transposed, v, &w[3 * std::size_t(column_[l])]);
      }
      for (int d = 0; d < 3; ++d) z_[3 * std::size_t(i) + d] = wide(v[d]);
    }
  }

  /// ap = A p; p . ap.
  Lanes multiply() {
    Lanes dot{};
    for (int i = 0; i < rows_; ++i) {
      Lanes sum[3]{};
      for (int k = pattern_.row_start[i]; k < pattern_.row_start[i + 1]; ++k) {
        const Lanes *m = &matrix[9 * std::size_t(k)], *v = &p_[3 * std::size_t(pattern_.column[k])];
        for (int d = 0; d < 3; ++d) sum[d] += m[d] * v[0] + m[3 + d] * v[1] + m[6 + d] * v[2];
      }
      for (int d = 0; d < 3; ++d) {
        ap_[3 * std::size_t(i) + d] = sum[d];
        dot += p_[3 * std::size_t(i) + d] * sum[d];
      }
    }
    return dot;
  }

  const BlockPattern& pattern_;
  int rows_;
  std::vector<int> row_start_{0}, column_, source_, product_start_{0};
  std::vector<std::array<int, 2>> products_;
  std::vector<Narrow> lower_, work_, narrow_inverse_;
  std::vector<Lanes> inverse_, r_, z_, p_, ap_;
};

/// Stiffness and mass of a bent body, as in a time step, of a member with a modulus of its own.
BlockMatrix member_matrix(const Body& body, Elasticity& elasticity, double stiffness, double mass) {
  BlockMatrix A(body.pattern);
  elasticity.add_matrix(stiffness, A);
  for (std::size_t k = 0; k < body.mass.size(); ++k)
    for (int d = 0; d < 3; ++d) A.block(int(k))[4 * d] += mass * body.mass[k];
  return A;
}

template <int width>
struct Members {
  std::vector<BlockMatrix> matrices;
  VectorX b;

  Members(const std::shared_ptr<const Body>& body, double mass) {
    const MotionLayout layout;
    const auto elasticity = make_elasticity(body, layout);
    VectorX theta = layout.zero();
    layout.set_moduli(theta, 1.0);
    theta[layout.poissons_ratio] = 0.4;
    elasticity->set_parameters(theta);
    elasticity->linearise(test::deformed(body->nodes, 0.1));
    for (int k = 0; k < width; ++k)
      matrices.push_back(member_matrix(*body, *elasticity, 1.0 + 0.02 * k, mass / body->volume() * body->node_count()));
    b.resize(3 * body->node_count());
    for (Eigen::Index i = 0; i < b.size(); ++i) b[i] = std::sin(1.0 + double(i * i % 1009));
  }
};

constexpr double residual = 1e-8;

/// A factorisation and a solve of each member, one after the other.
template <int width>
void one_by_one(benchmark::State& state, std::shared_ptr<const Body> (*make)(), double mass) {
  const Members<width> members(make(), mass);
  IterativeSolver solver(members.matrices.front().shared_pattern(), {SolverKind::Iterative, residual, 500});
  VectorX x;
  int iterations = 0;
  for (auto _ : state) {
    iterations = 0;
    for (const BlockMatrix& A : members.matrices) {
      if (!solver.factorise(A)) std::abort();
      x.setZero(members.b.size());
      iterations += solver.solve(members.b, x).iterations;
    }
  }
  state.counters["iterations"] = double(iterations) / width;
  state.SetItemsProcessed(state.iterations() * width);
}

template <int width>
void in_lanes(benchmark::State& state, std::shared_ptr<const Body> (*make)(), double mass) {
  const Members<width> members(make(), mass);
  LaneSolver<width> solver(members.matrices.front().pattern());
  for (int k = 0; k < width; ++k) {
    const BlockMatrix& A = members.matrices[std::size_t(k)];
    for (int block = 0; block < A.pattern().block_count(); ++block)
      for (int e = 0; e < 9; ++e) solver.matrix[9 * std::size_t(block) + std::size_t(e)][k] = A.block(block)[e];
    for (Eigen::Index i = 0; i < members.b.size(); ++i) solver.b[std::size_t(i)][k] = members.b[i];
  }
  int iterations = 0;
  for (auto _ : state) {
    solver.factorise();
    iterations = solver.solve(residual);
  }
  IterativeSolver alone(members.matrices.front().shared_pattern(), {SolverKind::Iterative, residual, 500});
  VectorX x = VectorX::Zero(members.b.size());
  if (!alone.factorise(members.matrices.front())) std::abort();
  (void)alone.solve(members.b, x);
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (!(std::abs(solver.x[std::size_t(i)][0] - x[i]) < 1e-6 * x.cwiseAbs().maxCoeff())) std::abort();
  state.counters["iterations"] = iterations;
  state.SetItemsProcessed(state.iterations() * width);
}

std::shared_ptr<const Body> torus() { return test::torus_body(0.1, 0.04, 0.0178); }
std::shared_ptr<const Body> bar() { return test::tet_body({1.0, 0.25, 0.25}, {20, 5, 5}, false); }
constexpr double of_torus = 4.0, of_bar = 0.02;  // as many iterations as steps take

constexpr auto four_one_by_one = one_by_one<4>, four_in_lanes = in_lanes<4>, eight_one_by_one = one_by_one<8>,
               eight_in_lanes = in_lanes<8>;
BENCHMARK_CAPTURE(four_one_by_one, torus, torus, of_torus);
BENCHMARK_CAPTURE(four_in_lanes, torus, torus, of_torus);
BENCHMARK_CAPTURE(eight_one_by_one, torus, torus, of_torus);
BENCHMARK_CAPTURE(eight_in_lanes, torus, torus, of_torus);
BENCHMARK_CAPTURE(four_one_by_one, bar, bar, of_bar);
BENCHMARK_CAPTURE(four_in_lanes, bar, bar, of_bar);
BENCHMARK_CAPTURE(eight_one_by_one, bar, bar, of_bar);
BENCHMARK_CAPTURE(eight_in_lanes, bar, bar, of_bar);

}  // namespace
}  // namespace pliant
