#include "elasticity/corotated.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "elasticity/local_stiffness.hpp"
#include "elasticity/material_law.hpp"
#include "elasticity/reference_forces.hpp"

namespace pliant {

namespace {

using element_vector::node;

template <int N>
class CorotatedElasticity : public Elasticity {
 public:
  CorotatedElasticity(std::shared_ptr<const Body> body, const MaterialBlocks& material, ElasticLaw law);

  void set_parameters(const VectorX& theta) override;
  void linearise(const Points& lag) override;
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void prepare_tangents(const Points& z, const Eigen::Ref<const MatrixX>& d_theta) override;
  void add_force_tangents(const Points& z, const ForceChanges& changes, std::span<Points> forces) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;
  void set_reference(const std::shared_ptr<const Body>& body) override;
  void linearise_reference(const Points& z) override;
  void add_reference_tangents(std::span<const Points* const> d_references, std::span<Points* const> forces) override;
  void add_reference_adjoint(const Points& w, Points& reference_bar) override;
  double energy(const Points& z) const override;
  Matrix3 cauchy_stress(int element) const override;
  double tangent_modulus(int element) const override;

 private:
  using Vector = Eigen::Matrix<double, 3 * N, 1>;
  const int* nodes_of(int element) const { return body_->connectivity.data() + std::size_t(element) * N; }
  const int* blocks_of(int element) const { return body_->blocks->data() + std::size_t(element) * (N * N); }
  Eigen::Matrix<double, N, 3> gradients(int element) const {
    return body_->mean_gradient.middleRows<N>(Eigen::Index(element) * N);
  }
  int count() const { return int(polar_.size()); }
  /// R^T z for the element's nodes, relative to the first.
  Vector unrotated(int element, const Points& z) const;
  bool is_corrected() const { return law_ == ElasticLaw::NeoHookean; }
  /// Change of an element's mean deformation from the lag point to z.
  Matrix3 ahead(int element, const Points& z) const {
    return mean_gradient(element, z) - gradients_[std::size_t(element)];
  }
  MeanStrainCorrection correction(int element) const {
    return {gradients_[std::size_t(element)], polar_[std::size_t(element)], lame_};
  }
  double volume(int element) const { return body_->element_volume[std::size_t(element)]; }
  /// force -= factor V P g
  void subtract_stress(int element, double factor, const Matrix3& P, Points& force) const {
    const Eigen::Matrix<double, N, 3> own = factor * volume(element) * gradients(element) * P.transpose();
    for (int a = 0; a < N; ++a) force.row(nodes_of(element)[a]) -= own.row(a);
  }
  Matrix3 mean_gradient(int element, const Points& points) const {
    return pliant::mean_gradient<N>(*body_, element, points);
  }

  /// What tangents need of each element, once for all directions at z.
  struct Strained {
    Vector unrotated, displacement, stress;  // q = R^T z, d = q - X, K d
  };
  /// Adds to P the changes of the mean strain's stress, lane by lane.
  /// @param first  direction of the first lane
  void add_mean_stress(int element, const Matrix3& H, const MeanStrainCorrection& mean, const MatrixLanes& dF,
                       const MatrixLanes& dz, const ForceChanges& changes, Eigen::Index first, MatrixLanes& P) const;

  std::shared_ptr<const Body> body_;
  MaterialBlocks material_;
  ElasticLaw law_;
  ElementModuli modulus_;
  double poissons_ratio_ = -2.0;
  UnitLame lame_ = {};
  LocalStiffness<N> stiffness_;
  MeanGradients<N> gradients_;                     // of the lag point
  RelativePositions<N> reference_;                 // X of the element's nodes, relative to the first
  std::unique_ptr<ReferenceForces> by_reference_;  // where the reference was set
  std::vector<Strained> strained_;
  Points strained_at_;
  bool has_strained_ = false;
};

template <int N>
CorotatedElasticity<N>::CorotatedElasticity(std::shared_ptr<const Body> body, const MaterialBlocks& material,
                                            ElasticLaw law)
    : body_(std::move(body)),
      material_(material),
      law_(law),
      modulus_(body_, material),
      stiffness_(body_),
      gradients_(body_),
      reference_(body_) {
  polar_.resize(std::size_t(body_->element_count()));
}

template <int N>
void CorotatedElasticity<N>::set_parameters(const VectorX& parameters) {
  has_strained_ = false;
  // Rotations start from those of the step before; a run must not start from those of the run before.
  std::ranges::fill(polar_, Polar{});
  modulus_.set_parameters(parameters);
  if (by_reference_) by_reference_->set_parameters(parameters);
  const double nu = parameters[material_.poissons_ratio];
  if (nu == poissons_ratio_) return;
  poissons_ratio_ = nu;
  lame_ = unit_lame(nu);
  stiffness_.set_poissons_ratio(nu);
}

template <int N>
Matrix3 CorotatedElasticity<N>::cauchy_stress(int e) const {
  const Matrix3 strain = polar_[e].S - Matrix3::Identity();
  const Matrix3 linear = lame_.lambda * strain.trace() * Matrix3::Identity() + 2.0 * lame_.mu * strain;
  Matrix3 first = polar_[e].R * linear;
  if (is_corrected()) first += correction(e).stress();
  const Matrix3 F = gradients_[std::size_t(e)];
  return modulus_[e] / F.determinant() * first * F.transpose();
}

template <int N>
double CorotatedElasticity<N>::tangent_modulus(int e) const {
  if (!is_corrected()) return modulus_[e];
  const MeanStrainCorrection mean = correction(e);
  Matrix9 tangent;
  for (int k = 0; k < 9; ++k) {
    Matrix3 dF = Matrix3::Zero();
    dF(k % 3, k / 3) = 1.0;
    tangent.col(k) = vec(mean.law_tangent(dF));
  }
  return modulus_[e] * pliant::tangent_modulus(tangent, polar_[std::size_t(e)]);
}

template <int N>
void CorotatedElasticity<N>::set_reference(const std::shared_ptr<const Body>& body) {
  has_strained_ = false;
  body_ = body;
  stiffness_ = LocalStiffness<N>(body_);
  poissons_ratio_ = -2.0;
  gradients_ = MeanGradients<N>(body_);
  reference_ = RelativePositions<N>(body_);
  if (!by_reference_) by_reference_ = ReferenceForces::make(body_, material_, law_);
}

template <int N>
void CorotatedElasticity<N>::linearise_reference(const Points& z) {
  if (by_reference_ && !by_reference_->linearise(body_->reference_positions(), gradients_.field(), z))
    throw std::logic_error("the reference has elements inside out");
}

template <int N>
void CorotatedElasticity<N>::add_reference_tangents(std::span<const Points* const> d_references,
                                                    std::span<Points* const> forces) {
  if (by_reference_) by_reference_->add_tangents(d_references, forces);
}

template <int N>
void CorotatedElasticity<N>::add_reference_adjoint(const Points& w, Points& reference_bar) {
  if (by_reference_) by_reference_->add_adjoint(w, reference_bar);
}

template <int N>
void CorotatedElasticity<N>::prepare_tangents(const Points& z, const Eigen::Ref<const MatrixX>& d_theta) {
  modulus_.set_changes(d_theta);
  if (has_strained_ && strained_at_ == z) return;
  strained_.resize(polar_.size());
  for (int e = 0; e < count(); ++e) {
    Strained& own = strained_[std::size_t(e)];
    own.unrotated = unrotated(e, z);
    own.displacement = own.unrotated - reference_[std::size_t(e)];
    own.stress = stiffness_.times(e, own.displacement);
  }
  strained_at_ = z;
  has_strained_ = true;
}

template <int N>
void CorotatedElasticity<N>::linearise(const Points& lag) {
  has_strained_ = false;
  gradients_.set_field(lag);
  constexpr std::size_t at_once = 64;
  for_parts(Parts(polar_.size()), [&](std::size_t first, std::size_t last) {
    std::array<Matrix3, at_once> F;
    for (; first < last; first += at_once) {
      const std::size_t own = std::min(at_once, last - first);
      for (std::size_t i = 0; i < own; ++i) F[i] = gradients_[first + i];
      polar_decompositions(std::span(F).first(own), std::span(polar_).subspan(first, own));
    }
  });
}

template <int N>
auto CorotatedElasticity<N>::unrotated(int e, const Points& z) const -> Vector {
  const int* nodes = nodes_of(e);
  const Matrix3 Rt = polar_[e].R.transpose();
  const Vector3 first = z.row(nodes[0]);
  Vector local;
  for (int a = 0; a < N; ++a) node(local, a).noalias() = Rt * (z.row(nodes[a]).transpose() - first);
  return local;
}

template <int N>
void CorotatedElasticity<N>::add_force(const Points& z, Points& force) {
  body_->loop->each([&](int e) {
    const int* nodes = nodes_of(e);
    const Vector d = unrotated(e, z) - reference_[e];
    const Vector y = stiffness_.times(e, d);
    const Matrix3 R = modulus_[e] * polar_[e].R;
    for (int a = 0; a < N; ++a) force.row(nodes[a]).noalias() -= (R * node(y, a)).transpose();
    if (is_corrected()) subtract_stress(e, modulus_[e], correction(e).stress(ahead(e, z)), force);
  });
}

template <int N>
double CorotatedElasticity<N>::energy(const Points& z) const {
  return sum_parts(Parts(polar_.size()), [&](std::size_t first, std::size_t last) {
    double sum = 0.0;
    for (int e = int(first); e < int(last); ++e) {
      const Vector d = unrotated(e, z) - reference_[e];
      sum += 0.5 * modulus_[e] * d.dot(stiffness_.times(e, d));
      if (is_corrected()) sum += modulus_[e] * volume(e) * correction(e).energy();
    }
    return sum;
  });
}

template <int N>
void CorotatedElasticity<N>::add_matrix(double scale, BlockMatrix& matrix) {
  const ElementLoop& loop = *body_->loop;
  loop.each([&](int e) { stiffness_.add_rotated(e, polar_[e].R, scale * modulus_[e], blocks_of(e), matrix); });
  if (!is_corrected()) return;
  loop.each([&](int e) {
    const MeanStrainCorrection mean = correction(e);
    const auto g = gradients(e);
    const Eigen::Matrix<double, N, 3> h = g * mean.cofactors().transpose();
    const double factor = scale * modulus_[e] * volume(e);
    const Eigen::Matrix<double, N, N> products = (factor * mean.diagonal()) * (g * g.transpose());
    const int* blocks = blocks_of(e);
    for (int a = 0; a < N; ++a)
      for (int b = 0; b < N; ++b) {
        Eigen::Map<Matrix3> block(matrix.block(blocks[N * a + b]));
        block.noalias() += (factor * mean.factor()) * h.row(a).transpose() * h.row(b);
        block.diagonal().array() += products(a, b);
      }
  });
}

/// A change dp turns the element by w = sum_b W_b dp_b, W_b = (tr(S) I - S)^-1 [g_b]x R^T, and the force changes by
/// -R G_a w, G_a = sum_b K_ab [q_b]x - [y_a]x with q = R^T z, y = K (q - X).
template <int N>
void CorotatedElasticity<N>::add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) {
  for (int e = 0; e < count(); ++e) {
    const Vector q = unrotated(e, z);
    const Vector y = stiffness_.times(e, q - reference_[e]);
    Eigen::Matrix<double, 3 * N, 3> Q, G;
    for (int a = 0; a < N; ++a) Q.template middleRows<3>(3 * a) = cross_matrix(node(q, a));
    for (int d = 0; d < 3; ++d) G.col(d) = stiffness_.times(e, Q.col(d));
    const Matrix3 R = polar_[e].R;
    for (int a = 0; a < N; ++a)
      G.template middleRows<3>(3 * a) =
          (scale * modulus_[e]) * R * (G.template middleRows<3>(3 * a) - cross_matrix(node(y, a)));
    const auto g = gradients(e);
    const int* blocks = blocks_of(e);
    for (int b = 0; b < N; ++b) {
      const Matrix3 W = polar_[e].rate_inverse * cross_matrix(g.row(b).transpose()) * R.transpose();
      for (int a = 0; a < N; ++a)
        Eigen::Map<Matrix3>(matrix.block(blocks[N * a + b])).noalias() += G.template middleRows<3>(3 * a) * W;
    }
    if (!is_corrected()) continue;
    const MeanStrainCorrection mean = correction(e);
    const Matrix3 H = ahead(e, z);
    for (int b = 0; b < N; ++b)
      for (int d = 0; d < 3; ++d) {
        const Matrix3 dF = Vector3::Unit(d) * g.row(b);
        const Matrix3 dP = (scale * modulus_[e] * volume(e)) * mean.tangent(H, dF, -dF);
        for (int a = 0; a < N; ++a)
          Eigen::Map<Matrix3>(matrix.block(blocks[N * a + b])).col(d).noalias() += dP * g.row(a).transpose();
      }
  }
}

template <int N>
void CorotatedElasticity<N>::add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z,
                                               const VectorX& d_theta, Points& force) {
  const Points *lag = &d_lag, *at = &d_z;
  prepare_tangents(z, d_theta);
  add_force_tangents(z, {{&lag, 1}, {&at, 1}, d_theta}, {&force, 1});
}

template <int N>
void CorotatedElasticity<N>::add_mean_stress(int e, const Matrix3& H, const MeanStrainCorrection& mean,
                                             const MatrixLanes& dF, const MatrixLanes& dz, const ForceChanges& changes,
                                             Eigen::Index first, MatrixLanes& P) const {
  const Eigen::Index count = std::min<Eigen::Index>(4, changes.theta.cols() - first);
  for (Eigen::Index l = 0; l < count; ++l) {
    Matrix3 own, ahead;
    for (std::size_t k = 0; k < 9; ++k) {
      const auto i = Eigen::Index(k / 3), j = Eigen::Index(k % 3);
      own(i, j) = dF[k][l], ahead(i, j) = dz[k][l] - dF[k][l];
    }
    Matrix3 dP = mean.tangent(H, own, ahead) + modulus_.log_change(e, changes.first + first + l) * mean.stress(H);
    const double d_nu = changes.theta(Eigen::Index(material_.poissons_ratio), first + l);
    if (d_nu != 0.0) dP += d_nu * mean.by_poissons_ratio(H);
    for (std::size_t k = 0; k < 9; ++k) P[k][l] = dP(Eigen::Index(k / 3), Eigen::Index(k % 3));
  }
}

/// Four directions at a time, side by side in the lanes of wide registers.
template <int N>
void CorotatedElasticity<N>::add_force_tangents(const Points& z, const ForceChanges& changes,
                                                std::span<Points> forces) {
  const auto d_nus = changes.theta.row(Eigen::Index(material_.poissons_ratio));
  const bool changes_nu = (d_nus.array() != 0.0).any();
  ElementLanes<N> lag, dd, dy, f;
  for (int e = 0; e < count(); ++e) {
    const int* nodes = nodes_of(e);
    const auto g = gradients(e);
    const Matrix3& R = polar_[e].R;
    const double E = modulus_[e];
    const auto& [q, d, y] = strained_[std::size_t(e)];
    Vector by_nu = Vector::Zero();
    if (changes_nu) by_nu = stiffness_.derivative_times(e, d);
    std::optional<MeanStrainCorrection> mean;
    if (is_corrected()) mean.emplace(correction(e));
    const Matrix3 H = mean ? ahead(e, z) : Matrix3::Zero();
    for (std::size_t first = 0; first < forces.size(); first += 4) {
      const std::size_t used = std::min<std::size_t>(4, forces.size() - first);
      Wide<double> d_log{}, d_nu{};
      for (std::size_t l = 0; l < used; ++l) {
        d_log[l] = modulus_.log_change(e, changes.first + Eigen::Index(first + l));
        d_nu[l] = d_nus[Eigen::Index(first + l)];
      }
      gather_lanes<N>(nodes, changes.lag.subspan(first, used), false, lag);
      gather_lanes<N>(nodes, changes.z.subspan(first, used), true, f);
      const MatrixLanes dF = mean_gradient_lanes<N>(g, lag);
      const std::array<Wide<double>, 3> w = rotation_rate_lanes(polar_[e], dF);
      // dd = R^T dz - w x q
      for (std::size_t a = 0; a < N; ++a) {
        const double* qa = q.data() + 3 * a;
        const Wide<double>* za = f.data() + 3 * a;
        for (int i = 0; i < 3; ++i) dd[3 * a + std::size_t(i)] = R(0, i) * za[0] + R(1, i) * za[1] + R(2, i) * za[2];
        dd[3 * a] -= w[1] * qa[2] - w[2] * qa[1];
        dd[3 * a + 1] -= w[2] * qa[0] - w[0] * qa[2];
        dd[3 * a + 2] -= w[0] * qa[1] - w[1] * qa[0];
      }
      MatrixLanes P{};
      if (mean) add_mean_stress(e, H, *mean, dF, mean_gradient_lanes<N>(g, f), changes, Eigen::Index(first), P);
      stiffness_.times(e, dd, dy);
      // -df = E (R (w x y + dy) + V P g)
      const double volume = mean ? this->volume(e) : 0.0;
      for (std::size_t a = 0; a < N; ++a) {
        const double *ya = y.data() + 3 * a, *na = by_nu.data() + 3 * a;
        const auto row = Eigen::Index(a);
        const Wide<double> local[3] = {w[1] * ya[2] - w[2] * ya[1] + dy[3 * a] + d_log * ya[0] + d_nu * na[0],
                                       w[2] * ya[0] - w[0] * ya[2] + dy[3 * a + 1] + d_log * ya[1] + d_nu * na[1],
                                       w[0] * ya[1] - w[1] * ya[0] + dy[3 * a + 2] + d_log * ya[2] + d_nu * na[2]};
        for (std::size_t i = 0; i < 3; ++i) {
          const auto r = Eigen::Index(i);
          f[3 * a + i] = E * (R(r, 0) * local[0] + R(r, 1) * local[1] + R(r, 2) * local[2]);
          if (mean)
            f[3 * a + i] += (E * volume) * (P[3 * i] * g(row, 0) + P[3 * i + 1] * g(row, 1) + P[3 * i + 2] * g(row, 2));
        }
      }
      subtract_lanes<N>(nodes, f, forces.subspan(first, used));
    }
  }
}

template <int N>
void CorotatedElasticity<N>::add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar,
                                               VectorX& theta_bar) {
  modulus_.begin_adjoint();
  for (int e = 0; e < count(); ++e) {
    const int* nodes = nodes_of(e);
    const Matrix3& R = polar_[e].R;
    const double E = modulus_[e];
    const Vector q = unrotated(e, z);
    const Vector d = q - reference_[e];
    Vector c;
    for (int a = 0; a < N; ++a) node(c, a).noalias() = R.transpose() * w.row(nodes[a]).transpose();
    const ReverseProducts<N> products = stiffness_.reverse(e, q, d, c);
    // rotation_rate_adjoint(polar, E turn) g_a = E R (v x g_a)
    const Vector3 v = polar_[e].rate_inverse.transpose() * products.turn;
    const Matrix3 ER = E * R;
    const auto g = gradients(e);
    for (int a = 0; a < N; ++a) {
      const Vector3 g_a = g.row(a);
      z_bar.row(nodes[a]).noalias() -= (ER * node(products.k, a)).transpose();
      lag_bar.row(nodes[a]).noalias() += (ER * v.cross(g_a)).transpose();
    }
    modulus_.add_log_adjoint(e, -E * products.work);
    theta_bar[material_.poissons_ratio] -= E * products.d_work;
    if (!is_corrected()) continue;
    const MeanStrainCorrection mean = correction(e);
    const Matrix3 W = mean_gradient(e, w), H = ahead(e, z);
    const MeanStrainCorrection::Cotangents bar = mean.adjoint(H, W);
    subtract_stress(e, E, bar.F - bar.H, lag_bar);
    subtract_stress(e, E, bar.H, z_bar);
    modulus_.add_log_adjoint(e, -E * volume(e) * W.cwiseProduct(mean.stress(H)).sum());
    theta_bar[material_.poissons_ratio] -= E * volume(e) * W.cwiseProduct(mean.by_poissons_ratio(H)).sum();
  }
  modulus_.end_adjoint(theta_bar);
}

}  // namespace

std::unique_ptr<Elasticity> make_elasticity(std::shared_ptr<const Body> body, const MaterialBlocks& blocks,
                                            ElasticLaw law) {
  return with_node_count(*body, [&]<int N>() -> std::unique_ptr<Elasticity> {
    return std::make_unique<CorotatedElasticity<N>>(body, blocks, law);
  });
}

}  // namespace pliant
