#include "motion/rotation_strain_step.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "elasticity/tet_element.hpp"
namespace pliant {

RotationStrainStep::RotationStrainStep(std::shared_ptr<const Body> body, SolverKind kind)
    : body_(std::move(body)), laplacian_(body_->pattern), excess_(Points::Zero(body_->node_count(), 3)) {
  solver_ = make_linear_solver(body_->pattern, stiffness_solver(kind, *body_->pattern, 1e-10));
  constexpr double regularisation = 1e-8;  // of motions that the parts' gradients do not see
  const auto add = [&](int row, int column, double value) {
    double* block = laplacian_.block(body_->pattern->find(row, column));
    for (const int d : {0, 4, 8}) block[d] += value;
  };
  laplacian_.set_zero();
  for (int e = 0; e < body_->element_count(); ++e) divide(e);
  for (const Part& part : parts_) {
    const auto nodes = body_->element(part.element);
    const MatrixX products = part.volume * part.gradients * part.gradients.transpose();
    for (std::size_t a = 0; a < nodes.size(); ++a)
      for (std::size_t b = 0; b < nodes.size(); ++b)
        add(nodes[a], nodes[b], (a == b ? 1.0 + regularisation : 1.0) * products(Eigen::Index(a), Eigen::Index(b)));
  }
}

void RotationStrainStep::divide(int e) {
  const auto add_part = [&](double part, const Points& gradients) {
    parts_.push_back({e, part, gradients, Matrix3::Zero(), Matrix3::Zero(), Vector3::Zero()});
  };
  const double volume = body_->element_volume[std::size_t(e)];
  if (body_->kind == ElementKind::Tetrahedron) add_part(volume, body_->gradients(e));
  if (body_->kind == ElementKind::QuadraticTetrahedron) {
    Eigen::Matrix<double, 10, 3> X;
    for (int a = 0; a < 10; ++a) X.row(a) = body_->nodes.row(body_->element(e)[std::size_t(a)]);
    for (const TetQuadraturePoint& q : tet_quadrature(2)) add_part(q.weight * volume, tet_gradients<10>(X, q.at));
  }
  if (body_->kind == ElementKind::Hexahedron)  // cut cells as if all eight corners shared what is inside
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3 at(corner & 1 ? 0.75 : 0.25, corner & 2 ? 0.75 : 0.25, corner & 4 ? 0.75 : 0.25);
      add_part(volume / 8.0, shape_gradients(at) / body_->grid().cell_size);
    }
}

bool RotationStrainStep::fix(const std::vector<int>& nodes) {
  if (is_ready_ && nodes == fixed_) return true;
  fixed_ = nodes;
  constrained_ = laplacian_;
  for (const int node : fixed_) constrained_.constrain(node);
  return is_ready_ = !fixed_.empty() && solver_->factorise(constrained_);
}

double RotationStrainStep::prepare(const Points& x, const Points& d) {
  x_ = x, d_ = d;
  double most = 0.0;
  for (Part& part : parts_) {
    const auto nodes = body_->element(part.element);
    Matrix3 dF = Matrix3::Zero();
    part.F.setZero();
    for (std::size_t a = 0; a < nodes.size(); ++a) {
      part.F += x.row(nodes[a]).transpose() * part.gradients.row(Eigen::Index(a));
      dF += d.row(nodes[a]).transpose() * part.gradients.row(Eigen::Index(a));
    }
    part.D.setZero();
    if (part.F.determinant() > 0.0) part.D = dF * part.F.inverse();
    part.turn = 0.5 * Vector3(part.D(2, 1) - part.D(1, 2), part.D(0, 2) - part.D(2, 0), part.D(1, 0) - part.D(0, 1));
    most = std::max(most, part.turn.norm());
  }
  return most;
}

void RotationStrainStep::move(double share, Points& out) {
  excess_.setZero();
  for (const Part& part : parts_) {
    const auto nodes = body_->element(part.element);
    const double angle = share * part.turn.norm();
    if (!(angle > 0.0)) continue;
    const Matrix3 R = Eigen::AngleAxisd(angle, part.turn.normalized()).toRotationMatrix();
    const Matrix3 strained = Matrix3::Identity() + 0.5 * share * (part.D + part.D.transpose());
    const Matrix3 beyond = part.volume * (R * strained - Matrix3::Identity() - share * part.D) * part.F;
    for (std::size_t a = 0; a < nodes.size(); ++a)
      excess_.row(nodes[a]) += (beyond * part.gradients.row(Eigen::Index(a)).transpose()).transpose();
  }
  for (const int node : fixed_) excess_.row(node).setZero();
  correction_.setZero(excess_.size());
  (void)solver_->solve(flat(excess_), correction_);
  out = x_ + share * d_ + as_points(std::as_const(correction_));
}

}  // namespace pliant
