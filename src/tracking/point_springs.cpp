#include "tracking/point_springs.hpp"

#include <stdexcept>
#include <utility>

namespace pliant {

PointSprings::PointSprings(const Body& body, Embedding points) : points_(std::move(points)), blocks_(body.blocks) {
  clear();
}

void PointSprings::clear() {
  stiffness_.setZero(count());
  targets_.setZero(count(), 3);
  normals_.setZero(count(), 3);
}

void PointSprings::set(VectorX stiffness, Points targets, Points normals, double tangential) {
  if (stiffness.size() != count() || targets.rows() != count() || normals.rows() != count())
    throw std::invalid_argument("one stiffness, one target and one normal a point are expected");
  stiffness_ = std::move(stiffness);
  targets_ = std::move(targets);
  normals_ = std::move(normals);
  tangential_ = tangential;
}

Vector3 PointSprings::force(int i, const Vector3& stretch) const {
  const Vector3 n = normals_.row(i);
  const double t = n.isZero(0.0) ? 1.0 : tangential_;
  return stiffness_[i] * (t * stretch + (1.0 - t) * n.dot(stretch) * n);
}

void PointSprings::add_force(const Points& z, Points& forces) {
  for (int i = 0; i < count(); ++i)
    if (stiffness_[i] > 0.0)
      points_.add_transpose(i, force(i, targets_.row(i).transpose() - points_.position(i, z)), forces);
}

void PointSprings::add_matrix(double scale, BlockMatrix& matrix) {
  const auto count_of_nodes = std::size_t(points_.nodes_per_point());
  for (int i = 0; i < count(); ++i) {
    if (stiffness_[i] == 0.0) continue;
    Matrix3 K;
    for (int d = 0; d < 3; ++d) K.col(d) = scale * force(i, Vector3::Unit(d));
    const auto weights = points_.weights(i);
    const int* to = blocks_->data() + std::size_t(points_.element(i)) * count_of_nodes * count_of_nodes;
    for (std::size_t a = 0; a < count_of_nodes; ++a)
      for (std::size_t b = 0; b < count_of_nodes; ++b)
        Eigen::Map<Matrix3>(matrix.block(to[a * count_of_nodes + b])) += weights[a] * weights[b] * K;
  }
}

void PointSprings::add_force_tangent(const Points&, const Points&, const Points& d_z, const VectorX&, Points& forces) {
  for (int i = 0; i < count(); ++i)
    if (stiffness_[i] > 0.0) points_.add_transpose(i, force(i, -points_.position(i, d_z)), forces);
}

void PointSprings::add_force_adjoint(const Points&, const Points& w, Points&, Points& z_bar, VectorX&) {
  for (int i = 0; i < count(); ++i)
    if (stiffness_[i] > 0.0) points_.add_transpose(i, force(i, -points_.position(i, w)), z_bar);
}

}  // namespace pliant
