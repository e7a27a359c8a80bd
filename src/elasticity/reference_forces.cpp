#include "elasticity/reference_forces.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <stdexcept>

#include "elasticity/local_stiffness.hpp"
#include "mesh/tet_shape.hpp"

namespace pliant {

namespace {

/// Where lanes have entry (i, j) of a matrix, or coordinate j of node i.
constexpr std::size_t entry(int i, int j) { return 3 * std::size_t(i) + std::size_t(j); }

/// What carries stresses from an element's frame into the world, A in
///   f_a = -A integral of E C : (A^T grad z - B) g_a.
enum class Frame {
  Rotation,     ///< the rotation R of p; B = I
  Deformation,  ///< the deformation F of p itself; B = 0
};

template <int N, Frame kind>
class TetReferenceForces : public ReferenceForces {
 public:
  /// @param law      of the mean strain
  /// @param damping  what E is multiplied by, where there is one
  TetReferenceForces(std::shared_ptr<const Body> body, const MaterialBlocks& material, ElasticLaw law,
                     std::optional<ParameterHandle> damping = {});

  void set_parameters(const VectorX& theta) override;
  bool linearise(const Points& X, const Points& p, const Points& z) override;
  void add_force(Points& force) const override;
  void add_matrix(double scale, BlockMatrix& matrix) const override;
  void add_tangents(std::span<const Points* const> d_references, std::span<Points* const> forces) const override;
  void add_adjoint(const Points& w, Points& reference_bar) const override;
  const Matrix3& rotation(int e) const override { return elements_[std::size_t(e)].frame; }
  double least_volume_ratio() const override { return least_volume_ratio_; }

 private:
  using Nodes = Eigen::Matrix<double, N, 3>;
  static constexpr int points = N == 4 ? 1 : 14;

  /// What a neo-Hookean law adds to the stress of the mean strain.
  struct MeanStrain {
    MeanStrainCorrection law;
    Matrix3 ahead, z;  // H = F_z - F_p, and F_z
    Matrix3 stress;    // E P(F_p, H)
    Nodes gradient;    // integral of g_a
  };

  struct Element {
    double volume = 0.0;
    Polar polar;                         // of the frame of rotation
    Matrix3 frame;                       // A
    std::array<double, points> part;     // of the volume
    std::array<Nodes, points> gradient;  // of the shape functions
    std::array<Matrix3, points> F;       // grad z
    std::array<Matrix3, points> own_F;   // A^T grad z
    std::array<Matrix3, points> lag_F;   // grad p
    Matrix3 mean;                        // of those, times the volume
    std::array<Matrix3, points> stress;  // E C : (A^T grad z - B), in the element's own frame
    Nodes force;                         // integral of stress g_a
    std::optional<MeanStrain> mean_strain;
  };

  const int* nodes_of(int e) const { return body_->connectivity.data() + std::size_t(e) * N; }
  Nodes of_element(int e, const Points& all) const {
    Nodes own;
    for (int a = 0; a < N; ++a) own.row(a) = all.row(nodes_of(e)[a]);
    return own;
  }
  Matrix3 stress(int e, const Matrix3& H) const {
    Matrix3 sigma = lame_.mu * (H + H.transpose());
    sigma.diagonal().array() += lame_.lambda * H.trace();
    return modulus(e) * sigma;
  }
  double modulus(int e) const { return factor_ * modulus_[e]; }
  void set_mean_strain(int e, const Matrix3& F, Element& element) const;
  /// Changes of the forces for four changes of the element's nodes X, lane by lane.
  void tangent(int e, const ElementLanes<N>& d_reference, ElementLanes<N>& change) const;
  /// change += that of the forces of the mean strain's law.
  /// @param G    of each point, and d_F of F_p, as `tangent` has them
  void add_mean_tangent(int e, const std::array<MatrixLanes, points>& G, const MatrixLanes& d_F,
                        const Wide<double>& d_volume, ElementLanes<N>& change) const;
  /// Cotangent of F_p, and those of each point's G and of the volume are added, for that of the forces.
  Matrix3 mean_adjoint(int e, const Nodes& w, std::array<Matrix3, points>& G_bar, double& volume_bar) const;

  std::shared_ptr<const Body> body_;
  ParameterHandle poissons_ratio_;
  ElasticLaw law_;
  std::optional<ParameterHandle> damping_;
  double factor_ = 1.0;
  ElementModuli modulus_;
  UnitLame lame_{};
  std::array<Nodes, points> derivatives_;
  std::array<double, points> weights_;
  std::vector<double> given_volumes_;  // of each point
  std::vector<Element> elements_;
  double least_volume_ratio_ = 1.0;
};

template <int N, Frame kind>
TetReferenceForces<N, kind>::TetReferenceForces(std::shared_ptr<const Body> body, const MaterialBlocks& material,
                                                ElasticLaw law, std::optional<ParameterHandle> damping)
    : body_(std::move(body)),
      poissons_ratio_(material.poissons_ratio),
      law_(law),
      damping_(damping),
      modulus_(body_, material) {
  // Mid nodes move on their own: curved elements need the rule that integrates their gradients exactly.
  const auto rule = tet_quadrature(N == 4 ? 0 : 5);
  for (int q = 0; q < points; ++q) {
    derivatives_[std::size_t(q)] = tet_shape_derivatives<N>(rule[std::size_t(q)].at);
    weights_[std::size_t(q)] = rule[std::size_t(q)].weight / 6.0;
  }
  elements_.resize(std::size_t(body_->element_count()));
  for (int e = 0; e < body_->element_count(); ++e) {
    const Nodes X = of_element(e, body_->nodes);
    for (int q = 0; q < points; ++q)
      given_volumes_.push_back(weights_[std::size_t(q)] *
                               Matrix3(X.transpose() * derivatives_[std::size_t(q)]).determinant());
  }
}

template <int N, Frame kind>
void TetReferenceForces<N, kind>::set_parameters(const VectorX& theta) {
  modulus_.set_parameters(theta);
  lame_ = unit_lame(theta[poissons_ratio_]);
  if (damping_) factor_ = theta[*damping_];
}

template <int N, Frame kind>
bool TetReferenceForces<N, kind>::linearise(const Points& X, const Points& p, const Points& z) {
  least_volume_ratio_ = std::numeric_limits<double>::infinity();
  for (int e = 0; e < body_->element_count(); ++e) {
    Element& element = elements_[std::size_t(e)];
    const Nodes own = of_element(e, X), lagging = of_element(e, p), moved = of_element(e, z);
    element.mean.setZero();
    element.volume = 0.0;
    for (int q = 0; q < points; ++q) {
      const auto i = std::size_t(q);
      const Matrix3 J = own.transpose() * derivatives_[i];
      element.part[i] = weights_[i] * J.determinant();
      least_volume_ratio_ =
          std::min(least_volume_ratio_, element.part[i] / given_volumes_[std::size_t(e) * points + i]);
      element.gradient[i].noalias() = derivatives_[i] * J.inverse();
      element.F[i].noalias() = moved.transpose() * element.gradient[i];
      element.lag_F[i].noalias() = lagging.transpose() * element.gradient[i];
      element.volume += element.part[i];
      element.mean += element.part[i] * element.lag_F[i];
    }
    if (!(least_volume_ratio_ > 0.0)) return false;
    element.frame = element.mean / element.volume;
    if (kind == Frame::Rotation) {
      const Matrix3 F = element.frame;
      element.polar = polar_decomposition(F, element.polar.quaternion);
      element.frame = element.polar.R;
      if (law_ == ElasticLaw::NeoHookean) set_mean_strain(e, F, element);
    }
    element.force.setZero();
    for (int q = 0; q < points; ++q) {
      const auto i = std::size_t(q);
      element.own_F[i].noalias() = element.frame.transpose() * element.F[i];
      Matrix3 strain = element.own_F[i];
      if (kind == Frame::Rotation) strain -= Matrix3::Identity();
      element.stress[i] = stress(e, strain);
      element.force.noalias() += element.part[i] * element.gradient[i] * element.stress[i].transpose();
    }
  }
  return true;
}

template <int N, Frame kind>
void TetReferenceForces<N, kind>::set_mean_strain(int e, const Matrix3& F, Element& element) const {
  Nodes gradient = Nodes::Zero();
  Matrix3 z = Matrix3::Zero();
  for (std::size_t q = 0; q < points; ++q) {
    gradient += element.part[q] * element.gradient[q];
    z += element.part[q] * element.F[q];
  }
  z /= element.volume;
  const MeanStrainCorrection law(F, element.polar, lame_);
  element.mean_strain = MeanStrain{law, z - F, z, modulus(e) * law.stress(z - F), gradient};
}

template <int N, Frame kind>
void TetReferenceForces<N, kind>::add_force(Points& force) const {
  for (int e = 0; e < body_->element_count(); ++e) {
    const Element& element = elements_[std::size_t(e)];
    for (int a = 0; a < N; ++a)
      force.row(nodes_of(e)[a]) -= (element.frame * element.force.row(a).transpose()).transpose();
    if (!element.mean_strain) continue;
    const Nodes own = element.mean_strain->gradient * element.mean_strain->stress.transpose();
    for (int a = 0; a < N; ++a) force.row(nodes_of(e)[a]) -= own.row(a);
  }
}

/// With G = sum_b dX_b g_b^T: volumes change by tr(G), gradients of fields by -F G, g by -G^T g, the frame R by R [w]x,
/// and a frame that is the deformation as that does. Entry (i, j) of a matrix of lanes is in [3 i + j].
template <int N, Frame kind>
void TetReferenceForces<N, kind>::tangent(int e, const ElementLanes<N>& d_reference, ElementLanes<N>& change) const {
  const Element& element = elements_[std::size_t(e)];
  const double lambda = modulus(e) * lame_.lambda, mu = modulus(e) * lame_.mu;
  const Matrix3& A = element.frame;
  std::array<MatrixLanes, points> G;
  MatrixLanes d_mean{};
  Wide<double> d_volume{};
  for (std::size_t q = 0; q < points; ++q) {
    G[q] = mean_gradient_lanes<N>(element.gradient[q], d_reference);
    const Wide<double> growth = element.part[q] * (G[q][0] + G[q][4] + G[q][8]);
    const Matrix3& F = element.lag_F[q];
    for (int i = 0; i < 3; ++i) {
      const double row[3] = {element.part[q] * F(i, 0), element.part[q] * F(i, 1), element.part[q] * F(i, 2)};
      for (int j = 0; j < 3; ++j)
        d_mean[entry(i, j)] +=
            growth * F(i, j) - (row[0] * G[q][entry(0, j)] + row[1] * G[q][entry(1, j)] + row[2] * G[q][entry(2, j)]);
    }
    d_volume += growth;
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      Wide<double>& own = d_mean[entry(i, j)];
      own = (own - (element.mean(i, j) / element.volume) * d_volume) * (1.0 / element.volume);
    }
  change.fill(Wide<double>{});
  MatrixLanes dA = d_mean;
  if (kind == Frame::Rotation) {
    const std::array<Wide<double>, 3> w = rotation_rate_lanes(element.polar, d_mean);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const int k = (j + 1) % 3, l = (j + 2) % 3;
        dA[entry(i, j)] = w[std::size_t(l)] * A(i, k) - w[std::size_t(k)] * A(i, l);
      }
  }
  for (std::size_t q = 0; q < points; ++q) {
    const Matrix3 &F = element.F[q], &own_F = element.own_F[q], &sigma = element.stress[q];
    const MatrixLanes& own = G[q];
    const Wide<double> growth = own[0] + own[4] + own[8];
    MatrixLanes loss;  // of A^T grad z
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        loss[entry(i, j)] = own_F(i, 0) * own[entry(0, j)] + own_F(i, 1) * own[entry(1, j)] +
                            own_F(i, 2) * own[entry(2, j)] - dA[entry(0, i)] * F(0, j) - dA[entry(1, i)] * F(1, j) -
                            dA[entry(2, i)] * F(2, j);
    const Wide<double> pressure = lambda * (loss[0] + loss[4] + loss[8]);
    MatrixLanes T;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const auto at = entry(i, j), across = entry(j, i), row = entry(j, 0);
        T[at] = growth * sigma(i, j) - mu * (loss[at] + loss[across]) -
                (sigma(i, 0) * own[row] + sigma(i, 1) * own[row + 1] + sigma(i, 2) * own[row + 2]);
        if (i == j) T[at] -= pressure;
        T[at] *= element.part[q];
      }
    const Nodes& g = element.gradient[q];
    for (std::size_t a = 0; a < N; ++a) {
      const auto row = Eigen::Index(a);
      for (std::size_t i = 0; i < 3; ++i)
        change[3 * a + i] -= T[3 * i] * g(row, 0) + T[3 * i + 1] * g(row, 1) + T[3 * i + 2] * g(row, 2);
    }
  }
  for (std::size_t a = 0; a < N; ++a) {
    const Wide<double> local[3] = {change[3 * a], change[3 * a + 1], change[3 * a + 2]};
    const auto y = element.force.row(Eigen::Index(a));
    for (int i = 0; i < 3; ++i)
      change[entry(int(a), i)] = A(i, 0) * local[0] + A(i, 1) * local[1] + A(i, 2) * local[2] -
                                 (dA[entry(i, 0)] * y[0] + dA[entry(i, 1)] * y[1] + dA[entry(i, 2)] * y[2]);
  }
  if (element.mean_strain) add_mean_tangent(e, G, d_mean, d_volume, change);
}

/// With M_a the integral of g_a: df_a = -(E dP M_a + E P dM_a), dM_a = sum over points of V (tr(G) I - G^T) g_a.
template <int N, Frame kind>
void TetReferenceForces<N, kind>::add_mean_tangent(int e, const std::array<MatrixLanes, points>& G,
                                                   const MatrixLanes& d_F, const Wide<double>& d_volume,
                                                   ElementLanes<N>& change) const {
  const Element& element = elements_[std::size_t(e)];
  const MeanStrain& own = *element.mean_strain;
  const auto matrix_of = [](const MatrixLanes& lanes, int l) {
    Matrix3 matrix;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) matrix(i, j) = lanes[entry(i, j)][l];
    return matrix;
  };
  for (int l = 0; l < 4; ++l) {
    Matrix3 d_z = -d_volume[l] * own.z;
    Nodes d_gradient = Nodes::Zero();
    for (std::size_t q = 0; q < points; ++q) {
      const Matrix3 of_point = matrix_of(G[q], l);
      const Matrix3 d_part = element.part[q] * (of_point.trace() * Matrix3::Identity() - of_point);
      d_z += element.F[q] * d_part;
      d_gradient += element.gradient[q] * d_part;
    }
    d_z /= element.volume;
    const Matrix3 dF = matrix_of(d_F, l);
    const Matrix3 d_stress = modulus(e) * own.law.tangent(own.ahead, dF, d_z - dF);
    const Nodes d_force = own.gradient * d_stress.transpose() + d_gradient * own.stress.transpose();
    for (int a = 0; a < N; ++a)
      for (int i = 0; i < 3; ++i) change[entry(a, i)][l] -= d_force(a, i);
  }
}

/// Column by column, four at a time.
template <int N, Frame kind>
void TetReferenceForces<N, kind>::add_matrix(double scale, BlockMatrix& matrix) const {
  constexpr std::size_t lanes = 4;
  ElementLanes<N> unit, columns;
  for (int e = 0; e < body_->element_count(); ++e) {
    const int* blocks = body_->blocks->data() + std::size_t(e) * (N * N);
    for (std::size_t first = 0; first < 3 * N; first += lanes) {
      const std::size_t used = std::min(lanes, 3 * N - first);
      unit.fill(Wide<double>{});
      for (std::size_t l = 0; l < used; ++l) unit[first + l][l] = scale;
      tangent(e, unit, columns);
      for (std::size_t l = 0; l < used; ++l) {
        const int b = int((first + l) / 3), i = int((first + l) % 3);
        for (int a = 0; a < N; ++a)
          for (int k = 0; k < 3; ++k) matrix.block(blocks[N * a + b])[3 * i + k] += columns[entry(a, k)][l];
      }
    }
  }
}

template <int N, Frame kind>
void TetReferenceForces<N, kind>::add_tangents(std::span<const Points* const> d_references,
                                               std::span<Points* const> forces) const {
  constexpr std::size_t lanes = 4;
  ElementLanes<N> d_reference, change;
  for (int e = 0; e < body_->element_count() && !forces.empty(); ++e)
    for (std::size_t first = 0; first < forces.size(); first += lanes) {
      const std::size_t used = std::min(lanes, forces.size() - first);
      gather_lanes<N>(nodes_of(e), d_references.subspan(first, used), false, d_reference);
      tangent(e, d_reference, change);
      for (std::size_t l = 0; l < used; ++l)
        for (int a = 0; a < N; ++a)
          for (int i = 0; i < 3; ++i) (*forces[first + l])(nodes_of(e)[a], i) += change[entry(a, i)][l];
    }
}

/// The transpose of `add_mean_tangent`.
template <int N, Frame kind>
Matrix3 TetReferenceForces<N, kind>::mean_adjoint(int e, const Nodes& w, std::array<Matrix3, points>& G_bar,
                                                  double& volume_bar) const {
  const Element& element = elements_[std::size_t(e)];
  const MeanStrain& own = *element.mean_strain;
  const Matrix3 stress_bar = -modulus(e) * w.transpose() * own.gradient;
  const MeanStrainCorrection::Cotangents bar = own.law.adjoint(own.ahead, stress_bar);
  const Matrix3 z_bar = bar.H / element.volume;
  volume_bar -= z_bar.cwiseProduct(own.z).sum();
  for (std::size_t q = 0; q < points; ++q) {
    // of V (tr(G) I - G), by which F_z and the integral of g^T are multiplied
    const Matrix3 part_bar = element.F[q].transpose() * z_bar - element.gradient[q].transpose() * w * own.stress;
    G_bar[q] += element.part[q] * (part_bar.trace() * Matrix3::Identity() - part_bar);
  }
  return bar.F - bar.H;
}

/// The transpose of `tangent`, line by line.
template <int N, Frame kind>
void TetReferenceForces<N, kind>::add_adjoint(const Points& w, Points& reference_bar) const {
  for (int e = 0; e < body_->element_count(); ++e) {
    const Element& element = elements_[std::size_t(e)];
    const Nodes own_w = of_element(e, w), c = own_w * element.frame;  // rows of c are A^T w_a
    Matrix3 frame_bar = -own_w.transpose() * element.force;
    std::array<Matrix3, points> G_bar;
    for (std::size_t q = 0; q < points; ++q) {
      const Matrix3& sigma = element.stress[q];
      // change = -V T g, so T's cotangent is -V c^T g; that of d_sigma passes through the symmetric map C.
      const Matrix3 T_bar = -element.part[q] * c.transpose() * element.gradient[q];
      const Matrix3 H_bar = stress(e, T_bar);
      frame_bar.noalias() += element.F[q] * H_bar.transpose();
      G_bar[q] = T_bar.cwiseProduct(sigma).sum() * Matrix3::Identity() - element.own_F[q].transpose() * H_bar -
                 T_bar.transpose() * sigma;
    }
    Matrix3 mean_bar = frame_bar / element.volume;
    if (kind == Frame::Rotation) {
      const Matrix3 W = element.frame.transpose() * frame_bar;
      const Vector3 w_bar(W(2, 1) - W(1, 2), W(0, 2) - W(2, 0), W(1, 0) - W(0, 1));
      mean_bar = rotation_rate_adjoint(element.polar, w_bar) / element.volume;
    }
    double volume_bar = 0.0;
    if (element.mean_strain) mean_bar += mean_adjoint(e, own_w, G_bar, volume_bar) / element.volume;
    volume_bar -= mean_bar.cwiseProduct(element.mean).sum() / element.volume;
    for (std::size_t q = 0; q < points; ++q) {
      const double growth_bar = element.part[q] * (mean_bar.cwiseProduct(element.lag_F[q]).sum() + volume_bar);
      G_bar[q] += growth_bar * Matrix3::Identity() - element.part[q] * element.lag_F[q].transpose() * mean_bar;
      const Nodes bar = element.gradient[q] * G_bar[q].transpose();
      for (int a = 0; a < N; ++a) reference_bar.row(nodes_of(e)[a]) += bar.row(a);
    }
  }
}

template <Frame kind, class... Arguments>
std::unique_ptr<ReferenceForces> make_for(std::shared_ptr<const Body> body, Arguments&&... arguments) {
  switch (body->kind) {
    case ElementKind::Tetrahedron:
      return std::make_unique<TetReferenceForces<4, kind>>(std::move(body), arguments...);
    case ElementKind::QuadraticTetrahedron:
      return std::make_unique<TetReferenceForces<10, kind>>(std::move(body), arguments...);
    case ElementKind::Hexahedron:
      break;
  }
  throw std::invalid_argument("reference shapes are those of tetrahedra");
}

}  // namespace

std::unique_ptr<ReferenceForces> ReferenceForces::make(std::shared_ptr<const Body> body, const MaterialBlocks& blocks,
                                                       ElasticLaw law) {
  return make_for<Frame::Rotation>(std::move(body), blocks, law);
}

std::unique_ptr<ReferenceForces> ReferenceForces::make_viscous(std::shared_ptr<const Body> body,
                                                               const MaterialBlocks& blocks,
                                                               ParameterHandle stiffness_damping) {
  return make_for<Frame::Deformation>(std::move(body), blocks, ElasticLaw::Corotated, stiffness_damping);
}

}  // namespace pliant
