#include "motion/patch_forces.hpp"

#include <cmath>
#include <stdexcept>

namespace pliant {

Patch surface_patch(const Body& body, const Vector3& centre, double radius) {
  Patch patch;
  const SurfacePoint* nearest = nullptr;
  double sum = 0.0;
  for (const SurfacePoint& p : body.surface) {
    const double distance = (p.position - centre).norm();
    if (!nearest || distance < (nearest->position - centre).norm()) nearest = &p;
    if (!(distance < radius)) continue;
    const double inside = 1.0 - std::pow(distance / radius, 2);
    patch.rest.push_back(p.position);
    patch.share.push_back(p.area * inside * inside);
    sum += patch.share.back();
  }
  if (!(sum > 0.0) && nearest) return {{nearest->position}, {1.0}};
  for (double& share : patch.share) share /= sum;
  return patch;
}

Patch node_patch(const Body& body, const std::vector<int>& nodes) {
  if (nodes.empty()) throw std::invalid_argument("a patch of nodes needs one");
  Points volume = Points::Zero(body.node_count(), 3);
  body.add_mass_product(1.0, Points::Ones(body.node_count(), 3), volume);
  Patch patch;
  double sum = 0.0;
  for (const int node : nodes) {
    patch.rest.push_back(body.scanned_positions().row(node).transpose());
    patch.share.push_back(std::max(0.0, volume(node, 0)));
    sum += patch.share.back();
  }
  for (double& share : patch.share) share = sum > 0.0 ? share / sum : 1.0 / double(nodes.size());
  return patch;
}

LedSprings::LedSprings(const Body& body, const Patch& patch, LedSpringsOptions options)
    : options_(std::move(options)),
      points_(body, patch.rest),
      share_(patch.share),
      blocks_(body.blocks),
      rest_(patch.rest),
      anchor_(patch.rest),
      target_(patch.rest) {
  if (patch.rest.empty() || patch.rest.size() != patch.share.size())
    throw std::invalid_argument("a grip needs points, with a share each");
  if (!(options_.stiffness > 0.0)) throw std::invalid_argument("a grip's stiffness must be positive");
}

void LedSprings::take_hold(const Points& positions, double time) {
  for (std::size_t i = 0; i < anchor_.size(); ++i) anchor_[i] = points_.position(int(i), positions);
  took_hold_ = time;
}

void LedSprings::begin_step(const StepContext& step) {
  const double end = step.time + step.dt;
  holds_ = step.time >= options_.from - 1e-12 && end <= options_.until + 1e-12;
  if (step.time < options_.from) took_hold_ = infinite;
  if (!holds_) return;
  if (options_.from_rest) {
    const RigidMotion motion = options_.motion.at(end);
    for (std::size_t i = 0; i < target_.size(); ++i) target_[i] = motion(rest_[i]);
    return;
  }
  // A step may be taken again from an earlier time.
  if (!step.start) {
    anchor_ = rest_, took_hold_ = infinite;
  } else if (!(took_hold_ < step.time)) {
    take_hold(*step.start, step.time);
  }
  const double since = std::min(took_hold_, step.time);
  const RigidMotion then = options_.motion.at(since), now = options_.motion.at(end);
  if (!options_.reaches) {
    for (std::size_t i = 0; i < target_.size(); ++i) target_[i] = now(then.inverse()(anchor_[i]));
    return;
  }
  Vector3 centre = Vector3::Zero();
  for (std::size_t i = 0; i < anchor_.size(); ++i) centre += share_[i] * anchor_[i];
  const Matrix3 turn = now.rotation * then.rotation.transpose();
  const Vector3 to = now(Vector3::Zero());
  for (std::size_t i = 0; i < target_.size(); ++i) target_[i] = turn * (anchor_[i] - centre) + to;
}

Vector3 LedSprings::force(const Points& z) const {
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < points_.point_count() && holds_; ++i)
    sum -= stiffness(i) * (points_.position(i, z) - target_[std::size_t(i)]);
  return sum;
}

void LedSprings::move_to(const Vector3& place) {
  KeyFrames<6>::Value shift = KeyFrames<6>::Value::Zero();
  shift.head<3>() = place;
  options_.motion = KeyedMotion(Vector3::Zero(), KeyFrames<6>(shift));
  const Vector3 way = place - this->place();
  for (Vector3& target : target_) target += way;
}

Vector3 LedSprings::place() const {
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i < target_.size(); ++i) sum += share_[i] * target_[i];
  return sum;
}

Vector3 LedSprings::middle(const Points& z) const {
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < points_.point_count(); ++i) sum += share_[std::size_t(i)] * points_.position(i, z);
  return sum;
}

void LedSprings::add_force(const Points& z, Points& force) {
  for (int i = 0; i < points_.point_count() && holds_; ++i)
    points_.add_transpose(i, -stiffness(i) * (points_.position(i, z) - target_[std::size_t(i)]), force);
}

void LedSprings::add_matrix(double scale, BlockMatrix& matrix) {
  const int n = points_.nodes_per_point();
  for (int i = 0; i < points_.point_count() && holds_; ++i) {
    const auto w = points_.weights(i);
    const int* blocks = blocks_->data() + std::size_t(points_.element(i)) * std::size_t(n * n);
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b) {
        double* block = matrix.block(blocks[n * a + b]);
        for (const int d : {0, 4, 8}) block[d] += scale * stiffness(i) * w[std::size_t(a)] * w[std::size_t(b)];
      }
  }
}

std::optional<double> LedSprings::potential(const Points& x) {
  double sum = 0.0;
  for (int i = 0; i < points_.point_count() && holds_; ++i)
    sum += 0.5 * stiffness(i) * (points_.position(i, x) - target_[std::size_t(i)]).squaredNorm();
  return sum;
}

void LedSprings::add_force_tangent(const Points&, const Points&, const Points& d_z, const VectorX&, Points& force) {
  for (int i = 0; i < points_.point_count() && holds_; ++i)
    points_.add_transpose(i, -stiffness(i) * points_.position(i, d_z), force);
}

void LedSprings::add_force_adjoint(const Points&, const Points& w, Points&, Points& z_bar, VectorX&) {
  for (int i = 0; i < points_.point_count() && holds_; ++i)
    points_.add_transpose(i, -stiffness(i) * points_.position(i, w), z_bar);
}

PatchLoad::PatchLoad(const Body& body, const Patch& patch, KeyFrames<3> force, const ParameterHandle& strength)
    : DeadLoad(body.nodes),
      points_(body, patch.rest),
      share_(patch.share),
      force_over_time_(std::move(force)),
      strength_(strength) {}

void PatchLoad::spread(const Vector3& force, Points& out) const {
  for (int i = 0; i < points_.point_count(); ++i) points_.add_transpose(i, share_[std::size_t(i)] * force, out);
}

void PatchLoad::add_force_tangent(const Points&, const Points&, const Points&, const VectorX& d_theta, Points& force) {
  if (strength_.exists()) spread(d_theta[strength_] * now_, force);
}

void PatchLoad::add_force_adjoint(const Points&, const Points& w, Points&, Points&, VectorX& theta_bar) {
  if (!strength_.exists()) return;
  for (int i = 0; i < points_.point_count(); ++i)
    theta_bar[strength_] += share_[std::size_t(i)] * now_.dot(points_.position(i, w));
}

}  // namespace pliant
