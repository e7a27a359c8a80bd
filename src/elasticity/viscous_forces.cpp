#include "elasticity/viscous_forces.hpp"

#include <stdexcept>

#include "elasticity/local_stiffness.hpp"
#include "elasticity/reference_forces.hpp"

namespace pliant {

namespace {

using element_vector::node;

template <int N>
class ViscousForces : public ForceTerm {
 public:
  ViscousForces(std::shared_ptr<const Body> body, const MaterialBlocks& material, ParameterHandle stiffness_damping)
      : body_(std::move(body)),
        material_(material),
        damping_block_(stiffness_damping),
        modulus_(body_, material),
        stiffness_(body_),
        gradients_(body_) {}

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  bool sees_start() const override { return true; }
  bool sees_way_alone() const override { return true; }

  void set_parameters(const VectorX& theta) override;
  void begin_step(const StepContext& step) override { step_ = step, has_strained_ = false; }
  void linearise(const Points& lag) override;
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void prepare_tangents(const Points& z, const Eigen::Ref<const MatrixX>& d_theta) override;
  void add_force_tangents(const Points& z, const ForceChanges& changes, std::span<Points> forces) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;
  void add_start_tangent(const Points& z, const Points& d_start, const Points& d_start_velocity,
                         Points& force) override;
  void add_start_adjoint(const Points& z, const Points& w, Points& start_bar, Points& start_velocity_bar) override;
  void set_reference(const std::shared_ptr<const Body>& body) override;
  void linearise_reference(const Points& z) override;
  void add_reference_tangents(std::span<const Points* const> d_references, std::span<Points* const> forces) override;
  void add_reference_adjoint(const Points& w, Points& reference_bar) override;

 private:
  using Vector = Eigen::Matrix<double, 3 * N, 1>;
  const int* nodes_of(int element) const { return body_->connectivity.data() + std::size_t(element) * N; }
  auto shape_gradients(int element) const { return body_->mean_gradient.middleRows<N>(Eigen::Index(element) * N); }
  int count() const { return int(gradients_.size()); }
  bool is_active() const { return step_.start && damping_ > 0.0; }
  double rate() const { return damping_ / step_.dt; }
  /// The element's nodes' numbers of some points.
  Vector gathered(int element, const Points& points) const {
    Vector local;
    for (int a = 0; a < N; ++a) node(local, a) = points.row(nodes_of(element)[a]).transpose();
    return local;
  }
  /// A^T v node by node.
  static Vector turned(const Matrix3& A, const Vector& v) {
    Vector local;
    for (int a = 0; a < N; ++a) node(local, a).noalias() = A.transpose() * node(v, a);
    return local;
  }
  void scatter(int element, double factor, const Matrix3& A, const Vector& v, Points& out) const {
    for (int a = 0; a < N; ++a) out.row(nodes_of(element)[a]).noalias() += factor * (A * node(v, a)).transpose();
  }
  /// The way of the element's nodes in the step so far.
  Vector way(int element, const Points& z) const { return gathered(element, z) - gathered(element, *step_.start); }

  std::shared_ptr<const Body> body_;
  MaterialBlocks material_;
  ParameterHandle damping_block_;
  ElementModuli modulus_;
  double poissons_ratio_ = -2.0, damping_ = 0.0;
  LocalStiffness<N> stiffness_;
  /// What both products need of each element, once for all directions of a step.
  struct Strained {
    Vector way, turned, stress;  // s = z - x0, u = F^T s, K u
  };
  const std::vector<Strained>& strained(const Points& z) {
    if (has_strained_ && strained_at_ == z) return strained_;
    strained_.resize(gradients_.size());
    for (int e = 0; e < count(); ++e) {
      Strained& own = strained_[std::size_t(e)];
      own.way = way(e, z);
      own.turned = turned(gradients_[std::size_t(e)], own.way);
      own.stress = stiffness_.times(e, own.turned);
    }
    strained_at_ = z;
    has_strained_ = true;
    return strained_;
  }
  MeanGradients<N> gradients_;  // of the lag point
  std::vector<Strained> strained_;
  Points strained_at_;
  bool has_strained_ = false;
  StepContext step_;
  std::unique_ptr<ReferenceForces> by_reference_;  // where the reference was set
};

template <int N>
void ViscousForces<N>::set_parameters(const VectorX& theta) {
  step_ = {};
  has_strained_ = false;
  modulus_.set_parameters(theta);
  damping_ = theta[damping_block_];
  if (by_reference_) by_reference_->set_parameters(theta);
  const double nu = theta[material_.poissons_ratio];
  if (nu == poissons_ratio_) return;
  poissons_ratio_ = nu;
  stiffness_.set_poissons_ratio(nu);
}

template <int N>
void ViscousForces<N>::linearise(const Points& lag) {
  has_strained_ = false;
  if (!is_active()) return;
  gradients_.set_field(lag);
}

template <int N>
void ViscousForces<N>::add_force(const Points& z, Points& force) {
  if (!is_active()) return;
  body_->loop->each([&](int e) {
    const Matrix3& F = gradients_[std::size_t(e)];
    scatter(e, -rate() * modulus_[e], F, stiffness_.times(e, turned(F, way(e, z))), force);
  });
}

template <int N>
void ViscousForces<N>::add_matrix(double scale, BlockMatrix& matrix) {
  if (!is_active()) return;
  body_->loop->each([&](int e) {
    stiffness_.add_transformed(e, gradients_[std::size_t(e)], scale * rate() * modulus_[e],
                               body_->blocks->data() + std::size_t(e) * (N * N), matrix);
  });
}

/// A change dp changes F by dp_b g_b^T, and with s = z - x0, y = K F^T s the force by
///   - beta/dt ((g_b . y_a) dp_b + F sum_c K_ac g_b (s_c . dp_b)).
template <int N>
void ViscousForces<N>::add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) {
  if (!is_active()) return;
  for (int e = 0; e < count(); ++e) {
    const Matrix3& F = gradients_[std::size_t(e)];
    const Vector s = way(e, z);
    const Vector y = stiffness_.times(e, turned(F, s));
    const double factor = scale * rate() * modulus_[e];
    const auto g = shape_gradients(e);
    const int* blocks = body_->blocks->data() + std::size_t(e) * (N * N);
    for (int b = 0; b < N; ++b) {
      const Vector3 g_b = g.row(b);
      for (int d = 0; d < 3; ++d) {
        Vector by;
        for (int c = 0; c < N; ++c) node(by, c) = g_b * node(s, c)[d];
        const Vector change = stiffness_.times(e, by);
        for (int a = 0; a < N; ++a) {
          Eigen::Map<Matrix3> block(matrix.block(blocks[N * a + b]));
          block.col(d).noalias() += factor * (F * node(change, a));
          block(d, d) += factor * g_b.dot(node(y, a));
        }
      }
    }
  }
}

template <int N>
void ViscousForces<N>::add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z,
                                         const VectorX& d_theta, Points& force) {
  const Points *lag = &d_lag, *at = &d_z;
  prepare_tangents(z, d_theta);
  add_force_tangents(z, {{&lag, 1}, {&at, 1}, d_theta}, {&force, 1});
}

template <int N>
void ViscousForces<N>::prepare_tangents(const Points& z, const Eigen::Ref<const MatrixX>& d_theta) {
  if (!step_.start) return;
  modulus_.set_changes(d_theta);
  (void)strained(z);
}

/// Four directions at a time, side by side in the lanes of wide registers:
///   -df = E / dt (beta dF y + F (beta dy + d_beta y)),  dy = K (dF^T s + F^T dz) + d_nu (dK / d nu) u + d_lnE y.
template <int N>
void ViscousForces<N>::add_force_tangents(const Points&, const ForceChanges& changes, std::span<Points> forces) {
  if (!step_.start) return;
  const auto d_nus = changes.theta.row(Eigen::Index(material_.poissons_ratio));
  const bool changes_nu = (d_nus.array() != 0.0).any();
  ElementLanes<N> lag, f, du, dy;
  for (int e = 0; e < count(); ++e) {
    const int* nodes = body_->connectivity.data() + std::size_t(e) * N;
    const Matrix3& F = gradients_[std::size_t(e)];
    const auto g = shape_gradients(e);
    const auto& [s, u, y] = strained_[std::size_t(e)];
    Vector by_nu = Vector::Zero();
    if (changes_nu) by_nu = stiffness_.derivative_times(e, u);
    const double factor = modulus_[e] / step_.dt;
    for (std::size_t first = 0; first < forces.size(); first += 4) {
      const std::size_t used = std::min<std::size_t>(4, forces.size() - first);
      Wide<double> d_log{}, d_nu{}, d_damping{};
      for (std::size_t l = 0; l < used; ++l) {
        const auto c = Eigen::Index(first + l);
        d_log[l] = modulus_.log_change(e, changes.first + c), d_nu[l] = d_nus[c];
        d_damping[l] = changes.theta(Eigen::Index(damping_block_), c);
      }
      gather_lanes<N>(nodes, changes.lag.subspan(first, used), false, lag);
      gather_lanes<N>(nodes, changes.z.subspan(first, used), false, f);
      const MatrixLanes dF = mean_gradient_lanes<N>(g, lag);
      for (std::size_t a = 0; a < N; ++a)
        for (std::size_t j = 0; j < 3; ++j) {
          const auto c = Eigen::Index(j);
          du[3 * a + j] = F(0, c) * f[3 * a] + F(1, c) * f[3 * a + 1] + F(2, c) * f[3 * a + 2] +
                          dF[j] * s[Eigen::Index(3 * a)] + dF[3 + j] * s[Eigen::Index(3 * a + 1)] +
                          dF[6 + j] * s[Eigen::Index(3 * a + 2)];
        }
      stiffness_.times(e, du, dy);
      for (std::size_t a = 0; a < N; ++a) {
        const double *ya = y.data() + 3 * a, *na = by_nu.data() + 3 * a;
        Wide<double> local[3];
        for (std::size_t j = 0; j < 3; ++j)
          local[j] = damping_ * (dy[3 * a + j] + d_log * ya[j] + d_nu * na[j]) + d_damping * ya[j];
        for (std::size_t i = 0; i < 3; ++i) {
          const auto r = Eigen::Index(i);
          f[3 * a + i] = factor * (F(r, 0) * local[0] + F(r, 1) * local[1] + F(r, 2) * local[2] +
                                   damping_ * (dF[3 * i] * ya[0] + dF[3 * i + 1] * ya[1] + dF[3 * i + 2] * ya[2]));
        }
      }
      subtract_lanes<N>(nodes, f, forces.subspan(first, used));
    }
  }
}

template <int N>
void ViscousForces<N>::add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar,
                                         VectorX& theta_bar) {
  if (!step_.start) return;
  modulus_.begin_adjoint();
  const std::vector<Strained>& all = strained(z);
  for (int e = 0; e < count(); ++e) {
    const Matrix3& F = gradients_[std::size_t(e)];
    const auto& [s, u, y] = all[std::size_t(e)];
    const Vector w_e = gathered(e, w), c = turned(F, w_e), k = stiffness_.times(e, c);
    const double factor = rate() * modulus_[e], work = c.dot(y);
    scatter(e, -factor, F, k, z_bar);
    Matrix3 F_bar = Matrix3::Zero();
    for (int a = 0; a < N; ++a)
      F_bar.noalias() += node(w_e, a) * node(y, a).transpose() + node(s, a) * node(k, a).transpose();
    const auto g = shape_gradients(e);
    for (int a = 0; a < N; ++a)
      lag_bar.row(nodes_of(e)[a]).noalias() -= factor * (F_bar * g.row(a).transpose()).transpose();
    modulus_.add_log_adjoint(e, -factor * work);
    theta_bar[damping_block_] -= modulus_[e] / step_.dt * work;
    theta_bar[material_.poissons_ratio] -= factor * c.dot(stiffness_.derivative_times(e, u));
  }
  modulus_.end_adjoint(theta_bar);
}

template <int N>
void ViscousForces<N>::add_start_tangent(const Points&, const Points& d_start, const Points&, Points& force) {
  if (!is_active()) return;
  for (int e = 0; e < count(); ++e) {
    const Matrix3& F = gradients_[std::size_t(e)];
    scatter(e, rate() * modulus_[e], F, stiffness_.times(e, turned(F, gathered(e, d_start))), force);
  }
}

template <int N>
void ViscousForces<N>::add_start_adjoint(const Points&, const Points& w, Points& start_bar, Points&) {
  if (!is_active()) return;
  for (int e = 0; e < count(); ++e) {
    const Matrix3& F = gradients_[std::size_t(e)];
    scatter(e, rate() * modulus_[e], F, stiffness_.times(e, turned(F, gathered(e, w))), start_bar);
  }
}

template <int N>
void ViscousForces<N>::set_reference(const std::shared_ptr<const Body>& body) {
  has_strained_ = false;
  body_ = body;
  stiffness_ = LocalStiffness<N>(body_);
  poissons_ratio_ = -2.0;
  gradients_ = MeanGradients<N>(body_);
  if (!by_reference_) by_reference_ = ReferenceForces::make_viscous(body_, material_, damping_block_);
}

template <int N>
void ViscousForces<N>::linearise_reference(const Points& z) {
  if (!by_reference_ || !is_active()) return;
  const Points velocity = (z - *step_.start) / step_.dt;
  if (!by_reference_->linearise(body_->reference_positions(), gradients_.field(), velocity))
    throw std::logic_error("the reference has elements inside out");
}

template <int N>
void ViscousForces<N>::add_reference_tangents(std::span<const Points* const> d_references,
                                              std::span<Points* const> forces) {
  if (by_reference_ && is_active()) by_reference_->add_tangents(d_references, forces);
}

template <int N>
void ViscousForces<N>::add_reference_adjoint(const Points& w, Points& reference_bar) {
  if (by_reference_ && is_active()) by_reference_->add_adjoint(w, reference_bar);
}

}  // namespace

std::unique_ptr<ForceTerm> make_viscous_forces(std::shared_ptr<const Body> body, const MaterialBlocks& blocks,
                                               ParameterHandle stiffness_damping) {
  return with_node_count(*body, [&]<int N>() -> std::unique_ptr<ForceTerm> {
    return std::make_unique<ViscousForces<N>>(body, blocks, stiffness_damping);
  });
}

}  // namespace pliant
