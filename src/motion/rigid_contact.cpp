#include "motion/rigid_contact.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace pliant {

RigidContact::RigidContact(const Body& body, const ContactSamples& samples)
    : points_(body, samples.rest), rest_(samples.rest), bond_(samples.rest), area_(samples.area), blocks_(body.blocks) {
  active_.reserve(rest_.size());
}

RigidContact RigidContact::bonded(const Body& body, const ContactSamples& samples, double stiffness) {
  if (!(stiffness > 0.0)) throw std::invalid_argument("a bonded contact needs a positive stiffness");
  RigidContact contact(body, samples);
  contact.penalty_.stiffness = stiffness;
  return contact;
}

RigidContact RigidContact::sliding(const Body& body, const ContactSamples& samples,
                                   std::shared_ptr<const RigidShape> shape, const Penalty& penalty,
                                   const ContactBlock& block) {
  if (!(penalty.stiffness > 0.0) || !(penalty.smoothing > 0.0))
    throw std::invalid_argument("contact needs a positive stiffness and smoothing length");
  RigidContact contact(body, samples);
  contact.shape_ = std::move(shape);
  contact.block_ = block;
  contact.penalty_ = penalty;
  return contact;
}

RigidContact RigidContact::sliding(const Body& body, const ContactSamples& samples, const PlaneBlock& plane,
                                   const Penalty& penalty) {
  RigidContact contact = sliding(body, samples, nullptr, penalty);
  contact.plane_ = plane;
  contact.block_ = {plane.friction, plane.stiffness};
  return contact;
}

double RigidContact::area() const { return std::accumulate(area_.begin(), area_.end(), 0.0); }

void RigidContact::set_friction(double coefficient, double speed) {
  if (!(coefficient >= 0.0) || !(speed > 0.0))
    throw std::invalid_argument("friction needs a coefficient that is not negative and a positive speed");
  friction_ = coefficient;
  friction_speed_ = speed;
}

void RigidContact::set_row(const Body& body, int row, const BlockPattern& pattern) {
  row_ = row;
  blocks_ = std::make_shared<std::vector<int>>(element_blocks(body, pattern));
  row_diagonal_ = pattern.diagonal[std::size_t(row)];
  links_.clear();
  for (int i = 0; i < points_.point_count(); ++i) {
    const auto nodes = points_.nodes(i);
    const auto weights = points_.weights(i);
    const auto weighs = [&](std::size_t a) { return std::abs(weights[a]) > 1e-12; };
    for (std::size_t a = 0; a < nodes.size(); ++a) links_.push_back(weighs(a) ? pattern.find(nodes[a], row) : -1);
    for (std::size_t a = 0; a < nodes.size(); ++a) links_.push_back(weighs(a) ? pattern.find(row, nodes[a]) : -1);
  }
}

void RigidContact::set_parameters(const VectorX& theta) {
  if (plane_) {
    plane_point_ = plane_->point.vector(theta);
    plane_normal_ = plane_->normal.vector(theta);
  }
  if (block_.friction.exists()) friction_ = theta[block_.friction];
  follows_stiffness_ = block_.stiffness.exists() && theta[block_.stiffness] > 0.0;
  if (follows_stiffness_) penalty_.stiffness = theta[block_.stiffness];
}

void RigidContact::lead(KeyedMotion motion) {
  if (!shape_) throw std::invalid_argument("a shape can be led, not a bond or a plane of the parameter vector");
  led_shape_ = shape_;
  motion_ = std::move(motion);
  begin_step({});
}

void RigidContact::turn(const Matrix3& rotation, const Vector3& centre) {
  if (plane_ || led_shape_)
    throw std::invalid_argument("a plane of the parameter vector or a shape that is led is not turned");
  const RigidMotion motion{rotation, centre - rotation * centre};
  if (is_bonded()) {
    for (std::size_t i = 0; i < rest_.size(); ++i) bond_[i] = motion(rest_[i]);
    return;
  }
  if (!first_shape_) first_shape_ = shape_;
  shape_ = rigid_moved(first_shape_, motion);
}

void RigidContact::begin_step(const StepContext& step) {
  start_ = step.start;
  threshold_ = friction_speed_ * step.dt;
  if (!led_shape_) return;
  const RigidMotion now = motion_.at(step.time + step.contact_weight * step.dt);
  const RigidMotion before = motion_.at(step.time).inverse();
  shape_ = rigid_moved(led_shape_, now);
  carried_ = {now.rotation * before.rotation, now(before.translation)};
}

bool RigidContact::may_rub() const {
  return start_ && friction_speed_ > 0.0 && (friction_ > 0.0 || block_.friction.exists());
}

void RigidContact::touch_at_rest() {
  if (!shape_) throw std::invalid_argument("a bond or a plane of the parameter vector has no gap at rest");
  overlap_.clear();
  for (const Vector3& point : rest_)
    overlap_.push_back(std::min(0.0, shape_->sample(point).distance - penalty_.reach()));
}

RigidShape::Sample RigidContact::surface(int point, const Vector3& y) const {
  if (shape_) {
    RigidShape::Sample at = shape_->sample(y);
    if (!overlap_.empty()) at.distance -= overlap_[std::size_t(point)];
    return at;
  }
  return {plane_normal_.dot(y - plane_point_), plane_normal_, Matrix3::Zero()};
}

Vector3 RigidContact::relative(int point, const Points& positions) const {
  const Vector3 x = points_.position(point, positions);
  return row_ < 0 ? Vector3(x - translation_) : Vector3(x - positions.row(row_).transpose());
}

Vector3 RigidContact::relative_change(int point, const Points& changes) const {
  const Vector3 x = points_.position(point, changes);
  return row_ < 0 ? x : Vector3(x - changes.row(row_).transpose());
}

void RigidContact::scatter(int point, const Vector3& vector, Points& out) const {
  points_.add_transpose(point, vector, out);
  if (row_ >= 0) out.row(row_) -= vector.transpose();
}

void RigidContact::scatter_block(int point, const Matrix3& block, BlockMatrix& matrix) const {
  const auto w = points_.weights(point);
  const int n = points_.nodes_per_point();
  const int* blocks = blocks_->data() + std::size_t(points_.element(point)) * std::size_t(n * n);
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < n; ++b)
      Eigen::Map<Matrix3>(matrix.block(blocks[n * a + b])) += w[std::size_t(a)] * w[std::size_t(b)] * block;
  if (row_ < 0) return;
  const int* links = links_.data() + std::size_t(point) * std::size_t(2 * n);
  for (int a = 0; a < n; ++a) {
    if (links[a] < 0) continue;
    Eigen::Map<Matrix3>(matrix.block(links[a])) -= w[std::size_t(a)] * block;
    Eigen::Map<Matrix3>(matrix.block(links[n + a])) -= w[std::size_t(a)] * block;
  }
  Eigen::Map<Matrix3>(matrix.block(row_diagonal_)) += block;
}

template <class Visit>
void RigidContact::for_bonded(Visit&& visit) const {
  for (int i = 0; i < points_.point_count(); ++i) visit(i, penalty_.stiffness * area_[std::size_t(i)]);
}

void RigidContact::linearise(const Points& lag) {
  if (is_bonded()) return;
  active_.clear();
  details_.clear();
  const double reach = penalty_.reach();
  const bool rubbing = rubs();
  for (int p = 0; p < points_.point_count(); ++p) {
    const Vector3 y = relative(p, lag);
    if (shape_) {
      const RigidShape::Sample at = surface(p, y);
      if (at.distance > reach) continue;
      touch(p, y, at.distance, at.gradient);
      details_.emplace_back().bend = at.hessian;
    } else {
      const double gap = plane_normal_.dot(y - plane_point_);
      if (gap > reach) continue;
      touch(p, y, gap, plane_normal_);
      if (rubbing) details_.emplace_back();
    }
    if (rubbing) add_friction(active_.back(), details_.back());
  }
}

void RigidContact::touch(int point, const Vector3& y, double gap, const Vector3& normal) {
  const Penalty::Value value = penalty_.pressure_at(gap);
  const double a = area_[std::size_t(point)];
  active_.push_back({point, y, normal, gap, a * value.pressure, a * value.slope, a * value.curvature});
}

void RigidContact::add_friction(const Active& c, Detail& m) const {
  m.start = carried_(relative(c.point, *start_));
  m.per_normal = 1.0 / c.normal.norm();
  m.axis = m.per_normal * c.normal;
  m.axis_way = m.axis.dot(c.y - m.start);
  m.way = m.across(c.y - m.start);
  m.length = std::sqrt(m.way.squaredNorm() + threshold_ * threshold_);
  m.drag = friction_ * c.force / m.length;
}

RigidContact::Detail RigidContact::detail(std::size_t i) const {
  Detail m;
  if (!details_.empty()) m = details_[i];
  if (may_rub() && !rubs()) add_friction(active_[i], m);
  return m;
}

RigidContact::Offsets RigidContact::offsets(const Active& c, const Detail& m, const Points& z) const {
  const Vector3 y = relative(c.point, z);
  Offsets o;
  o.q = y - c.y;
  o.c = c.normal.dot(o.q);
  o.normal = m.axis.dot(y - m.start);
  o.slid = m.across(y - m.start);
  return o;
}

void RigidContact::add_force(const Points& z, Points& force) {
  if (is_bonded())
    for_bonded([&](int i, double k) { scatter(i, -k * (relative(i, z) - bond_[std::size_t(i)]), force); });
  const bool rubbing = rubs();
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Active& c = active_[i];
    const Vector3 y = relative(c.point, z);
    Vector3 f = (c.force + c.slope * c.normal.dot(y - c.y)) * c.normal;
    if (rubbing) f -= details_[i].drag * details_[i].across(y - details_[i].start);
    scatter(c.point, f, force);
  }
}

void RigidContact::add_matrix(double scale, BlockMatrix& matrix) {
  if (is_bonded()) for_bonded([&](int i, double k) { scatter_block(i, scale * k * Matrix3::Identity(), matrix); });
  const bool rubbing = rubs();
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Active& c = active_[i];
    Matrix3 block = -scale * c.slope * c.normal * c.normal.transpose();
    if (rubbing) {
      const Detail& m = details_[i];
      block += scale * m.drag * (Matrix3::Identity() - m.axis * m.axis.transpose());
    }
    scatter_block(c.point, block, matrix);
  }
}

/// Of the force's affine form by the lag point, with D = dn/dy:
///   normal:    n (C c n + S D q)^T + (F + S c) D
///   friction:  -slid (d drag)^T + drag ((m.w) A + m (A^T w)^T), w = y_z - start, drag = mu F / r, m = n / |n|, A =
///   dm/dy
void RigidContact::add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) {
  const Detail none;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Active& c = active_[i];
    const Detail& m = details_.empty() ? none : details_[i];
    const Offsets o = offsets(c, m, z);
    if (details_.empty() && o.c == 0.0) continue;
    Matrix3 change = c.normal * (c.curvature * o.c * c.normal + c.slope * (m.bend * o.q)).transpose() +
                     (c.force + c.slope * o.c) * m.bend;
    if (m.drag > 0.0) {
      const Matrix3 bend = m.per_normal * (m.bend - m.axis * (m.axis.transpose() * m.bend));
      const Vector3 by_length = (m.way - m.axis_way * (bend.transpose() * m.way)) / m.length;
      const Vector3 by_drag = (friction_ * c.slope * c.normal - m.drag * by_length) / m.length;
      const Vector3 w = o.slid + o.normal * m.axis;
      change += m.drag * (o.normal * bend + m.axis * (bend.transpose() * w).transpose()) - o.slid * by_drag.transpose();
    }
    scatter_block(c.point, -scale * change, matrix);
  }
}

std::optional<double> RigidContact::potential(const Points& x) {
  if (rubs()) return std::nullopt;
  double sum = 0.0;
  if (is_bonded())
    for_bonded([&](int i, double k) { sum += 0.5 * k * (relative(i, x) - bond_[std::size_t(i)]).squaredNorm(); });
  for (const Active& c : active_) sum += area_[std::size_t(c.point)] * penalty_.at(c.gap).energy;
  return sum;
}

void RigidContact::add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                                     Points& force) {
  if (is_bonded()) for_bonded([&](int i, double k) { scatter(i, -k * relative_change(i, d_z), force); });
  const Vector3 d_point = plane_ ? plane_->point.vector(d_theta) : Vector3::Zero();
  const Vector3 d_plane_normal = plane_ ? plane_->normal.vector(d_theta) : Vector3::Zero();
  const double d_friction = block_.friction.exists() ? d_theta[block_.friction] : 0.0;
  const double d_log_stiffness = follows_stiffness_ ? d_theta[block_.stiffness] / penalty_.stiffness : 0.0;
  const bool has_details = shape_ || rubs() || (d_friction != 0.0 && may_rub());
  const Detail none;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Active& c = active_[i];
    const Detail m = has_details ? detail(i) : none;
    const Offsets o = offsets(c, m, z);
    const Vector3 d_y = relative_change(c.point, d_lag), d_end = relative_change(c.point, d_z);
    const Vector3 d_from_plane = d_y - d_point;
    Vector3 d_normal = d_plane_normal;
    if (shape_) d_normal += m.bend * d_from_plane;
    const double d_gap = c.normal.dot(d_from_plane) + d_plane_normal.dot(c.y - plane_point_);
    const double d_c = d_normal.dot(o.q) + c.normal.dot(d_end - d_y);
    Vector3 f = (c.curvature * o.c * d_gap + c.slope * (d_gap + d_c)) * c.normal + (c.force + c.slope * o.c) * d_normal;
    if (m.drag > 0.0) {
      const Vector3 d_axis = m.axis_change(d_normal), w = o.slid + o.normal * m.axis;
      const double d_length = (m.way.dot(d_y) - m.way.dot(d_axis) * m.axis_way) / m.length;
      const double d_drag = (friction_ * c.slope * d_gap - m.drag * d_length) / m.length;
      f -= d_drag * o.slid + m.drag * (m.across(d_end) - o.normal * d_axis - d_axis.dot(w) * m.axis);
    }
    if (has_details && may_rub()) f -= d_friction * c.force / m.length * o.slid;
    if (d_log_stiffness != 0.0) f += d_log_stiffness * ((c.force + c.slope * o.c) * c.normal - m.drag * o.slid);
    scatter(c.point, f, force);
  }
}

void RigidContact::add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar,
                                     VectorX& theta_bar) {
  if (is_bonded()) for_bonded([&](int i, double k) { scatter(i, -k * relative_change(i, w), z_bar); });
  Vector3 point_bar = Vector3::Zero(), plane_normal_bar = Vector3::Zero();
  double friction_bar = 0.0, log_stiffness_bar = 0.0;
  const bool rubbing = may_rub();
  const Detail none;
  for (std::size_t i = 0; i < active_.size(); ++i) {
    const Active& c = active_[i];
    const Detail m = shape_ || rubbing ? detail(i) : none;
    const Offsets o = offsets(c, m, z);
    const Vector3 v = relative_change(c.point, w);
    const double along = v.dot(c.normal);
    log_stiffness_bar += (c.force + c.slope * o.c) * along;
    double gap_bar = (c.curvature * o.c + c.slope) * along;
    Vector3 end_bar = c.slope * along * c.normal, y_bar = -end_bar;
    Vector3 normal_bar = (c.force + c.slope * o.c) * v + c.slope * along * o.q;
    if (rubbing) {
      const double drag_bar = -o.slid.dot(v);
      friction_bar += drag_bar * c.force / m.length;
      log_stiffness_bar += m.drag * drag_bar;
      if (m.drag > 0.0) {
        const Vector3 w_z = o.slid + o.normal * m.axis;
        end_bar -= m.drag * m.across(v);
        Vector3 axis_bar = m.drag * (o.normal * v + m.axis.dot(v) * w_z);
        gap_bar += drag_bar * friction_ * c.slope / m.length;
        const double length_bar = -drag_bar * m.drag / m.length;
        y_bar += length_bar / m.length * m.way;
        axis_bar -= length_bar * m.axis_way / m.length * m.way;
        normal_bar += m.axis_change(axis_bar);
      }
    }
    Vector3 from_plane_bar = gap_bar * c.normal;
    if (shape_) from_plane_bar += m.bend * normal_bar;
    y_bar += from_plane_bar;
    point_bar -= from_plane_bar;
    plane_normal_bar += normal_bar + gap_bar * (c.y - plane_point_);
    scatter(c.point, y_bar, lag_bar);
    scatter(c.point, end_bar, z_bar);
  }
  if (plane_) {
    theta_bar.segment<3>(plane_->point) += point_bar;
    theta_bar.segment<3>(plane_->normal) += plane_normal_bar;
  }
  if (block_.friction.exists()) theta_bar[block_.friction] += friction_bar;
  if (follows_stiffness_) theta_bar[block_.stiffness] += log_stiffness_bar / penalty_.stiffness;
}

void RigidContact::add_start_tangent(const Points& z, const Points& d_start, const Points&, Points& force) {
  for (std::size_t i = 0; i < active_.size() && rubs(); ++i) {
    const Active& c = active_[i];
    const Detail& m = details_[i];
    const Offsets o = offsets(c, m, z);
    const Vector3 change = carried_.rotation * relative_change(c.point, d_start);
    const double d_drag = m.drag * m.way.dot(change) / (m.length * m.length);
    scatter(c.point, m.drag * m.across(change) - d_drag * o.slid, force);
  }
}

void RigidContact::add_start_adjoint(const Points& z, const Points& w, Points& start_bar, Points&) {
  for (std::size_t i = 0; i < active_.size() && rubs(); ++i) {
    const Active& c = active_[i];
    const Detail& m = details_[i];
    const Offsets o = offsets(c, m, z);
    const Vector3 v = relative_change(c.point, w);
    const double drag_bar = -o.slid.dot(v);
    const Vector3 bar = m.drag * m.across(v) + drag_bar * m.drag / (m.length * m.length) * m.way;
    scatter(c.point, carried_.rotation.transpose() * bar, start_bar);
  }
}

RigidContact::Potential RigidContact::potential(int i, const Vector3& y, bool positive) const {
  Potential p;
  const double area = area_[std::size_t(i)];
  if (is_bonded()) {
    const double k = penalty_.stiffness * area;
    const Vector3 offset = y - bond_[std::size_t(i)];
    p.energy = 0.5 * k * offset.squaredNorm();
    p.gradient = k * offset;
    p.hessian = k * Matrix3::Identity();
    return p;
  }
  const RigidShape::Sample at = surface(i, y);
  if (at.distance >= penalty_.reach()) return p;
  const Penalty::Value value = penalty_.at(at.distance);
  p.energy = area * value.energy;
  p.gradient = -area * value.pressure * at.gradient;
  p.hessian = -area * value.slope * at.gradient * at.gradient.transpose();
  if (!positive) p.hessian -= area * value.pressure * at.hessian;
  return p;
}

Vector3 RigidContact::force(const Points& nodes, const Vector3& translation) const {
  Vector3 force = Vector3::Zero();
  for (int i = 0; i < points_.point_count(); ++i)
    force -= potential(i, points_.position(i, nodes) - translation, true).gradient;
  return force;
}

}  // namespace pliant
