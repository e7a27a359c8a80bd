#include "elasticity/corotated.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace pliant {

namespace {

template <class Derived>
auto node(Eigen::MatrixBase<Derived>& v, int a) {
  return v.template segment<3>(3 * a);
}
template <class Derived>
auto node(const Eigen::MatrixBase<Derived>& v, int a) {
  return v.template segment<3>(3 * a);
}

}  // namespace

CorotatedElasticity::CorotatedElasticity(std::shared_ptr<const Body> body) : body_(std::move(body)) {
  const HexGrid& grid = body_->grid;
  polar_.resize(grid.cells.size());
  stiffness_.resize(body_->class_representative.size());
  for (const auto& cell : grid.cells) {
    Vector24 X;
    for (int a = 0; a < 8; ++a) node(X, a) = (grid.nodes.row(cell[a]) - grid.nodes.row(cell[0])).transpose();
    reference_.push_back(X);
    auto& pairs = block_of_pair_.emplace_back();
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b) pairs[8 * a + b] = body_->pattern->find(cell[a], cell[b]);
  }
}

void CorotatedElasticity::set_parameters(const VectorX& parameters) {
  // Rotations start from those of the step before; a run must not start from those of the run before.
  std::ranges::fill(polar_, Polar{});
  youngs_modulus_ = parameters[theta::youngs_modulus];
  const double nu = parameters[theta::poissons_ratio];
  if (nu == poissons_ratio_) return;
  poissons_ratio_ = nu;
  for (std::size_t c = 0; c < stiffness_.size(); ++c) {
    const int e = body_->class_representative[c];
    const HexStiffness unit =
        hex_stiffness(body_->grid.quadrature[e], body_->grid.cell_size, nu, body_->options.formulation);
    Stiffness& s = stiffness_[c];
    s.K = unit.value;
    s.dK = unit.d_poissons_ratio;
    s.upper.setZero();
    int block = 0;
    for (int a = 0; a < 8; ++a)
      for (int b = a; b < 8; ++b, ++block)
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j) s.upper(block, 3 * i + j) = s.K(3 * a + i, 3 * b + j);
  }
}

void CorotatedElasticity::linearise(const Points& lag) {
  for (std::size_t e = 0; e < polar_.size(); ++e) {
    const auto& cell = body_->grid.cells[e];
    Matrix3 F = Matrix3::Zero();
    for (int a = 0; a < 8; ++a) F.noalias() += lag.row(cell[a]).transpose() * body_->mean_gradient[e].row(a);
    polar_[e] = polar_decomposition(F, polar_[e].quaternion);
  }
}

CorotatedElasticity::Vector24 CorotatedElasticity::unrotated(int e, const Points& z) const {
  const auto& cell = body_->grid.cells[e];
  const Matrix3 Rt = polar_[e].R.transpose();
  const Vector3 first = z.row(cell[0]);
  Vector24 local;
  for (int a = 0; a < 8; ++a) node(local, a).noalias() = Rt * (z.row(cell[a]).transpose() - first);
  return local;
}

void CorotatedElasticity::add_force(const Points& z, Points& force) {
  for (std::size_t e = 0; e < polar_.size(); ++e) {
    const auto& cell = body_->grid.cells[e];
    const Vector24 d = unrotated(int(e), z) - reference_[e];
    Vector24 y;
    y.noalias() = stiffness(int(e)).K * d;
    const Matrix3 R = modulus(int(e)) * polar_[e].R;
    for (int a = 0; a < 8; ++a) force.row(cell[a]).noalias() -= (R * node(y, a)).transpose();
  }
}

double CorotatedElasticity::energy(const Points& z) const {
  double sum = 0.0;
  for (std::size_t e = 0; e < polar_.size(); ++e) {
    const Vector24 d = unrotated(int(e), z) - reference_[e];
    sum += 0.5 * modulus(int(e)) * d.dot(stiffness(int(e)).K * d);
  }
  return sum;
}

void CorotatedElasticity::add_matrix(double scale, BlockMatrix& matrix) {
  using Column = Eigen::Matrix<double, 40, 1>;
  Eigen::Matrix<double, 40, 9> half, full;
  for (std::size_t e = 0; e < polar_.size(); ++e) {
    const Matrix3& R = polar_[e].R;
    const Stiffness& s = stiffness(int(e));
    const double factor = scale * modulus(int(e));
    for (int i = 0; i < 3; ++i)  // R K
      for (int l = 0; l < 3; ++l)
        half.col(3 * i + l) =
            Column(R(i, 0) * s.upper.col(l) + R(i, 1) * s.upper.col(3 + l) + R(i, 2) * s.upper.col(6 + l)) * factor;
    for (int i = 0; i < 3; ++i)  // (R K) R^T
      for (int j = 0; j < 3; ++j)
        full.col(3 * i + j) = R(j, 0) * half.col(3 * i) + R(j, 1) * half.col(3 * i + 1) + R(j, 2) * half.col(3 * i + 2);
    const auto& pairs = block_of_pair_[e];
    int block = 0;
    for (int a = 0; a < 8; ++a) {
      for (int b = a; b < 8; ++b, ++block) {
        double* upper = matrix.block(pairs[8 * a + b]);
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i) upper[3 * j + i] += full(block, 3 * i + j);
        if (a == b) continue;
        double* lower = matrix.block(pairs[8 * b + a]);
        for (int j = 0; j < 3; ++j)
          for (int i = 0; i < 3; ++i) lower[3 * j + i] += full(block, 3 * j + i);
      }
    }
  }
}

void CorotatedElasticity::add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z,
                                            const VectorX& d_theta, Points& force) {
  const double d_log_modulus = d_theta[theta::youngs_modulus] / youngs_modulus_;
  const double d_nu = d_theta[theta::poissons_ratio];
  for (std::size_t e = 0; e < polar_.size(); ++e) {
    const auto& cell = body_->grid.cells[e];
    const Stiffness& s = stiffness(int(e));
    Matrix3 dF = Matrix3::Zero();
    for (int a = 0; a < 8; ++a) dF.noalias() += d_lag.row(cell[a]).transpose() * body_->mean_gradient[e].row(a);
    const Vector3 w = rotation_rate(polar_[e], dF);
    const Vector24 q = unrotated(int(e), z);
    const Vector24 d = q - reference_[e];
    Vector24 dd = unrotated(int(e), d_z);
    for (int a = 0; a < 8; ++a) node(dd, a) -= w.cross(Vector3(node(q, a)));
    Vector24 y, dy;
    y.noalias() = s.K * d;
    dy.noalias() = s.K * dd;
    dy += d_log_modulus * y;
    if (d_nu != 0.0) dy.noalias() += d_nu * (s.dK * d);
    const Matrix3 R = modulus(int(e)) * polar_[e].R;
    for (int a = 0; a < 8; ++a)
      force.row(cell[a]).noalias() -= (R * (w.cross(Vector3(node(y, a))) + node(dy, a))).transpose();
  }
}

void CorotatedElasticity::add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar,
                                            VectorX& theta_bar) {
  for (std::size_t e = 0; e < polar_.size(); ++e) {
    const auto& cell = body_->grid.cells[e];
    const Stiffness& s = stiffness(int(e));
    const Matrix3& R = polar_[e].R;
    const double E = modulus(int(e));
    const Vector24 q = unrotated(int(e), z);
    const Vector24 d = q - reference_[e];
    Vector24 c;
    for (int a = 0; a < 8; ++a) node(c, a).noalias() = R.transpose() * w.row(cell[a]).transpose();
    Vector24 y, k;
    y.noalias() = s.K * d;
    k.noalias() = s.K * c;
    Vector3 rate_bar = Vector3::Zero();
    for (int a = 0; a < 8; ++a)
      rate_bar += Vector3(node(q, a)).cross(Vector3(node(k, a))) - Vector3(node(y, a)).cross(Vector3(node(c, a)));
    const Matrix3 F_bar = rotation_rate_adjoint(polar_[e], E * rate_bar);
    for (int a = 0; a < 8; ++a) {
      z_bar.row(cell[a]).noalias() -= E * (R * node(k, a)).transpose();
      lag_bar.row(cell[a]).noalias() += (F_bar * body_->mean_gradient[e].row(a).transpose()).transpose();
    }
    theta_bar[theta::youngs_modulus] -= E / youngs_modulus_ * c.dot(y);
    theta_bar[theta::poissons_ratio] -= E * c.dot(s.dK * d);
  }
}

}  // namespace pliant
