#include "motion/body_forces.hpp"

#include <utility>

namespace pliant {

std::optional<double> DeadLoad::potential(const Points& x) {
  force_.setZero(x.rows(), 3);
  add_force(x, force_);
  const Eigen::Index n = rest_.rows();
  return -force_.topRows(n).cwiseProduct(x.topRows(n) - rest_).sum();
}

Gravity::Gravity(const Body& body, const MotionBlocks& blocks, KeyFrames<3> change)
    : DeadLoad(body.nodes),
      density_block_(blocks.density),
      gravity_block_(blocks.gravity),
      change_(std::move(change)),
      change_now_(change_.at(0.0)) {
  Points ones = Points::Ones(body.node_count(), 3), sum = Points::Zero(body.node_count(), 3);
  body.add_mass_product(1.0, ones, sum);
  nodal_volume_ = sum.col(0);
}

void Gravity::set_parameters(const VectorX& parameters) {
  density_ = parameters[density_block_];
  gravity_ = gravity_block_.vector(parameters);
}

void Gravity::add_force(const Points&, Points& force) {
  force.noalias() += nodal_volume_ * (density_ * (gravity_ + change_now_)).transpose();
}

void Gravity::add_force_tangent(const Points&, const Points&, const Points&, const VectorX& d_theta, Points& force) {
  const Vector3 change = d_theta[density_block_] * (gravity_ + change_now_) + density_ * gravity_block_.vector(d_theta);
  force.noalias() += nodal_volume_ * change.transpose();
}

void Gravity::add_force_adjoint(const Points&, const Points& w, Points&, Points&, VectorX& theta_bar) {
  const Vector3 sum = w.transpose() * nodal_volume_;
  theta_bar[density_block_] += (gravity_ + change_now_).dot(sum);
  theta_bar.segment<3>(gravity_block_) += density_ * sum;
}

PointWeights::PointWeights(const Body& body, const std::vector<PointMass>& weights, const ParameterHandle& gravity,
                           KeyFrames<3> change)
    : DeadLoad(body.nodes), gravity_block_(gravity), change_(std::move(change)), change_now_(change_.at(0.0)) {
  std::vector<Vector3> at;
  for (const PointMass& weight : weights) {
    at.push_back(weight.at);
    mass_.push_back(weight.mass);
  }
  points_ = Embedding(body, at);
}

void PointWeights::add_force(const Points&, Points& force) {
  if (!is_active_) return;
  const Vector3 gravity = gravity_ + change_now_;
  for (int i = 0; i < points_.point_count(); ++i) points_.add_transpose(i, mass_[std::size_t(i)] * gravity, force);
}

void PointWeights::add_force_tangent(const Points&, const Points&, const Points&, const VectorX& d_theta,
                                     Points& force) {
  if (!is_active_) return;
  const Vector3 change = gravity_block_.vector(d_theta);
  for (int i = 0; i < points_.point_count(); ++i) points_.add_transpose(i, mass_[std::size_t(i)] * change, force);
}

void PointWeights::add_force_adjoint(const Points&, const Points& w, Points&, Points&, VectorX& theta_bar) {
  if (!is_active_) return;
  for (int i = 0; i < points_.point_count(); ++i)
    theta_bar.segment<3>(gravity_block_) += mass_[std::size_t(i)] * points_.position(i, w);
}

}  // namespace pliant
