#include "tracking/point_springs.hpp"

#include <stdexcept>
#include <utility>

namespace pliant {

PointSprings::PointSprings(const Body& body, Embedding points)
    : points_(std::move(points)),
      blocks_(element_blocks(body)),
      stiffness_(VectorX::Zero(points_.point_count())),
      targets_(Points::Zero(points_.point_count(), 3)) {}

void PointSprings::set(VectorX stiffness, Points targets) {
  if (stiffness.size() != count() || targets.rows() != count())
    throw std::invalid_argument("one stiffness and one target a point are expected");
  stiffness_ = std::move(stiffness);
  targets_ = std::move(targets);
}

void PointSprings::add_force(const Points& z, Points& force) {
  for (int i = 0; i < count(); ++i)
    if (stiffness_[i] > 0.0)
      points_.add_transpose(i, stiffness_[i] * (targets_.row(i).transpose() - points_.position(i, z)), force);
}

void PointSprings::add_matrix(double scale, BlockMatrix& matrix) {
  const auto n = std::size_t(points_.nodes_per_point());
  for (int i = 0; i < count(); ++i) {
    if (stiffness_[i] == 0.0) continue;
    const auto weights = points_.weights(i);
    const int* to = blocks_.data() + std::size_t(points_.element(i)) * n * n;
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b) {
        double* block = matrix.block(to[a * n + b]);
        const double k = scale * stiffness_[i] * weights[a] * weights[b];
        block[0] += k, block[4] += k, block[8] += k;
      }
  }
}

void PointSprings::subtract_stiffness(const Points& z, Points& out) const {
  for (int i = 0; i < points_.point_count(); ++i)
    if (stiffness_[i] > 0.0) points_.add_transpose(i, -stiffness_[i] * points_.position(i, z), out);
}

void PointSprings::add_force_tangent(const Points&, const Points&, const Points& d_z, const VectorX&, Points& force) {
  subtract_stiffness(d_z, force);
}

void PointSprings::add_force_adjoint(const Points&, const Points& w, Points&, Points& z_bar, VectorX&) {
  subtract_stiffness(w, z_bar);
}

}  // namespace pliant
