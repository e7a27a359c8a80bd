#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/polar.hpp"
#include "elasticity/tet_element.hpp"
#include "solvers/wide.hpp"

namespace pliant {

/// Numbers of an element's nodes in one vector, three a node.
namespace element_vector {

/// Those of node a.
template <class Derived>
auto node(Eigen::MatrixBase<Derived>& v, int a) {
  return v.template segment<3>(3 * a);
}
template <class Derived>
auto node(const Eigen::MatrixBase<Derived>& v, int a) {
  return v.template segment<3>(3 * a);
}

}  // namespace element_vector

/// Four element vectors side by side, one a lane: what several directions share is read once for them.
template <int N>
using ElementLanes = std::array<Wide<double>, 3 * N>;

/// Four 3 x 3 matrices side by side, entry (i, j) in [3 i + j].
using MatrixLanes = std::array<Wide<double>, 9>;

/// Rows of up to four fields at an element's nodes, less those of its first node where `relative` is set.
template <int N>
void gather_lanes(const int* nodes, std::span<const Points* const> fields, bool relative, ElementLanes<N>& lanes) {
  const double* rows[4];
  for (std::size_t l = 0; l < 4; ++l) rows[l] = fields[l < fields.size() ? l : 0]->data();
  const auto row = [&](std::size_t a, std::size_t i) {
    const std::size_t k = 3 * std::size_t(nodes[a]) + i;
    return Wide<double>{rows[0][k], rows[1][k], rows[2][k], rows[3][k]};
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const Wide<double> first = relative ? row(0, i) : Wide<double>{};
    for (std::size_t a = 0; a < N; ++a) lanes[3 * a + i] = row(a, i) - first;
  }
}

/// Subtracts each lane from its field's rows at the element's nodes.
template <int N>
void subtract_lanes(const int* nodes, const ElementLanes<N>& lanes, std::span<Points> fields) {
  for (std::size_t l = 0; l < fields.size(); ++l)
    for (std::size_t a = 0; a < N; ++a) {
      double* row = fields[l].data() + 3 * std::size_t(nodes[a]);
      for (std::size_t i = 0; i < 3; ++i) row[i] -= lanes[3 * a + i][l];
    }
}

/// Mean gradients of four fields over an element: sum_a x_a g_a^T.
template <int N, class Gradients>
MatrixLanes mean_gradient_lanes(const Gradients& g, const ElementLanes<N>& x) {
  MatrixLanes F{};
  for (std::size_t a = 0; a < N; ++a)
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) F[3 * i + j] += x[3 * a + i] * g(Eigen::Index(a), Eigen::Index(j));
  return F;
}

/// `rotation_rate` of four changes of F: w = (tr(S) I - S)^-1 vee(R^T dF - dF^T R).
inline std::array<Wide<double>, 3> rotation_rate_lanes(const Polar& polar, const MatrixLanes& dF) {
  const Matrix3 &R = polar.R, &rate = polar.rate_inverse;
  MatrixLanes A;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      const auto c = Eigen::Index(i);
      A[3 * i + j] = R(0, c) * dF[j] + R(1, c) * dF[3 + j] + R(2, c) * dF[6 + j];
    }
  const Wide<double> skew[3] = {A[7] - A[5], A[2] - A[6], A[3] - A[1]};
  std::array<Wide<double>, 3> w;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto r = Eigen::Index(i);
    w[i] = rate(r, 0) * skew[0] + rate(r, 1) * skew[1] + rate(r, 2) * skew[2];
  }
  return w;
}

/// Mean over an element of N nodes of the gradient of a field that its nodes carry.
template <int N>
Matrix3 mean_gradient(const Body& body, int element, const Points& field) {
  const auto g = body.mean_gradient.middleRows<N>(Eigen::Index(element) * N);
  const int* nodes = body.connectivity.data() + std::size_t(element) * N;
  Matrix3 gradient = Matrix3::Zero();
  for (int a = 0; a < N; ++a) gradient.noalias() += field.row(nodes[a]).transpose() * g.row(a);
  return gradient;
}

/// Mean gradients of a field over a body's elements, computed where they are asked for: three numbers a node are kept
/// in the place of nine an element, of which there may be six times as many.
template <int N>
class MeanGradients {
 public:
  /// Of the rest positions, to begin with.
  explicit MeanGradients(std::shared_ptr<const Body> body) : body_(std::move(body)), field_(body_->nodes) {}
  void set_field(const Points& field) { field_ = field; }
  const Points& field() const { return field_; }
  std::size_t size() const { return std::size_t(body_->element_count()); }
  Matrix3 operator[](std::size_t element) const { return mean_gradient<N>(*body_, int(element), field_); }

 private:
  std::shared_ptr<const Body> body_;
  Points field_;
};

/// Rest positions of an element's nodes relative to its first.
template <int N>
class RelativePositions {
 public:
  explicit RelativePositions(std::shared_ptr<const Body> body) : body_(std::move(body)) {}
  Eigen::Matrix<double, 3 * N, 1> operator[](std::size_t element) const {
    const int* nodes = body_->connectivity.data() + element * N;
    Eigen::Matrix<double, 3 * N, 1> local;
    for (int a = 0; a < N; ++a)
      element_vector::node(local, a) = (body_->nodes.row(nodes[a]) - body_->nodes.row(nodes[0])).transpose();
    return local;
  }

 private:
  std::shared_ptr<const Body> body_;
};

/// What the reverse sweep needs of an element's force y = K d and its cotangent c, with d = q - X.
template <int N>
struct ReverseProducts {
  Eigen::Matrix<double, 3 * N, 1> k;  ///< K c [m^2]
  Vector3 turn;                       ///< sum_a q_a x k_a - y_a x c_a
  double work = 0.0;                  ///< c . y
  double d_work = 0.0;                ///< c . (dK / d nu) d
};

/// @param y, k, dy  K d, K c and (dK / d nu) d
template <int N>
ReverseProducts<N> reverse_products(const Eigen::Matrix<double, 3 * N, 1>& q, const Eigen::Matrix<double, 3 * N, 1>& c,
                                    const Eigen::Matrix<double, 3 * N, 1>& y, const Eigen::Matrix<double, 3 * N, 1>& k,
                                    const Eigen::Matrix<double, 3 * N, 1>& dy) {
  ReverseProducts<N> products{k, Vector3::Zero(), c.dot(y), c.dot(dy)};
  for (int a = 0; a < N; ++a) {
    const Vector3 q_a = element_vector::node(q, a), k_a = element_vector::node(k, a);
    const Vector3 y_a = element_vector::node(y, a), c_a = element_vector::node(c, a);
    products.turn += q_a.cross(k_a) - y_a.cross(c_a);
  }
  return products;
}

/// Stiffness of a body's elements of N nodes in their own, unrotated frame, for E = 1 Pa: products, and blocks turned
/// into the world. All elements pass through here in every step, so it is kept to what they need.
template <int N>
class LocalStiffness {
 public:
  using Vector = Eigen::Matrix<double, 3 * N, 1>;

  explicit LocalStiffness(std::shared_ptr<const Body> body) : body_(std::move(body)) {}
  void set_poissons_ratio(double poissons_ratio);

  /// K d, 3 N [m^2].
  Vector times(int element, const Vector& d) const { return of(element).K.lazyProduct(d); }
  /// K d of four vectors: K, which may have to come from beyond the cache, is read once for them.
  void times(int element, const ElementLanes<N>& d, ElementLanes<N>& y) const {
    constexpr std::size_t size = 3 * N, rows = 6;
    const double* K = of(element).K.data();  // symmetric
    for (std::size_t i = 0; i < size; i += rows) {
      Wide<double> sum[rows] = {};
      for (std::size_t k = 0; k < size; ++k)
        for (std::size_t j = 0; j < rows; ++j) sum[j] += K[size * (i + j) + k] * d[k];
      for (std::size_t j = 0; j < rows; ++j) y[i + j] = sum[j];
    }
  }
  /// (dK / d nu) d.
  Vector derivative_times(int element, const Vector& d) const { return of(element).dK.lazyProduct(d); }
  [[nodiscard]] ReverseProducts<N> reverse(int element, const Vector& q, const Vector& d, const Vector& c) const {
    return reverse_products<N>(q, c, times(element, d), times(element, c), derivative_times(element, d));
  }
  /// Adds factor A K_ab A^T to the matrix's blocks.
  /// @param blocks  N x N numbers: where block (a, b) goes
  void add_transformed(int element, const Matrix3& A, double factor, const int* blocks, BlockMatrix& matrix) const {
    add_rotated(element, A, factor, blocks, matrix);
  }
  /// The same for a rotation.
  void add_rotated(int element, const Matrix3& R, double factor, const int* blocks, BlockMatrix& matrix) const;

 private:
  static constexpr int pairs = N * (N + 1) / 2;
  static constexpr int padded_pairs = (pairs + 7) / 8 * 8;
  struct Stiffness {
    Eigen::Matrix<double, 3 * N, 3 * N> K, dK;     ///< and derivative by Poisson's ratio
    Eigen::Matrix<double, padded_pairs, 9> upper;  ///< entry (i, j) in column 3 i + j of the blocks a <= b, padded
  };
  const Stiffness& of(int element) const { return classes_[std::size_t(body_->element_class[std::size_t(element)])]; }

  std::shared_ptr<const Body> body_;
  std::vector<Stiffness> classes_;
};

template <int N>
void LocalStiffness<N>::set_poissons_ratio(double poissons_ratio) {
  classes_.resize(body_->class_representative.size());
  for (std::size_t c = 0; c < classes_.size(); ++c) {
    const UnitStiffness<N> unit = unit_stiffness<N>(*body_, body_->class_representative[c], poissons_ratio);
    Stiffness& s = classes_[c];
    s.K = unit.value;
    s.dK = unit.d_poissons_ratio;
    s.upper.setZero();
    int block = 0;
    for (int a = 0; a < N; ++a)
      for (int b = a; b < N; ++b, ++block)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) s.upper(block, 3 * i + j) = s.K(3 * a + i, 3 * b + j);
  }
}

template <int N>
void LocalStiffness<N>::add_rotated(int element, const Matrix3& R, double factor, const int* blocks,
                                    BlockMatrix& matrix) const {
  using Column = Eigen::Matrix<double, padded_pairs, 1>;
  Eigen::Matrix<double, padded_pairs, 9> half, full;
  const auto& upper = of(element).upper;
  for (int i = 0; i < 3; ++i)  // R K
    for (int l = 0; l < 3; ++l)
      half.col(3 * i + l) =
          Column(R(i, 0) * upper.col(l) + R(i, 1) * upper.col(3 + l) + R(i, 2) * upper.col(6 + l)) * factor;
  for (int i = 0; i < 3; ++i)  // (R K) R^T
    for (int j = 0; j < 3; ++j)
      full.col(3 * i + j) = R(j, 0) * half.col(3 * i) + R(j, 1) * half.col(3 * i + 1) + R(j, 2) * half.col(3 * i + 2);
  int block = 0;
  for (int a = 0; a < N; ++a) {
    for (int b = a; b < N; ++b, ++block) {
      double* above = matrix.block(blocks[N * a + b]);
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) above[3 * j + i] += full(block, 3 * i + j);
      if (a == b) continue;
      double* below = matrix.block(blocks[N * b + a]);
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) below[3 * j + i] += full(block, 3 * j + i);
    }
  }
}

/// Linear tetrahedra have one strain each, so that K follows from the volume and the gradients,
///   K_ab = V (lambda g_a g_b^T + mu g_b g_a^T + mu (g_a . g_b) I),  K d = V (lambda tr(H) I + mu (H + H^T)) g
/// with H = sum_b d_b g_b^T: a tenth of the memory of K itself, which would have to come from beyond the cache.
template <>
class LocalStiffness<4> {
 public:
  using Vector = Eigen::Matrix<double, 12, 1>;

  explicit LocalStiffness(std::shared_ptr<const Body> body) : body_(std::move(body)) {}
  void set_poissons_ratio(double poissons_ratio) { lame_ = unit_lame(poissons_ratio); }

  Vector times(int element, const Vector& d) const { return times(element, d, lame_.lambda, lame_.mu); }
  void times(int element, const ElementLanes<4>& d, ElementLanes<4>& y) const {
    const double volume = body_->element_volume[std::size_t(element)];
    const double lambda = volume * lame_.lambda, mu = volume * lame_.mu;
    const auto g = gradients(element);
    const MatrixLanes H = mean_gradient_lanes<4>(g.transpose(), d);
    MatrixLanes T;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) T[3 * i + j] = mu * (H[3 * i + j] + H[3 * j + i]);
    for (std::size_t i = 0; i < 3; ++i) T[4 * i] += lambda * (H[0] + H[4] + H[8]);
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t i = 0; i < 3; ++i) {
        const auto column = Eigen::Index(a);
        y[3 * a + i] = T[3 * i] * g(0, column) + T[3 * i + 1] * g(1, column) + T[3 * i + 2] * g(2, column);
      }
  }
  Vector derivative_times(int element, const Vector& d) const { return times(element, d, lame_.d_lambda, lame_.d_mu); }
  /// With Q, H and C, the gradients of q, d and c, and stresses T of d and P of c: turn_i = V eps_ijl (Q P + C T)_jl.
  [[nodiscard]] ReverseProducts<4> reverse(int element, const Vector& q, const Vector& d, const Vector& c) const {
    const Matrix3 Q = gradient(element, q), H = gradient(element, d), C = gradient(element, c);
    const Matrix3 strain = H + H.transpose();
    const double volume = body_->element_volume[std::size_t(element)], twice = C.cwiseProduct(strain).sum();
    const Matrix3 P = stress(C, volume * lame_.lambda, volume * lame_.mu);
    const Matrix3 M = Q.lazyProduct(P) + C.lazyProduct(stress(H, volume * lame_.lambda, volume * lame_.mu));
    ReverseProducts<4> products;
    Eigen::Map<Matrix3x4>(products.k.data()).noalias() = P.lazyProduct(gradients(element));
    products.turn << M(1, 2) - M(2, 1), M(2, 0) - M(0, 2), M(0, 1) - M(1, 0);
    products.work = volume * (lame_.lambda * C.trace() * H.trace() + lame_.mu * twice);
    products.d_work = volume * (lame_.d_lambda * C.trace() * H.trace() + lame_.d_mu * twice);
    return products;
  }

  void add_transformed(int element, const Matrix3& A, double factor, const int* blocks, BlockMatrix& matrix) const {
    const auto g = gradients(element);
    const Matrix3x4 h = A * g;
    const Matrix3 square = A * A.transpose();
    const double volume = factor * body_->element_volume[std::size_t(element)];
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b)
        Eigen::Map<Matrix3>(matrix.block(blocks[4 * a + b])).noalias() +=
            volume * (lame_.lambda * h.col(a) * h.col(b).transpose() + lame_.mu * h.col(b) * h.col(a).transpose() +
                      lame_.mu * g.col(a).dot(g.col(b)) * square);
  }
  void add_rotated(int element, const Matrix3& R, double factor, const int* blocks, BlockMatrix& matrix) const {
    const Matrix3x4 h = R * gradients(element);
    const double volume = factor * body_->element_volume[std::size_t(element)];
    const double lambda = volume * lame_.lambda, mu = volume * lame_.mu;
    // Entry 3 j + i of an outer product x y^T is x_i y_j: nine entries in two wide numbers and a plain one, so that
    // nothing beyond the block is touched, to which another thread may add.
    Wide<double> row[4][2], column[4][2];
    for (int a = 0; a < 4; ++a) {
      const double x = h(0, a), y = h(1, a), z = h(2, a);
      row[a][0] = Wide<double>{x, y, z, x}, row[a][1] = Wide<double>{y, z, x, y};
      column[a][0] = Wide<double>{x, x, x, y}, column[a][1] = Wide<double>{y, y, z, z};
    }
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < 4; ++b) {
        const double diagonal = mu * h.col(a).dot(h.col(b));
        const Wide<double> on_diagonal{diagonal, 0.0, 0.0, 0.0};
        double* block = matrix.block(blocks[4 * a + b]);
        for (int half = 0; half < 2; ++half)
          store_wide(block + 4 * half, load_wide(block + 4 * half) + lambda * row[a][half] * column[b][half] +
                                           mu * row[b][half] * column[a][half] + on_diagonal);
        block[8] += lambda * h(2, a) * h(2, b) + mu * h(2, b) * h(2, a) + diagonal;
      }
  }

 private:
  using Matrix3x4 = Eigen::Matrix<double, 3, 4>;
  /// g_a in column a.
  Eigen::Map<const Matrix3x4> gradients(int element) const {
    return Eigen::Map<const Matrix3x4>(body_->mean_gradient.data() + 12 * std::size_t(element));
  }
  /// H = sum_b d_b g_b^T.
  [[gnu::always_inline]] Matrix3 gradient(int element, const Vector& d) const {
    return Eigen::Map<const Matrix3x4>(d.data()).lazyProduct(gradients(element).transpose());
  }
  [[gnu::always_inline]] Vector times(int element, const Vector& d, double lambda, double mu) const {
    const auto g = gradients(element);
    const double volume = body_->element_volume[std::size_t(element)];
    Vector force;
    Eigen::Map<Matrix3x4>(force.data()).noalias() =
        stress(gradient(element, d), volume * lambda, volume * mu).lazyProduct(g);
    return force;
  }
  [[gnu::always_inline]] static Matrix3 stress(const Matrix3& H, double lambda, double mu) {
    Matrix3 stress = mu * (H + H.transpose());
    stress.diagonal().array() += lambda * H.trace();
    return stress;
  }

  std::shared_ptr<const Body> body_;
  UnitLame lame_;
};

/// Quadratic tetrahedra by the points of their stiffness's rule, four at a time in the lanes of wide registers:
///   K d = sum V (lambda tr(H) I + mu (H + H^T)) g,  H = sum_b d_b g_b^T.
/// K itself, of which every element of an unstructured mesh has its own, is seven times as large and comes from beyond
/// the cache.
template <>
class LocalStiffness<10> {
 public:
  using Vector = Eigen::Matrix<double, 30, 1>;

  explicit LocalStiffness(std::shared_ptr<const Body> body) : body_(std::move(body)) {
    first_.push_back(0);
    for (const int e : body_->class_representative) {
      Eigen::Matrix<double, 10, 3> X;
      for (int a = 0; a < 10; ++a) X.row(a) = body_->nodes.row(body_->element(e)[std::size_t(a)]);
      const std::vector<StiffnessPoint<10>> points = stiffness_points<10>(X);
      for (std::size_t p = 0; p < points.size(); ++p) {
        if (p % 4 == 0) groups_.emplace_back();
        const double root = std::sqrt(points[p].volume);
        for (std::size_t a = 0; a < 10; ++a)
          for (std::size_t j = 0; j < 3; ++j)
            groups_.back()[3 * a + j][p % 4] = root * points[p].gradients(Eigen::Index(a), Eigen::Index(j));
      }
      first_.push_back(groups_.size());
    }
  }
  void set_poissons_ratio(double poissons_ratio) { lame_ = unit_lame(poissons_ratio); }

  Vector times(int element, const Vector& d) const { return times(element, d, lame_.lambda, lame_.mu); }
  /// K d of four vectors, one a lane, point by point.
  void times(int element, const ElementLanes<10>& d, ElementLanes<10>& y) const {
    const Wide<double> lambda = Wide<double>{} + lame_.lambda, mu = Wide<double>{} + lame_.mu;
    y = {};
    for (const Group& g : of(element))
      for (std::size_t p = 0; p < 4; ++p) {
        MatrixLanes H{};
        for (std::size_t a = 0; a < 10; ++a)
          for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j) H[3 * i + j] += d[3 * a + i] * g[3 * a + j][p];
        const MatrixLanes T = stress(H, lambda, mu);
        for (std::size_t a = 0; a < 10; ++a)
          for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j) y[3 * a + i] += T[3 * i + j] * g[3 * a + j][p];
      }
  }
  Vector derivative_times(int element, const Vector& d) const { return times(element, d, lame_.d_lambda, lame_.d_mu); }
  [[nodiscard]] ReverseProducts<10> reverse(int element, const Vector& q, const Vector& d, const Vector& c) const {
    return reverse_products<10>(q, c, times(element, d), times(element, c), derivative_times(element, d));
  }
  void add_transformed(int element, const Matrix3& A, double factor, const int* blocks, BlockMatrix& matrix) const {
    add<false>(element, A, factor, blocks, matrix);
  }
  void add_rotated(int element, const Matrix3& R, double factor, const int* blocks, BlockMatrix& matrix) const {
    add<true>(element, R, factor, blocks, matrix);
  }

 private:
  /// Of four points, or fewer and zeros, entry j of the gradient of node a in [3 a + j], times the root of the volume.
  using Group = ElementLanes<10>;
  std::span<const Group> of(int element) const {
    const auto c = std::size_t(body_->element_class[std::size_t(element)]);
    return std::span(groups_).subspan(first_[c], first_[c + 1] - first_[c]);
  }
  [[gnu::always_inline]] static MatrixLanes stress(const MatrixLanes& H, Wide<double> lambda, Wide<double> mu) {
    MatrixLanes T;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j < 3; ++j) T[3 * i + j] = mu * (H[3 * i + j] + H[3 * j + i]);
    for (std::size_t i = 0; i < 3; ++i) T[4 * i] += lambda * (H[0] + H[4] + H[8]);
    return T;
  }
  [[gnu::always_inline]] Vector times(int element, const Vector& d, double lambda, double mu) const {
    ElementLanes<10> sum{};
    for (const Group& g : of(element)) {
      MatrixLanes H{};
      for (std::size_t a = 0; a < 10; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) H[3 * i + j] += d[Eigen::Index(3 * a + i)] * g[3 * a + j];
      const MatrixLanes T = stress(H, Wide<double>{} + lambda, Wide<double>{} + mu);
      for (std::size_t a = 0; a < 10; ++a)
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j) sum[3 * a + i] += T[3 * i + j] * g[3 * a + j];
    }
    Vector y;
    for (std::size_t k = 0; k < 30; ++k) y[Eigen::Index(k)] = sum_of(sum[k]);
    return y;
  }
  static double sum_of(Wide<double> lanes) { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); }

  /// A K_ab A^T = lambda S_ab + mu S_ba + mu (integral of g_a . g_b) A A^T with S_ab = integral of (A g_a) (A g_b)^T.
  template <bool is_rotation>
  void add(int element, const Matrix3& A, double factor, const int* blocks, BlockMatrix& matrix) const {
    Eigen::Matrix<double, 30, 30> S;
    Eigen::Matrix<double, 10, 10> dots;  // where A is no rotation, which keeps them
    bool is_first = true;
    for (const Group& g : of(element)) {
      Eigen::Matrix<double, 4, 30> h;
      for (std::size_t a = 0; a < 10; ++a)
        for (std::size_t i = 0; i < 3; ++i) {
          const auto r = Eigen::Index(i);
          store_wide(h.col(Eigen::Index(3 * a + i)).data(),
                     A(r, 0) * g[3 * a] + A(r, 1) * g[3 * a + 1] + A(r, 2) * g[3 * a + 2]);
        }
      const Eigen::Matrix<double, 30, 4> rows = h.transpose();
      if (is_first)
        S = rows.lazyProduct(h);
      else
        S += rows.lazyProduct(h);
      if constexpr (!is_rotation) {
        if (is_first) dots.setZero();
        for (std::size_t a = 0; a < 10; ++a)
          for (std::size_t b = 0; b <= a; ++b)
            dots(Eigen::Index(a), Eigen::Index(b)) +=
                sum_of(g[3 * a] * g[3 * b] + g[3 * a + 1] * g[3 * b + 1] + g[3 * a + 2] * g[3 * b + 2]);
      }
      is_first = false;
    }
    const Matrix3 square = is_rotation ? Matrix3::Identity() : Matrix3(A * A.transpose());
    const double lambda = factor * lame_.lambda, mu = factor * lame_.mu;
    for (int a = 0; a < 10; ++a)
      for (int b = 0; b <= a; ++b) {
        const double *left = &S(3 * a, 3 * b), *right = &S(3 * b, 3 * a);  // of S_ab and of S_ba, columns first
        double K[9], transposed[9];
        for (int k = 0; k < 3; ++k)
          for (int i = 0; i < 3; ++i) {
            const double one = left[30 * k + i], other = right[30 * k + i];
            K[3 * k + i] = lambda * one + mu * other;
            transposed[3 * k + i] = lambda * other + mu * one;
          }
        if constexpr (is_rotation) {
          const double dot = mu * (left[0] + left[31] + left[62]);
          for (const int d : {0, 4, 8}) K[d] += dot, transposed[d] += dot;
        } else {
          for (int k = 0; k < 9; ++k)
            K[k] += (mu * dots(a, b)) * square.data()[k], transposed[k] += (mu * dots(a, b)) * square.data()[k];
        }
        double* block = matrix.block(blocks[10 * a + b]);
        for (int k = 0; k < 9; ++k) block[k] += K[k];
        if (a == b) continue;
        block = matrix.block(blocks[10 * b + a]);
        for (int k = 0; k < 9; ++k) block[k] += transposed[k];
      }
  }

  std::shared_ptr<const Body> body_;
  std::vector<Group> groups_;
  std::vector<std::size_t> first_;  // of each class of elements
  UnitLame lame_;
};

}  // namespace pliant
