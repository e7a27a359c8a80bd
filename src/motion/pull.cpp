#include "motion/pull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/error.hpp"
#include "motion/linear_statics.hpp"

namespace pliant {

namespace {

constexpr double width = 0.15;  // of the Gaussians, times the object's size

VectorX volume_of_nodes(const Body& body) {
  const Points ones = Points::Ones(body.node_count(), 3);
  Points sum = Points::Zero(body.node_count(), 3);
  body.add_mass_product(1.0, ones, sum);
  return sum.col(0);
}

/// Greatest displacement for each column of forces of a body of unit Young's modulus, by linear elasticity from rest.
VectorX greatest_displacements(const std::shared_ptr<const Body>& body, const std::vector<int>& held,
                               const std::vector<Points>& forces) {
  auto even = std::make_shared<Body>(*body);
  even->modulus = {1, {}, std::vector<double>(body->modulus.relative.size(), 1.0)};
  const MotionLayout layout;
  VectorX theta = layout.zero();
  layout.set_moduli(theta, 1.0);
  theta[layout.poissons_ratio] = 0.3;
  const LinearStatics statics(even, held, layout, theta);
  if (!statics.is_held())
    throw InputError({{},
                      "nothing holds the object while it is pulled",
                      "a [[fixed]] region that contains a part of the object",
                      "say in capture.toml where the object is held before and after it is released"});
  VectorX greatest(Eigen::Index(forces.size()));
  for (std::size_t i = 0; i < forces.size(); ++i) greatest[Eigen::Index(i)] = statics.greatest_displacement(forces[i]);
  return greatest;
}

}  // namespace

MatrixX pull_spread(const Body& body, const PullPoints& points) {
  const VectorX volume = volume_of_nodes(body);
  const double reach = width * points.size;
  MatrixX spread(body.node_count(), Eigen::Index(points.at.size()));
  for (Eigen::Index k = 0; k < spread.cols(); ++k) {
    const VectorX r2 =
        (body.scanned_positions().rowwise() - points.at[std::size_t(k)].transpose()).rowwise().squaredNorm();
    spread.col(k) = volume.cwiseProduct((-0.5 * r2.array() / (reach * reach)).exp().matrix());
  }
  return spread;
}

Pull::Pull(const std::shared_ptr<const Body>& body, const PullPoints& points, const std::vector<int>& held,
           const MotionBlocks& blocks)
    : DeadLoad(body->nodes), pull_blocks_(blocks.pulls), material_(blocks) {
  const auto n = Eigen::Index(points.at.size());
  spread_ = pull_spread(*body, points);
  std::vector<Points> forces;
  for (Eigen::Index k = 0; k < n; ++k)
    for (int d = 0; d < 3; ++d) {
      forces.emplace_back(Points::Zero(body->node_count(), 3));
      forces.back().col(d) = spread_.col(k);
    }
  const VectorX greatest = greatest_displacements(body, held, forces);
  if (points.at.size() != pull_blocks_.size()) throw std::invalid_argument("one parameter block a pull is expected");
  strength_.resize(n, 3);
  for (Eigen::Index k = 0; k < n; ++k)
    for (int d = 0; d < 3; ++d) strength_(k, d) = points.size / greatest[3 * k + d];
  pulls_ = Points::Zero(n, 3);
  moduli_at_.setOnes(body->modulus.controls);
  const ModulusField& field = body->modulus;
  const Eigen::Map<const VectorX> element_volume(body->element_volume.data(),
                                                 Eigen::Index(body->element_volume.size()));
  const Eigen::Map<const VectorX> relative(field.relative.data(), Eigen::Index(field.relative.size()));
  const VectorX part = element_volume / element_volume.sum();
  share_ = field.controls == 1 ? VectorX::Ones(1) : VectorX(field.weights.transpose() * part);
  log_relative_ = part.dot(relative.array().log().matrix());
}

void Pull::set_parameters(const VectorX& parameters) {
  moduli_at_ = material_.moduli(parameters);
  mean_ = std::exp(log_relative_ + share_.dot(moduli_at_.array().log().matrix()));
  for (Eigen::Index k = 0; k < count(); ++k)
    pulls_.row(k) = strength_.row(k).cwiseProduct(pull_blocks_[std::size_t(k)].vector(parameters).transpose());
}

void Pull::add_force(const Points&, Points& force) {
  if (is_active_) force.noalias() += mean_ * (spread_ * pulls_);
}

void Pull::add_force_tangent(const Points&, const Points&, const Points&, const VectorX& d_theta, Points& force) {
  if (!is_active_) return;
  const double d_log_mean = share_.dot(material_.moduli(d_theta).cwiseQuotient(moduli_at_));
  Points change = d_log_mean * pulls_;
  for (Eigen::Index k = 0; k < count(); ++k)
    change.row(k) += strength_.row(k).cwiseProduct(pull_blocks_[std::size_t(k)].vector(d_theta).transpose());
  force.noalias() += mean_ * (spread_ * change);
}

void Pull::add_force_adjoint(const Points&, const Points& w, Points&, Points&, VectorX& theta_bar) {
  if (!is_active_) return;
  const Points bar = mean_ * (spread_.transpose() * w);
  const double log_mean_bar = bar.cwiseProduct(pulls_).sum();
  for (Eigen::Index k = 0; k < moduli_at_.size(); ++k)
    theta_bar[material_.youngs_moduli[std::size_t(k)]] += log_mean_bar * share_[k] / moduli_at_[k];
  for (Eigen::Index k = 0; k < count(); ++k)
    theta_bar.segment<3>(pull_blocks_[std::size_t(k)]) += bar.row(k).cwiseProduct(strength_.row(k)).transpose();
}

std::vector<Vector3> far_points(const std::vector<Vector3>& candidates, const std::vector<Vector3>& held, int count) {
  if (candidates.empty() || held.empty()) throw std::invalid_argument("far_points: no candidates, or no held points");
  std::vector<double> nearest(candidates.size(), std::numeric_limits<double>::infinity());
  const auto leave = [&](const Vector3& point) {
    for (std::size_t i = 0; i < candidates.size(); ++i)
      nearest[i] = std::min(nearest[i], (candidates[i] - point).squaredNorm());
  };
  for (const Vector3& point : held) leave(point);
  std::vector<Vector3> points;
  for (int k = 0; k < count; ++k) {
    points.push_back(candidates[std::size_t(std::ranges::max_element(nearest) - nearest.begin())]);
    leave(points.back());
  }
  return points;
}

}  // namespace pliant
