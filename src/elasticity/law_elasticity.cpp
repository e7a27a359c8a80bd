#include "elasticity/law_elasticity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/parallel.hpp"
#include "elasticity/local_stiffness.hpp"
#include "elasticity/tangent_projection.hpp"
#include "elasticity/tet_element.hpp"

namespace pliant {

Strain6 biot_strain(const Matrix3& F) {
  const Matrix3 S = polar_decomposition(F).S;
  Strain6 strain;
  strain << S(0, 0) - 1.0, S(1, 1) - 1.0, S(2, 2) - 1.0, S(0, 1), S(0, 2), S(1, 2);
  return strain;
}

namespace {

Matrix3 matrix_of(const Vector9& v) { return Eigen::Map<const Matrix3>(v.data()); }

/// Of an isotropic law's tangent M(ij, kl) in the frame of the principal stretches, where it is none but where its
/// indices are equal in pairs: that with i and k of the world. For j and l
///   j = l: U diag_i(M(ij, ij)) U^T,   else: M(jj, ll) u_j u_l^T + M(lj, jl) u_l u_j^T.
Matrix9 with_left_in_world(const Matrix3& U, const Matrix9& M) {
  const auto at = [](int i, int j) { return i + 3 * j; };
  Matrix9 turned;
  for (int l = 0; l < 3; ++l)
    for (int j = 0; j < 3; ++j) {
      auto block = turned.block<3, 3>(3 * j, 3 * l);
      if (j == l) {
        const Vector3 own(M(at(0, j), at(0, j)), M(at(1, j), at(1, j)), M(at(2, j), at(2, j)));
        const Matrix3 weighted = U * own.asDiagonal();
        block.noalias() = weighted * U.transpose();
      } else {
        block.noalias() = U.col(j) * (M(at(j, j), at(l, l)) * U.col(l)).transpose();
        block.noalias() += U.col(l) * (M(at(l, j), at(j, l)) * U.col(j)).transpose();
      }
    }
  return turned;
}

/// A tangent that stands in the frame of a stress's.
Matrix9 in_world(const PointStress& frame, const Matrix9& tangent) {
  if (frame.left.isIdentity(0.0) && frame.right.isIdentity(0.0)) return tangent;
  return world_tangent({.left = frame.left, .right = frame.right, .tangent = tangent});
}

template <int N>
class TetLawElasticity : public LawElasticity {
 public:
  TetLawElasticity(std::shared_ptr<const Body> body, std::shared_ptr<const MaterialLaw> law,
                   const std::shared_ptr<const BlockPattern>& pattern);
  TetLawElasticity(std::shared_ptr<const Body> body, const LawLayout& layout)
      : TetLawElasticity(body, nullptr, nullptr) {
    field_ = std::make_unique<MaterialField>(std::move(body), layout);
  }

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::Blended; }
  void set_parameters(const VectorX& theta) override;
  void linearise(const Points& lag) override;
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override { add_stiffness(Stiffness::Positive, scale, matrix); }
  void add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) override;
  void add_tangent_stiffness(const Points&, double scale, BlockMatrix& matrix) override {
    add_stiffness(Stiffness::Exact, scale, matrix);
  }
  std::optional<double> potential(const Points&) override { return energy_; }
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void prepare_tangents(const Points& z, const Eigen::Ref<const MatrixX>& d_theta) override;
  void add_force_tangents(const Points& z, const ForceChanges& changes, std::span<Points> forces) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;
  void set_reference(const std::shared_ptr<const Body>& body) override;
  void linearise_reference(const Points& z) override { reference_z_ = z; }
  void add_reference_tangents(std::span<const Points* const> d_references, std::span<Points* const> forces) override;
  void add_reference_adjoint(const Points& w, Points& reference_bar) override;
  double energy(const Points& z) const override;

  double evaluate(const Points& x, bool with_tangent) override;
  void add_gradient(Points& gradient) const override;
  void add_stiffness(Stiffness which, double scale, BlockMatrix& matrix) const override;
  void add_product(Stiffness which, const Points& d, double scale, Points& product) const override;
  void for_parameter_derivatives(const VisitDerivatives& visit) const override;
  Matrix3 cauchy_stress(int element) const override;
  double tangent_modulus(int element) const override;
  MatrixX strains() const override;
  bool set_reference_positions(const Points& reference) override;
  double least_volume_ratio() const override { return least_volume_ratio_; }
  void add_reference_matrix(double scale, BlockMatrix& matrix) override;

 protected:
  void find_rotations() override;

 private:
  static constexpr int points = N == 4 ? 1 : 4;
  using Nodes = Eigen::Matrix<double, N, 3>;
  struct Point {
    double volume;
    Nodes gradient;  // of the shape functions, by node
    Matrix3 F;
    PointStress stress;
  };
  /// Of the affine stress S = P(F) + M+(F) : H, H = F_z - F, in the frame of the world.
  struct PointChange {
    Matrix9 by_lag;                                          // dS/dF at the same F_z
    Matrix9 by_z;                                            // dS/dF_z = M+
    Matrix3 stress;                                          // S
    Eigen::Matrix<double, 9, Eigen::Dynamic> by_parameters;  // dS/dq; where they were asked for
  };
  const int* nodes_of(int e) const { return body_->connectivity.data() + std::size_t(e) * N; }
  Matrix3 deformation(int e, const Nodes& gradient, const Points& x) const {
    Matrix3 F = Matrix3::Zero();
    for (int a = 0; a < N; ++a) F.noalias() += x.row(nodes_of(e)[a]).transpose() * gradient.row(a);
    return F;
  }
  static constexpr int rule_degree = N == 4 ? 1 : 2;
  Nodes of_element(int e, const Points& all) const {
    Nodes own;
    for (int a = 0; a < N; ++a) own.row(a) = all.row(nodes_of(e)[a]);
    return own;
  }
  /// By volume of an element's points, at the last `evaluate`.
  Matrix3 mean_deformation(int e) const {
    Matrix3 F = Matrix3::Zero();
    double volume = 0.0;
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e) * points + std::size_t(q)];
      F += point.volume * point.F;
      volume += point.volume;
    }
    return F / volume;
  }
  /// Volumes of all points where the nodes are stress-free here.
  std::vector<double> volumes(const Points& reference) const;
  void take_reference(const Points& reference);
  /// Change of a point's stress for G, that of its reference: dX = G of the reference as it is.
  Matrix3 reference_change(const Point& point, const PointChange& change, const Matrix3& F_z, const Matrix3& G) const {
    return G.trace() * change.stress - change.stress * G.transpose() -
           matrix_of(change.by_lag * vec(point.F * G) + change.by_z * vec(F_z * G));
  }
  /// Calls function(element, number of the point) for all points, in any order and at once.
  template <class Function>
  void for_all_points(Function&& function) const;
  /// The tangents in their own frames, without negative parts, at the last `evaluate`.
  const std::vector<TangentProjection>& projections() const;
  /// A tangent M(ij, kl) and the gradients that belong to it: i and k are of the world, j and l of their frame.
  struct Turned {
    Matrix9 tangent;
    Nodes gradient;
  };
  /// matrix += scale times the elements' stiffness.
  /// @param turned_at  of a point, by its number
  template <bool is_symmetric, class TurnedAt>
  void add_elements(const TurnedAt& turned_at, double scale, BlockMatrix& matrix) const;
  /// The same of elements of one point whose tangents stand in the frame of the principal stretches.
  /// @param tangent_at  in that frame
  template <class TangentAt>
  void add_principal_elements(const TangentAt& tangent_at, double scale, BlockMatrix& matrix) const;
  /// The changes of all points' stresses about the lag point and z.
  const std::vector<PointChange>& changes(const Points& z, bool by_parameters);
  PointChange change_of(int e, std::size_t point, const Points& z, bool by_parameters) const;
  /// force -= V S g for the stress S of a point.
  void subtract(int e, const Point& point, const Matrix3& stress, Points& force) const {
    const Nodes own = point.volume * point.gradient * stress.transpose();
    for (int a = 0; a < N; ++a) force.row(nodes_of(e)[a]) -= own.row(a);
  }

  std::shared_ptr<const Body> body_;
  std::unique_ptr<MaterialField> field_;  // where the law follows from the parameters
  std::vector<Point> points_;
  std::vector<double> given_volumes_;  // of the body as it was given
  double least_volume_ratio_ = 1.0;
  std::shared_ptr<const std::vector<int>> blocks_;  // N x N an element
  Points lag_, reference_z_;
  double energy_ = 0.0;  // at the last `evaluate`; infinite where the law knows no such deformation
  bool has_rotations_ = false;
  bool has_frames_ = false;  // the stresses' `left` and `right`, of the last `evaluate` with tangents
  mutable std::vector<TangentProjection> projections_;
  mutable bool has_projections_ = false;
  std::vector<PointChange> changes_;
  Points changes_z_;
  bool has_changes_ = false, has_parameter_changes_ = false;
};

template <int N>
TetLawElasticity<N>::TetLawElasticity(std::shared_ptr<const Body> body, std::shared_ptr<const MaterialLaw> law,
                                      const std::shared_ptr<const BlockPattern>& pattern)
    : LawElasticity(std::move(law)), body_(std::move(body)) {
  const int count = body_->element_count();
  points_.resize(std::size_t(count) * points);
  polar_.resize(std::size_t(count));
  blocks_ = pattern ? std::make_shared<std::vector<int>>(element_blocks(*body_, *pattern)) : body_->blocks;
  given_volumes_ = volumes(body_->nodes);
  take_reference(body_->nodes);
}

template <int N>
std::vector<double> TetLawElasticity<N>::volumes(const Points& reference) const {
  const auto rule = tet_quadrature(rule_degree);
  std::vector<double> all;
  for (int e = 0; e < body_->element_count(); ++e) {
    const Nodes X = of_element(e, reference);
    for (const TetQuadraturePoint& at : rule)
      all.push_back(at.weight * Matrix3(X.transpose() * tet_shape_derivatives<N>(at.at)).determinant() / 6.0);
  }
  return all;
}

template <int N>
void TetLawElasticity<N>::take_reference(const Points& reference) {
  const auto rule = tet_quadrature(rule_degree);
  const std::vector<double> all = volumes(reference);
  for (int e = 0; e < body_->element_count(); ++e) {
    const Nodes X = of_element(e, reference);
    for (int q = 0; q < points; ++q) {
      const auto p = std::size_t(e) * points + std::size_t(q);
      points_[p].volume = all[p];
      points_[p].gradient = tet_gradients<N>(X, rule[std::size_t(q)].at);
    }
  }
  has_projections_ = has_changes_ = false;
}

template <int N>
void TetLawElasticity<N>::set_reference(const std::shared_ptr<const Body>& body) {
  body_ = body;
  take_reference(body_->nodes);
}

template <int N>
bool TetLawElasticity<N>::set_reference_positions(const Points& reference) {
  const std::vector<double> all = volumes(reference);
  least_volume_ratio_ = std::numeric_limits<double>::infinity();
  for (std::size_t p = 0; p < all.size(); ++p)
    least_volume_ratio_ = std::min(least_volume_ratio_, all[p] / given_volumes_[p]);
  if (!(least_volume_ratio_ > 0.0)) return false;
  take_reference(reference);
  return true;
}

template <int N>
void TetLawElasticity<N>::set_parameters(const VectorX& theta) {
  if (!field_) return;
  field_->set_parameters(theta);
  law_ = field_->law();
  has_projections_ = has_changes_ = false;
}

template <int N>
template <class Function>
void TetLawElasticity<N>::for_all_points(Function&& function) const {
  parallel_ranges(0, std::size_t(body_->element_count()), 32, [&](std::size_t begin, std::size_t end) {
    for (int e = int(begin); e < int(end); ++e)
      for (int q = 0; q < points; ++q) function(e, std::size_t(e) * points + std::size_t(q));
  });
}

template <int N>
const std::vector<TangentProjection>& TetLawElasticity<N>::projections() const {
  if (has_projections_) return projections_;
  projections_.resize(points_.size());
  const bool is_isotropic = law_->is_isotropic();
  for_all_points([&](int, std::size_t p) {
    const PointStress& s = points_[p].stress;
    const Matrix3 F = s.left.transpose() * points_[p].F * s.right;
    projections_[p] = TangentProjection(s.tangent, is_isotropic ? &F : nullptr);
  });
  has_projections_ = true;
  return projections_;
}

template <int N>
double TetLawElasticity<N>::evaluate(const Points& x, bool with_tangent) {
  has_projections_ = has_changes_ = false;
  // Groups that depend on the points alone: their stresses are the same for any number of threads.
  constexpr std::size_t together = PrincipalStretches::lanes;
  const std::size_t groups = (points_.size() + together - 1) / together;
  parallel_ranges(0, groups, 4, [&](std::size_t begin, std::size_t end) {
    std::array<DeformedPoint, together> group;
    for (std::size_t g = begin; g < end; ++g) {
      const std::size_t first = g * together, some = std::min(together, points_.size() - first);
      for (std::size_t i = 0; i < some; ++i) {
        Point& point = points_[first + i];
        const int e = int((first + i) / points);
        point.F = deformation(e, point.gradient, x);
        group[i] = {e, &point.F, &point.stress};
      }
      law_->stresses({group.data(), some}, with_tangent);
    }
  });
  double energy = 0.0;
  for (const Point& point : points_) energy += point.volume * point.stress.energy;
  energy_ = std::isnan(energy) ? std::numeric_limits<double>::infinity() : energy;
  if (with_tangent) has_frames_ = std::isfinite(energy_);
  return energy_;
}

template <int N>
void TetLawElasticity<N>::add_gradient(Points& gradient) const {
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e) * points + std::size_t(q)];
      const Nodes force = point.volume * point.gradient * point.stress.P.transpose();
      for (int a = 0; a < N; ++a) gradient.row(nodes_of(e)[a]) += force.row(a);
    }
}

/// K_ab(i, k) = sum over points of V g_a^T M_ik g_b with (M_ik)(j, l) = M(ij, kl): for each i and k all nodes at once.
template <int N>
template <bool is_symmetric, class TurnedAt>
void TetLawElasticity<N>::add_elements(const TurnedAt& turned_at, double scale, BlockMatrix& matrix) const {
  using Plane = Eigen::Matrix<double, N, N>;
  using Part = Eigen::Map<const Matrix3, 0, Eigen::Stride<27, 3>>;  // M_ik
  body_->loop->each([&](int e) {
    std::array<std::array<Plane, 3>, 3> K;
    for (int q = 0; q < points; ++q) {
      const std::size_t p = std::size_t(e) * points + std::size_t(q);
      const Turned turned = turned_at(p);
      const Nodes& g = turned.gradient;
      const Nodes weighted = scale * points_[p].volume * g;
      for (int i = 0; i < 3; ++i)
        for (int k = is_symmetric ? i : 0; k < 3; ++k) {
          const Nodes left = weighted.lazyProduct(Part(&turned.tangent(i, k)));
          if (q == 0)
            K[i][k].noalias() = left.lazyProduct(g.transpose());  // small: without the blocking of large products
          else
            K[i][k].noalias() += left.lazyProduct(g.transpose());
        }
    }
    const int* blocks = blocks_->data() + std::size_t(e) * (N * N);
    for (int a = 0; a < N; ++a)
      for (int b = 0; b < N; ++b) {
        double* block = matrix.block(blocks[N * a + b]);  // columns first
        for (int k = 0; k < 3; ++k)
          for (int i = 0; i < 3; ++i) block[i + 3 * k] += is_symmetric && k < i ? K[k][i](b, a) : K[i][k](a, b);
      }
  });
}

/// In the frame of the principal stretches a tangent M(ij, kl) of an isotropic law is none but where its indices are
/// equal in pairs, so that with g' = V^T g and no sums but over j
///   K'_ab(i, i) = V sum_j M(ij, ij) g'_aj g'_bj,
///   K'_ab(i, k) = V (M(ii, kk) g'_ai g'_bk + M(ik, ki) g'_ak g'_bi),   K_ab = U K'_ab U^T.
template <int N>
template <class TangentAt>
void TetLawElasticity<N>::add_principal_elements(const TangentAt& tangent_at, double scale, BlockMatrix& matrix) const {
  static_assert(points == 1);
  const auto at = [](int i, int j) { return i + 3 * j; };
  body_->loop->each([&](int e) {
    const Point& point = points_[std::size_t(e)];
    const Matrix3& U = point.stress.left;
    const Matrix9& M = tangent_at(std::size_t(e));
    const Nodes g = point.gradient * point.stress.right, weighted = (scale * point.volume) * g;
    Matrix3 own, normal, crossed;  // M(ij, ij), M(ii, kk) and M(ik, ki)
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) {
        own(i, k) = M(at(i, k), at(i, k));
        normal(i, k) = M(at(i, i), at(k, k));
        crossed(i, k) = M(at(i, k), at(k, i));
      }
    const int* blocks = blocks_->data() + std::size_t(e) * (N * N);
    for (int a = 0; a < N; ++a)
      for (int b = a; b < N; ++b) {
        Matrix3 local;
        for (int i = 0; i < 3; ++i) {
          local(i, i) = 0.0;
          for (int j = 0; j < 3; ++j) local(i, i) += own(i, j) * weighted(a, j) * g(b, j);
          for (int k = 0; k < 3; ++k)
            if (k != i)
              local(i, k) = normal(i, k) * weighted(a, i) * g(b, k) + crossed(i, k) * weighted(a, k) * g(b, i);
        }
        const Matrix3 turned = U * local, K = turned * U.transpose();
        Eigen::Map<Matrix3>(matrix.block(blocks[N * a + b])) += K;
        if (a != b) Eigen::Map<Matrix3>(matrix.block(blocks[N * b + a])) += K.transpose();
      }
  });
}

template <int N>
void TetLawElasticity<N>::add_stiffness(Stiffness which, double scale, BlockMatrix& matrix) const {
  if (which == Stiffness::Positive) projections();
  const auto own_tangent = [&](std::size_t p) -> const Matrix9& {
    return which == Stiffness::Exact ? points_[p].stress.tangent : projections_[p].positive;
  };
  if constexpr (points == 1)
    if (law_->has_principal_frame()) return add_principal_elements(own_tangent, scale, matrix);
  const bool is_principal = law_->has_principal_frame();
  add_elements<true>(
      [&](std::size_t p) {
        const Point& point = points_[p];
        const PointStress& s = point.stress;
        return is_principal ? Turned{with_left_in_world(s.left, own_tangent(p)), point.gradient.lazyProduct(s.right)}
                            : Turned{in_world(s, own_tangent(p)), point.gradient};
      },
      scale, matrix);
}

template <int N>
void TetLawElasticity<N>::for_parameter_derivatives(const VisitDerivatives& visit) const {
  const int count = int(law_->parameter_names().size());
  // In the frame of the last tangent, which is near that of the principal stretches, these take no search.
  const bool is_turned = has_frames_ && law_->has_principal_frame();
  std::vector<Matrix3> by_parameter(std::size_t(count), Matrix3::Zero());
  MatrixX derivatives(3 * N, count);
  for (int e = 0; e < body_->element_count(); ++e) {
    derivatives.setZero();
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e) * points + std::size_t(q)];
      const PointStress& s = point.stress;
      const Nodes gradient = is_turned ? Nodes(point.gradient * s.right) : point.gradient;
      law_->parameter_derivatives(e, is_turned ? Matrix3(s.left.transpose() * point.F * s.right) : point.F,
                                  by_parameter);
      for (int k = 0; k < count; ++k) {
        Eigen::Matrix<double, 3, N> force = point.volume * by_parameter[std::size_t(k)] * gradient.transpose();
        if (is_turned) force = (s.left * force).eval();
        derivatives.col(k) += Eigen::Map<const Eigen::Matrix<double, 3 * N, 1>>(force.data());
      }
    }
    visit(e, body_->element(e), derivatives);
  }
}

template <int N>
Matrix3 TetLawElasticity<N>::cauchy_stress(int e) const {
  Matrix3 sum = Matrix3::Zero();
  double volume = 0.0;
  for (int q = 0; q < points; ++q) {
    const Point& point = points_[std::size_t(e) * points + std::size_t(q)];
    if (!std::isfinite(point.stress.energy)) return Matrix3::Constant(std::numeric_limits<double>::quiet_NaN());
    sum += point.volume / point.F.determinant() * point.stress.P * point.F.transpose();
    volume += point.volume;
  }
  return sum / volume;
}

template <int N>
double TetLawElasticity<N>::tangent_modulus(int e) const {
  return pliant::tangent_modulus(*law_, e, mean_deformation(e));
}

template <int N>
MatrixX TetLawElasticity<N>::strains() const {
  MatrixX strains = MatrixX::Zero(body_->element_count(), 6);
  for (int e = 0; e < body_->element_count(); ++e) {
    double volume = 0.0;
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e) * points + std::size_t(q)];
      strains.row(e) += point.volume * biot_strain(point.F).transpose();
      volume += point.volume;
    }
    strains.row(e) /= volume;
  }
  return strains;
}

template <int N>
double TetLawElasticity<N>::energy(const Points& z) const {
  double sum = 0.0;
  PointStress stress;
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e) * points + std::size_t(q)];
      law_->stress(e, deformation(e, point.gradient, z), false, stress);
      sum += point.volume * stress.energy;
    }
  return sum;
}

template <int N>
void TetLawElasticity<N>::linearise(const Points& lag) {
  evaluate(lag, true);
  lag_ = lag;
  has_rotations_ = false;
}

template <int N>
void TetLawElasticity<N>::find_rotations() {
  if (std::exchange(has_rotations_, true)) return;
  for (int e = 0; e < body_->element_count(); ++e)
    polar_[std::size_t(e)] = polar_decomposition(mean_deformation(e), polar_[std::size_t(e)].quaternion);
}

template <int N>
void TetLawElasticity<N>::add_product(Stiffness which, const Points& d, double scale, Points& product) const {
  if (which == Stiffness::Positive) projections();
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const std::size_t p = std::size_t(e) * points + std::size_t(q);
      const Point& point = points_[p];
      const PointStress& s = point.stress;
      const Matrix3 local = s.left.transpose() * deformation(e, point.gradient, d) * s.right;
      const Vector9 turned = (which == Stiffness::Exact ? s.tangent : projections_[p].positive) * vec(local);
      const Matrix3 dP = s.left * matrix_of(turned) * s.right.transpose();
      const Nodes force = scale * point.volume * point.gradient * dP.transpose();
      for (int a = 0; a < N; ++a) product.row(nodes_of(e)[a]) += force.row(a);
    }
}

template <int N>
void TetLawElasticity<N>::add_force(const Points& z, Points& force) {
  if (!std::isfinite(energy_)) {
    force.setConstant(std::numeric_limits<double>::quiet_NaN());
    return;
  }
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e) * points + std::size_t(q)];
      subtract(e, point, point.stress.P, force);
    }
  if (z == lag_) return;
  const Points d = z - lag_;
  add_product(Stiffness::Positive, d, -1.0, force);
}

/// With M's eigenvectors v (the first n of negative values), y = V^T H and D[v] the change of M along v, which is
/// symmetric in all three directions,
///   dM+[A] : H = D[H] A - sum over pairs with a negative one of c_ij y_j v_i (v_i . D[A] v_j),
/// c what the projection leaves out; only D[H] and D[v_1], ..., D[v_n] are needed. The same for changes by q.
template <int N>
auto TetLawElasticity<N>::change_of(int e, std::size_t p, const Points& z, bool by_parameters) const -> PointChange {
  const Point& point = points_[p];
  const PointStress& s = point.stress;
  PointChange change;
  change.by_z = in_world(s, projections_[p].positive);
  change.by_lag = in_world(s, s.tangent) - change.by_z;
  const Matrix3 H = deformation(e, point.gradient, z) - point.F;
  change.stress = s.P + matrix_of(change.by_z * vec(H));
  const auto count = by_parameters ? field_->law()->table().cols() : 0;
  change.by_parameters.resize(9, count);
  std::vector<Matrix3> by_q(std::size_t(count), Matrix3::Zero());
  const auto along = [&](const Matrix3& direction, auto&& column) {
    if (count == 0) return;
    law_->parameter_derivative_changes(e, point.F, direction, by_q);
    for (Eigen::Index k = 0; k < count; ++k) column(k, Vector9(vec(by_q[std::size_t(k)])));
  };
  if (by_parameters) {
    law_->parameter_derivatives(e, point.F, by_q);
    for (Eigen::Index k = 0; k < count; ++k) change.by_parameters.col(k) = vec(by_q[std::size_t(k)]);
  }
  if (H.isZero(0.0)) return change;
  change.by_lag += law_->tangent_derivative(e, point.F, H);
  along(H, [&](Eigen::Index k, const Vector9& m) { change.by_parameters.col(k) += m; });
  const TangentProjection& projection = projections_[p];
  const int negative = projection.negative_count();
  if (negative == 0) return change;
  Matrix9 V;
  for (int i = 0; i < 9; ++i)
    V.col(i) = vec(Matrix3(s.left * matrix_of(projection.vectors.col(i)) * s.right.transpose()));
  const Vector9 y = V.transpose() * vec(H);
  for (int n = 0; n < negative; ++n) {
    // What changes of M between v_n and all v_i amount to: on v_n by the y_i, and on the others by y_n.
    Vector9 of_own, of_others;
    for (int i = 0; i < 9; ++i) {
      const double c = projection.left_out(n, i);
      of_own[i] = c * y[i];
      of_others[i] = i < negative ? 0.0 : c * y[n];
    }
    const Vector9 own = V * of_own;
    const Matrix9 others = V * of_others.asDiagonal() * V.transpose();
    const Matrix3 direction = matrix_of(V.col(n));
    const Matrix9 D = law_->tangent_derivative(e, point.F, direction);
    change.by_lag -= V.col(n) * (D * own).transpose() + others * D;
    along(direction,
          [&](Eigen::Index k, const Vector9& m) { change.by_parameters.col(k) -= V.col(n) * m.dot(own) + others * m; });
  }
  return change;
}

template <int N>
auto TetLawElasticity<N>::changes(const Points& z, bool by_parameters) -> const std::vector<PointChange>& {
  if (has_changes_ && changes_z_ == z && (has_parameter_changes_ || !by_parameters)) return changes_;
  projections();
  changes_.resize(points_.size());
  for_all_points([&](int e, std::size_t p) { changes_[p] = change_of(e, p, z, by_parameters); });
  changes_z_ = z;
  has_changes_ = true;
  has_parameter_changes_ = by_parameters;
  return changes_;
}

template <int N>
void TetLawElasticity<N>::add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) {
  const std::vector<PointChange>& all = changes(z, false);
  add_elements<false>([&](std::size_t p) { return Turned{all[p].by_lag, points_[p].gradient}; }, scale, matrix);
}

template <int N>
void TetLawElasticity<N>::add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z,
                                            const VectorX& d_theta, Points& force) {
  const Points *lag = &d_lag, *at = &d_z;
  prepare_tangents(z, d_theta);
  add_force_tangents(z, {{&lag, 1}, {&at, 1}, d_theta}, {&force, 1});
}

template <int N>
void TetLawElasticity<N>::prepare_tangents(const Points& z, const Eigen::Ref<const MatrixX>& d_theta) {
  if (field_) field_->set_changes(d_theta);
  (void)changes(z, field_ && field_->has_changes());
}

/// Four directions at a time, side by side in the lanes of wide registers.
template <int N>
void TetLawElasticity<N>::add_force_tangents(const Points&, const ForceChanges& along, std::span<Points> forces) {
  constexpr std::size_t lanes = 4;
  const bool by_parameters = field_ && field_->has_changes();
  ElementLanes<N> lag, at, f;
  for (int e = 0; e < body_->element_count(); ++e)
    for (std::size_t first = 0; first < forces.size(); first += lanes) {
      const std::size_t used = std::min(lanes, forces.size() - first);
      gather_lanes<N>(nodes_of(e), along.lag.subspan(first, used), false, lag);
      gather_lanes<N>(nodes_of(e), along.z.subspan(first, used), false, at);
      f.fill(Wide<double>{});
      for (int q = 0; q < points; ++q) {
        const std::size_t p = std::size_t(e) * points + std::size_t(q);
        const Point& point = points_[p];
        const PointChange& own = changes_[p];
        const MatrixLanes d_lag = mean_gradient_lanes<N>(point.gradient, lag);
        const MatrixLanes d_z = mean_gradient_lanes<N>(point.gradient, at);
        MatrixLanes stress{};
        for (std::size_t i = 0; i < 3; ++i)
          for (std::size_t j = 0; j < 3; ++j)
            for (std::size_t k = 0; k < 9; ++k) {
              const auto row = Eigen::Index(3 * j + i), column = Eigen::Index(k / 3 + 3 * (k % 3));  // by `vec`
              stress[3 * i + j] += own.by_lag(row, column) * d_lag[k] + own.by_z(row, column) * d_z[k];
            }
        for (std::size_t l = 0; l < used && by_parameters; ++l) {
          const Vector9 change = own.by_parameters * field_->change(e, along.first + Eigen::Index(first + l));
          for (std::size_t i = 0; i < 3; ++i)
            for (std::size_t j = 0; j < 3; ++j) stress[3 * i + j][l] += change[Eigen::Index(3 * j + i)];
        }
        for (std::size_t a = 0; a < N; ++a) {
          const auto g = point.volume * point.gradient.row(Eigen::Index(a));
          for (std::size_t i = 0; i < 3; ++i)
            f[3 * a + i] += stress[3 * i] * g[0] + stress[3 * i + 1] * g[1] + stress[3 * i + 2] * g[2];
        }
      }
      subtract_lanes<N>(nodes_of(e), f, forces.subspan(first, used));
    }
}

template <int N>
void TetLawElasticity<N>::add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar,
                                            VectorX& theta_bar) {
  const std::vector<PointChange>& all = changes(z, field_ != nullptr);
  if (field_) field_->begin_adjoint();
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const std::size_t p = std::size_t(e) * points + std::size_t(q);
      const Point& point = points_[p];
      const Matrix3 W = deformation(e, point.gradient, w);
      subtract(e, point, matrix_of(all[p].by_lag.transpose() * vec(W)), lag_bar);
      subtract(e, point, matrix_of(all[p].by_z.transpose() * vec(W)), z_bar);
      if (field_) field_->adjoint(e) -= point.volume * all[p].by_parameters.transpose() * vec(W);
    }
  if (field_) field_->end_adjoint(theta_bar);
}

/// With G = sum_b dX_b g_b^T: volumes change by tr(G), deformations by -F G and gradients by -G^T g.
template <int N>
void TetLawElasticity<N>::add_reference_tangents(std::span<const Points* const> d_references,
                                                 std::span<Points* const> forces) {
  const std::vector<PointChange>& all = changes(reference_z_, false);
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const std::size_t p = std::size_t(e) * points + std::size_t(q);
      const Point& point = points_[p];
      const Matrix3 F_z = deformation(e, point.gradient, reference_z_);
      for (std::size_t c = 0; c < forces.size(); ++c)
        subtract(e, point, reference_change(point, all[p], F_z, deformation(e, point.gradient, *d_references[c])),
                 *forces[c]);
    }
}

/// The same for each coordinate of each node: G = e_i g_b^T.
template <int N>
void TetLawElasticity<N>::add_reference_matrix(double scale, BlockMatrix& matrix) {
  const std::vector<PointChange>& all = changes(reference_z_, false);
  for (int e = 0; e < body_->element_count(); ++e) {
    const int* blocks = blocks_->data() + std::size_t(e) * (N * N);
    for (int q = 0; q < points; ++q) {
      const std::size_t p = std::size_t(e) * points + std::size_t(q);
      const Point& point = points_[p];
      const Matrix3 F_z = deformation(e, point.gradient, reference_z_);
      for (int b = 0; b < N; ++b)
        for (int i = 0; i < 3; ++i) {
          const Matrix3 G = Vector3::Unit(i) * point.gradient.row(b);
          const Matrix3 stress = (scale * point.volume) * reference_change(point, all[p], F_z, G);
          for (int a = 0; a < N; ++a)
            Eigen::Map<Matrix3>(matrix.block(blocks[N * a + b])).col(i) -= stress * point.gradient.row(a).transpose();
        }
    }
  }
}

/// The transpose of the above.
template <int N>
void TetLawElasticity<N>::add_reference_adjoint(const Points& w, Points& reference_bar) {
  const std::vector<PointChange>& all = changes(reference_z_, false);
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const std::size_t p = std::size_t(e) * points + std::size_t(q);
      const Point& point = points_[p];
      const Matrix3 W = deformation(e, point.gradient, w), F_z = deformation(e, point.gradient, reference_z_);
      const Matrix3 G_bar = all[p].stress.cwiseProduct(W).sum() * Matrix3::Identity() - W.transpose() * all[p].stress -
                            point.F.transpose() * matrix_of(all[p].by_lag.transpose() * vec(W)) -
                            F_z.transpose() * matrix_of(all[p].by_z.transpose() * vec(W));
      subtract(e, point, G_bar, reference_bar);
    }
}

}  // namespace

namespace {

template <class... Arguments>
std::unique_ptr<LawElasticity> make_for(const std::shared_ptr<const Body>& body, Arguments&&... arguments) {
  if (body->kind == ElementKind::Tetrahedron)
    return std::make_unique<TetLawElasticity<4>>(body, std::forward<Arguments>(arguments)...);
  if (body->kind == ElementKind::QuadraticTetrahedron)
    return std::make_unique<TetLawElasticity<10>>(body, std::forward<Arguments>(arguments)...);
  throw std::invalid_argument("material laws are for tetrahedra");
}

}  // namespace

std::unique_ptr<LawElasticity> LawElasticity::make(const std::shared_ptr<const Body>& body,
                                                   std::shared_ptr<const MaterialLaw> law,
                                                   const std::shared_ptr<const BlockPattern>& pattern) {
  if (!law) throw std::invalid_argument("a material at quadrature points needs a law");
  if (law->element_count() != body->element_count())
    throw std::invalid_argument("the material has another number of elements than the body");
  return make_for(body, std::move(law), pattern);
}

std::unique_ptr<LawElasticity> LawElasticity::make(const std::shared_ptr<const Body>& body, const LawLayout& layout) {
  return make_for(body, layout);
}

double mean_modulus(const Body& body, const MaterialLaw& law) {
  double sum = 0.0, volume = 0.0;
  for (int e = 0; e < body.element_count(); ++e) {
    sum += body.element_volume[std::size_t(e)] * law.small_strain(e).youngs_modulus;
    volume += body.element_volume[std::size_t(e)];
  }
  return sum / volume;
}

}  // namespace pliant
