#include "elasticity/law_elasticity.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <stdexcept>

#include "base/parallel.hpp"
#include "elasticity/tet_element.hpp"

namespace pliant {

void LawElasticity::set_reference(std::shared_ptr<const Body>) {
  throw std::logic_error("bodies of a material law are free of load where they were scanned");
}
void LawElasticity::add_force_tangent(const Points&, const Points&, const Points&, const VectorX&, Points&) {
  throw std::logic_error("motions of a material law have no derivatives by theta");
}
void LawElasticity::add_force_adjoint(const Points&, const Points&, Points&, Points&, VectorX&) {
  throw std::logic_error("motions of a material law have no derivatives by theta");
}

Strain6 biot_strain(const Matrix3& F) {
  const Matrix3 S = polar_decomposition(F).S;
  Strain6 strain;
  strain << S(0, 0) - 1.0, S(1, 1) - 1.0, S(2, 2) - 1.0, S(0, 1), S(0, 2), S(1, 2);
  return strain;
}

namespace {

/// The tangent without its negative eigenvalues.
Matrix9 positive_part(const Matrix9& tangent) {
  const Eigen::SelfAdjointEigenSolver<Matrix9> solver(tangent);
  if (solver.eigenvalues()[0] >= 0.0) return tangent;
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() * solver.eigenvectors().transpose();
}

template <int N>
class TetLawElasticity : public LawElasticity {
 public:
  TetLawElasticity(std::shared_ptr<const Body> body, std::shared_ptr<const MaterialLaw> law,
                   std::shared_ptr<const BlockPattern> pattern);

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::Blended; }
  void linearise(const Points& lag) override;
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override { add_stiffness(Stiffness::Positive, scale, matrix); }
  void add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) override;
  double energy(const Points& z) const override;

  double evaluate(const Points& x, bool with_tangent) override;
  void add_gradient(Points& gradient) const override;
  void add_stiffness(Stiffness which, double scale, BlockMatrix& matrix) const override;
  void for_parameter_derivatives(const VisitDerivatives& visit) const override;
  Matrix3 cauchy_stress(int element) const override;
  MatrixX strains() const override;

 private:
  static constexpr int points = N == 4 ? 1 : 4;
  using Nodes = Eigen::Matrix<double, N, 3>;
  struct Point {
    double volume;
    Nodes gradient;  // of the shape functions, by node
    Matrix3 F;
    PointStress stress;
  };
  const int* nodes_of(int e) const { return body_->connectivity.data() + std::size_t(e) * N; }
  Matrix3 deformation(int e, const Nodes& gradient, const Points& x) const {
    Matrix3 F = Matrix3::Zero();
    for (int a = 0; a < N; ++a) F.noalias() += x.row(nodes_of(e)[a]).transpose() * gradient.row(a);
    return F;
  }
  /// product += K d at the last `evaluate`, K the positive stiffness.
  void add_product(const Points& d, double scale, Points& product) const;

  std::shared_ptr<const Body> body_;
  std::vector<Point> points_;
  std::vector<int> blocks_;  // N x N an element
  Points lag_;
};

template <int N>
TetLawElasticity<N>::TetLawElasticity(std::shared_ptr<const Body> body, std::shared_ptr<const MaterialLaw> law,
                                      std::shared_ptr<const BlockPattern> pattern)
    : LawElasticity(std::move(law)), body_(std::move(body)) {
  const int count = body_->element_count();
  points_.resize(std::size_t(count) * points);
  polar_.resize(std::size_t(count));
  const auto rule = tet_quadrature(N == 4 ? 1 : 2);
  for (int e = 0; e < count; ++e) {
    Nodes X;
    for (int a = 0; a < N; ++a) X.row(a) = body_->nodes.row(nodes_of(e)[a]);
    for (int q = 0; q < points; ++q) {
      Point& point = points_[std::size_t(e * points + q)];
      const auto& at = rule[std::size_t(q)];
      point.volume = at.weight * (X.transpose() * tet_shape_derivatives<N>(at.at)).determinant() / 6.0;
      point.gradient = tet_gradients<N>(X, at.at);
    }
    for (int a = 0; a < N; ++a)
      for (int b = 0; b < N; ++b)
        blocks_.push_back((pattern ? *pattern : *body_->pattern).find(nodes_of(e)[a], nodes_of(e)[b]));
  }
}

template <int N>
double TetLawElasticity<N>::evaluate(const Points& x, bool with_tangent) {
  const int count = body_->element_count();
  parallel_ranges(0, std::size_t(count), 128, [&](std::size_t begin, std::size_t end) {
    for (int e = int(begin); e < int(end); ++e)
      for (int q = 0; q < points; ++q) {
        Point& point = points_[std::size_t(e * points + q)];
        point.F = deformation(e, point.gradient, x);
        law_->stress(e, point.F, with_tangent, point.stress);
      }
  });
  double energy = 0.0;
  for (const Point& point : points_) energy += point.volume * point.stress.energy;
  return std::isnan(energy) ? std::numeric_limits<double>::infinity() : energy;
}

template <int N>
void TetLawElasticity<N>::add_gradient(Points& gradient) const {
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e * points + q)];
      const Nodes force = point.volume * point.gradient * point.stress.P.transpose();
      for (int a = 0; a < N; ++a) gradient.row(nodes_of(e)[a]) += force.row(a);
    }
}

/// In the frame of a point's tangent M: K_ab(i, k) = V sum_jl g_a(j) M(ij, kl) g_b(l), turned by `left`.
template <int N>
void TetLawElasticity<N>::add_stiffness(Stiffness which, double scale, BlockMatrix& matrix) const {
  for (int e = 0; e < body_->element_count(); ++e) {
    const int* blocks = blocks_.data() + std::size_t(e) * (N * N);
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e * points + q)];
      const PointStress& s = point.stress;
      const Matrix9 M = which == Stiffness::Exact ? s.tangent : positive_part(s.tangent);
      const Nodes g = point.gradient * s.right;
      const double factor = scale * point.volume;
      for (int b = 0; b < N; ++b) {
        // H = M g_b, 9 x 3: a change of node b's coordinate k
        Eigen::Matrix<double, 9, 3> H;
        for (int k = 0; k < 3; ++k) H.col(k) = M.col(k) * g(b, 0) + M.col(k + 3) * g(b, 1) + M.col(k + 6) * g(b, 2);
        const Eigen::Matrix<double, 9, 3> turned = factor * H * s.left.transpose();
        for (int a = 0; a < N; ++a) {
          const Matrix3 block =
              turned.middleRows<3>(0) * g(a, 0) + turned.middleRows<3>(3) * g(a, 1) + turned.middleRows<3>(6) * g(a, 2);
          Eigen::Map<Matrix3>(matrix.block(blocks[N * a + b])).noalias() += s.left * block;
        }
      }
    }
  }
}

template <int N>
void TetLawElasticity<N>::for_parameter_derivatives(const VisitDerivatives& visit) const {
  const int count = int(law_->parameter_names().size());
  std::vector<Matrix3> by_parameter(std::size_t(count), Matrix3::Zero());
  MatrixX derivatives(3 * N, count);
  for (int e = 0; e < body_->element_count(); ++e) {
    derivatives.setZero();
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e * points + q)];
      law_->parameter_derivatives(e, point.F, by_parameter);
      for (int k = 0; k < count; ++k) {
        const Eigen::Matrix<double, 3, N> force =
            point.volume * by_parameter[std::size_t(k)] * point.gradient.transpose();
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
    const Point& point = points_[std::size_t(e * points + q)];
    sum += point.volume / point.F.determinant() * point.stress.P * point.F.transpose();
    volume += point.volume;
  }
  return sum / volume;
}

template <int N>
MatrixX TetLawElasticity<N>::strains() const {
  MatrixX strains = MatrixX::Zero(body_->element_count(), 6);
  for (int e = 0; e < body_->element_count(); ++e) {
    double volume = 0.0;
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e * points + q)];
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
      const Point& point = points_[std::size_t(e * points + q)];
      law_->stress(e, deformation(e, point.gradient, z), false, stress);
      sum += point.volume * stress.energy;
    }
  return sum;
}

template <int N>
void TetLawElasticity<N>::linearise(const Points& lag) {
  evaluate(lag, true);
  lag_ = lag;
  for (int e = 0; e < body_->element_count(); ++e) {  // rotations, for who asks
    Matrix3 F = Matrix3::Zero();
    double volume = 0.0;
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e * points + q)];
      F += point.volume * point.F;
      volume += point.volume;
    }
    polar_[std::size_t(e)] = polar_decomposition(F / volume, polar_[std::size_t(e)].quaternion);
  }
}

template <int N>
void TetLawElasticity<N>::add_product(const Points& d, double scale, Points& product) const {
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e * points + q)];
      const PointStress& s = point.stress;
      const Matrix3 local = s.left.transpose() * deformation(e, point.gradient, d) * s.right;
      Eigen::Matrix<double, 9, 1> turned =
          positive_part(s.tangent) * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(local.data());
      const Matrix3 dP = s.left * Eigen::Map<const Matrix3>(turned.data()) * s.right.transpose();
      const Nodes force = scale * point.volume * point.gradient * dP.transpose();
      for (int a = 0; a < N; ++a) product.row(nodes_of(e)[a]) += force.row(a);
    }
}

template <int N>
void TetLawElasticity<N>::add_force(const Points& z, Points& force) {
  for (int e = 0; e < body_->element_count(); ++e)
    for (int q = 0; q < points; ++q) {
      const Point& point = points_[std::size_t(e * points + q)];
      const Nodes own = point.volume * point.gradient * point.stress.P.transpose();
      for (int a = 0; a < N; ++a) force.row(nodes_of(e)[a]) -= own.row(a);
    }
  if (z == lag_) return;
  const Points d = z - lag_;
  add_product(d, -1.0, force);
}

template <int N>
void TetLawElasticity<N>::add_lag_matrix(const Points&, double scale, BlockMatrix& matrix) {
  add_stiffness(Stiffness::Exact, scale, matrix);
  add_stiffness(Stiffness::Positive, -scale, matrix);
}

}  // namespace

std::unique_ptr<LawElasticity> LawElasticity::make(std::shared_ptr<const Body> body,
                                                   std::shared_ptr<const MaterialLaw> law,
                                                   std::shared_ptr<const BlockPattern> pattern) {
  if (law->element_count() != body->element_count())
    throw std::invalid_argument("the material has another number of elements than the body");
  if (body->kind == ElementKind::Tetrahedron)
    return std::make_unique<TetLawElasticity<4>>(std::move(body), std::move(law), std::move(pattern));
  if (body->kind == ElementKind::QuadraticTetrahedron)
    return std::make_unique<TetLawElasticity<10>>(std::move(body), std::move(law), std::move(pattern));
  throw std::invalid_argument("material laws are for tetrahedra");
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
