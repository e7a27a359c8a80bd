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

RegionPatch region_patch(const Body& body, const std::function<bool(const Vector3&)>& contains) {
  RegionPatch region;
  const auto add = [&](const Vector3& point, double volume) {
    if (!contains(point)) return;
    region.patch.rest.push_back(point), region.patch.share.push_back(volume);
    region.volume += volume;
  };
  if (body.kind == ElementKind::Hexahedron) {
    constexpr int n = 4;
    const HexGrid& grid = body.grid();
    for (int e = 0; e < grid.cell_count(); ++e) {
      const Vector3 corner = grid.origin + grid.cell_size * grid.cell_index[std::size_t(e)].cast<double>();
      for (int s = 0; s < n * n * n; ++s)
        add(corner + grid.cell_size / n * (Vector3(s % n, s / n % n, s / (n * n)).array() + 0.5).matrix(),
            body.element_volume[std::size_t(e)] / (n * n * n));
    }
  } else {
    Points volume = Points::Zero(body.node_count(), 3);
    body.add_mass_product(1.0, Points::Ones(body.node_count(), 3), volume);
    // Corners of quadratic elements have no volume of their own, or less than none.
    const double least = 0.1 * body.volume() / std::max(1, body.node_count());
    for (int n = 0; n < body.node_count(); ++n)
      add(body.scanned_positions().row(n).transpose(), std::max(least, volume(n, 0)));
  }
  for (double& share : region.patch.share) share /= region.volume;
  return region;
}

LedSprings::LedSprings(const Body& body, const Patch& patch, LedSpringsOptions options)
    : options_(std::move(options)),
      stiffness_(options_.stiffness),
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

void LedSprings::set_parameters(const VectorX& theta) {
  moduli_.clear();
  double log_mean = 0.0;
  for (const ParameterHandle& modulus : options_.moduli) {
    moduli_.push_back(theta[modulus]);
    log_mean += std::log(moduli_.back()) / double(options_.moduli.size());
  }
  stiffness_ = options_.stiffness * std::exp(log_mean);
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
  for (int i = 0; i < points_.point_count() && holds_; ++i) sum -= stiffness(i) * way(i, z);
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
  for (int i = 0; i < points_.point_count() && holds_; ++i) points_.add_transpose(i, -stiffness(i) * way(i, z), force);
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
  for (int i = 0; i < points_.point_count() && holds_; ++i) sum += 0.5 * stiffness(i) * way(i, x).squaredNorm();
  return sum;
}

void LedSprings::add_force_tangent(const Points& z, const Points&, const Points& d_z, const VectorX& d_theta,
                                   Points& force) {
  double d_log = 0.0;
  for (std::size_t k = 0; k < moduli_.size(); ++k)
    d_log += d_theta[options_.moduli[k]] / moduli_[k] / double(moduli_.size());
  for (int i = 0; i < points_.point_count() && holds_; ++i)
    points_.add_transpose(i, -stiffness(i) * (points_.position(i, d_z) + d_log * way(i, z)), force);
}

void LedSprings::add_force_adjoint(const Points& z, const Points& w, Points&, Points& z_bar, VectorX& theta_bar) {
  double log_bar = 0.0;
  for (int i = 0; i < points_.point_count() && holds_; ++i) {
    const Vector3 of_point = points_.position(i, w);
    log_bar -= stiffness(i) * way(i, z).dot(of_point);
    points_.add_transpose(i, -stiffness(i) * of_point, z_bar);
  }
  for (std::size_t k = 0; k < moduli_.size(); ++k)
    theta_bar[options_.moduli[k]] += log_bar / moduli_[k] / double(moduli_.size());
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
