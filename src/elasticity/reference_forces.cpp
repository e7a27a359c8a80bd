#include "elasticity/reference_forces.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>

#include "mesh/tet_shape.hpp"

namespace pliant {

namespace {

template <int N>
class TetReferenceForces : public ReferenceForces {
 public:
  TetReferenceForces(std::shared_ptr<const Body> body, const MaterialBlocks& material);

  void set_parameters(const VectorX& theta) override;
  bool linearise(const Points& X, const Points& p, const Points& z) override;
  void add_force(Points& force) const override;
  void add_matrix(double scale, BlockMatrix& matrix) const override;
  void add_tangent(const Points& d_reference, Points& force) const override;
  void add_adjoint(const Points& w, Points& reference_bar) const override;
  const Matrix3& rotation(int e) const override { return elements_[std::size_t(e)].polar.R; }
  double least_volume_ratio() const override { return least_volume_ratio_; }

 private:
  using Nodes = Eigen::Matrix<double, N, 3>;
  using ByNode = Eigen::Matrix<double, 3, N>;
  static constexpr int points = N == 4 ? 1 : 14;

  struct Element {
    double volume = 0.0;
    Polar polar;
    std::array<double, points> part;       // of the volume
    std::array<Nodes, points> gradient;    // of the shape functions
    std::array<Matrix3, points> F, lag_F;  // of z, of p
    std::array<Matrix3, points> stress;    // E C : (R^T F - I), in the element's own frame
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
    return modulus_[e] * sigma;
  }
  /// Change of the forces for a change of the element's nodes X; column a is that of node a.
  ByNode tangent(int e, const Nodes& d_reference) const;

  std::shared_ptr<const Body> body_;
  ParameterHandle poissons_ratio_;
  ElementModuli modulus_;
  UnitLame lame_{};
  std::array<Nodes, points> derivatives_;
  std::array<double, points> weights_;
  std::vector<double> given_volumes_;  // of each point
  std::vector<Element> elements_;
  double least_volume_ratio_ = 1.0;
};

template <int N>
TetReferenceForces<N>::TetReferenceForces(std::shared_ptr<const Body> body, const MaterialBlocks& material)
    : body_(std::move(body)), poissons_ratio_(material.poissons_ratio), modulus_(body_, material) {
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

template <int N>
void TetReferenceForces<N>::set_parameters(const VectorX& theta) {
  modulus_.set_parameters(theta);
  lame_ = unit_lame(theta[poissons_ratio_]);
}

template <int N>
bool TetReferenceForces<N>::linearise(const Points& X, const Points& p, const Points& z) {
  least_volume_ratio_ = std::numeric_limits<double>::infinity();
  for (int e = 0; e < body_->element_count(); ++e) {
    Element& element = elements_[std::size_t(e)];
    const Nodes own = of_element(e, X), lagging = of_element(e, p), moved = of_element(e, z);
    Matrix3 sum = Matrix3::Zero();
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
      sum += element.part[i] * element.lag_F[i];
    }
    if (!(least_volume_ratio_ > 0.0)) return false;
    element.polar = polar_decomposition(sum / element.volume, element.polar.quaternion);
    for (int q = 0; q < points; ++q) {
      const auto i = std::size_t(q);
      element.stress[i] = stress(e, element.polar.R.transpose() * element.F[i] - Matrix3::Identity());
    }
  }
  return true;
}

template <int N>
void TetReferenceForces<N>::add_force(Points& force) const {
  for (int e = 0; e < body_->element_count(); ++e) {
    const Element& element = elements_[std::size_t(e)];
    Nodes f = Nodes::Zero();
    for (std::size_t q = 0; q < points; ++q)
      f.noalias() += element.part[q] * element.gradient[q] * element.stress[q].transpose();
    for (int a = 0; a < N; ++a) force.row(nodes_of(e)[a]) -= (element.polar.R * f.row(a).transpose()).transpose();
  }
}

/// With G = sum_b dX_b g_b^T: volumes change by tr(G), F by -F G, g by -G^T g, and R by R [w]x.
template <int N>
auto TetReferenceForces<N>::tangent(int e, const Nodes& d_reference) const -> ByNode {
  const Element& element = elements_[std::size_t(e)];
  std::array<Matrix3, points> G;
  Matrix3 mean = Matrix3::Zero(), d_mean = Matrix3::Zero();
  double d_volume = 0.0;
  for (std::size_t q = 0; q < points; ++q) {
    G[q].noalias() = d_reference.transpose() * element.gradient[q];
    const double growth = G[q].trace();
    mean += element.part[q] * element.lag_F[q];
    d_mean += element.part[q] * (growth * element.lag_F[q] - element.lag_F[q] * G[q]);
    d_volume += element.part[q] * growth;
  }
  d_mean = (d_mean - mean * (d_volume / element.volume)) / element.volume;
  const Matrix3& R = element.polar.R;
  const Matrix3 W = cross_matrix(rotation_rate(element.polar, d_mean));
  ByNode change = ByNode::Zero();
  for (std::size_t q = 0; q < points; ++q) {
    const Matrix3 Q = R.transpose() * element.F[q];
    const Matrix3& sigma = element.stress[q];
    const Matrix3 d_sigma = stress(e, -W * Q - Q * G[q]);
    change.noalias() -= element.part[q] * (W * sigma + G[q].trace() * sigma + d_sigma - sigma * G[q].transpose()) *
                        element.gradient[q].transpose();
  }
  return R * change;
}

template <int N>
void TetReferenceForces<N>::add_matrix(double scale, BlockMatrix& matrix) const {
  for (int e = 0; e < body_->element_count(); ++e) {
    const int* blocks = body_->blocks->data() + std::size_t(e) * (N * N);
    for (int b = 0; b < N; ++b)
      for (int i = 0; i < 3; ++i) {
        Nodes unit = Nodes::Zero();
        unit(b, i) = 1.0;
        const ByNode column = scale * tangent(e, unit);
        for (int a = 0; a < N; ++a) Eigen::Map<Matrix3>(matrix.block(blocks[N * a + b])).col(i) += column.col(a);
      }
  }
}

template <int N>
void TetReferenceForces<N>::add_tangent(const Points& d_reference, Points& force) const {
  for (int e = 0; e < body_->element_count(); ++e) {
    const ByNode change = tangent(e, of_element(e, d_reference));
    for (int a = 0; a < N; ++a) force.row(nodes_of(e)[a]) += change.col(a).transpose();
  }
}

/// The transpose of `tangent`, line by line.
template <int N>
void TetReferenceForces<N>::add_adjoint(const Points& w, Points& reference_bar) const {
  for (int e = 0; e < body_->element_count(); ++e) {
    const Element& element = elements_[std::size_t(e)];
    const Matrix3& R = element.polar.R;
    const Nodes c = of_element(e, w) * R;  // rows are R^T w_a
    Vector3 w_bar = Vector3::Zero();
    std::array<Matrix3, points> G_bar;
    Matrix3 mean = Matrix3::Zero();
    for (std::size_t q = 0; q < points; ++q) {
      const Matrix3 Q = R.transpose() * element.F[q];
      const Matrix3& sigma = element.stress[q];
      // change = -V T g, so T's cotangent is -V c^T g; that of d_sigma passes through the symmetric map C.
      const Matrix3 T_bar = -element.part[q] * c.transpose() * element.gradient[q];
      const Matrix3 H_bar = stress(e, T_bar);
      const Matrix3 W_bar = T_bar * sigma.transpose() - H_bar * Q.transpose();
      w_bar += Vector3(W_bar(2, 1) - W_bar(1, 2), W_bar(0, 2) - W_bar(2, 0), W_bar(1, 0) - W_bar(0, 1));
      G_bar[q] =
          T_bar.cwiseProduct(sigma).sum() * Matrix3::Identity() - Q.transpose() * H_bar - T_bar.transpose() * sigma;
      mean += element.part[q] * element.lag_F[q];
    }
    const Matrix3 mean_bar = rotation_rate_adjoint(element.polar, w_bar) / element.volume;
    const double volume_bar = -mean_bar.cwiseProduct(mean).sum() / element.volume;
    for (std::size_t q = 0; q < points; ++q) {
      const double growth_bar = element.part[q] * (mean_bar.cwiseProduct(element.lag_F[q]).sum() + volume_bar);
      G_bar[q] += growth_bar * Matrix3::Identity() - element.part[q] * element.lag_F[q].transpose() * mean_bar;
      const Nodes bar = element.gradient[q] * G_bar[q].transpose();
      for (int a = 0; a < N; ++a) reference_bar.row(nodes_of(e)[a]) += bar.row(a);
    }
  }
}

}  // namespace

std::unique_ptr<ReferenceForces> ReferenceForces::make(std::shared_ptr<const Body> body, const MaterialBlocks& blocks) {
  switch (body->kind) {
    case ElementKind::Tetrahedron:
      return std::make_unique<TetReferenceForces<4>>(std::move(body), blocks);
    case ElementKind::QuadraticTetrahedron:
      return std::make_unique<TetReferenceForces<10>>(std::move(body), blocks);
    case ElementKind::Hexahedron:
      break;
  }
  throw std::invalid_argument("reference shapes are those of tetrahedra");
}

}  // namespace pliant
