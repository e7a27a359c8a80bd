#include "motion/plane_contact.hpp"

#include <cmath>
#include <stdexcept>

namespace pliant {

namespace {
constexpr double reach = 30.0;  // smoothing lengths beyond which the force is below rounding
}

PlaneContact::PlaneContact(std::shared_ptr<const Body> body, const PlaneBlock& plane, const ContactOptions& options)
    : body_(std::move(body)), plane_(plane), options_(options) {
  if (!(options.stiffness > 0.0) || !(options.smoothing > 0.0))
    throw std::invalid_argument("plane contact needs a positive stiffness and smoothing length");
  std::vector<Vector3> samples;
  for (const SurfacePoint& point : body_->surface) samples.push_back(point.position);
  embedding_ = Embedding(*body_, samples);
  blocks_ = element_blocks(*body_);
  active_.reserve(samples.size());
}

void PlaneContact::set_parameters(const VectorX& parameters) {
  plane_point_ = plane_.point.vector(parameters);
  normal_ = plane_.normal.vector(parameters);
}

void PlaneContact::linearise(const Points& lag) {
  active_.clear();
  const double eps = options_.smoothing;
  for (int p = 0; p < embedding_.point_count(); ++p) {
    const Vector3 position = embedding_.position(p, lag);
    const double d = gap(position);
    if (d > reach * eps) continue;
    const double scale = options_.stiffness * body_->surface[std::size_t(p)].area;
    const double t = -d / eps;
    const double sigmoid = t > 0.0 ? 1.0 / (1.0 + std::exp(-t)) : std::exp(t) / (1.0 + std::exp(t));
    const double softplus = t > 0.0 ? t + std::log1p(std::exp(-t)) : std::log1p(std::exp(t));
    active_.push_back(
        {p, position, d, scale * eps * softplus, -scale * sigmoid, scale * sigmoid * (1.0 - sigmoid) / eps});
  }
}

void PlaneContact::add_force(const Points& z, Points& force) {
  for (const Active& c : active_) {
    const double change = gap(embedding_.position(c.point, z)) - c.gap;
    embedding_.add_transpose(c.point, (c.force + c.slope * change) * normal_, force);
  }
}

void PlaneContact::add_matrix(double scale, BlockMatrix& matrix) {
  const Matrix3 nn = normal_ * normal_.transpose();
  for (const Active& c : active_) {
    const auto w = embedding_.weights(c.point);
    const int n = embedding_.nodes_per_point();
    const int* blocks = blocks_.data() + std::size_t(embedding_.element(c.point)) * std::size_t(n * n);
    const double factor = -scale * c.slope;
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < n; ++b) Eigen::Map<Matrix3>(matrix.block(blocks[n * a + b])) += factor * w[a] * w[b] * nn;
  }
}

void PlaneContact::add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                                     Points& force) {
  const Vector3 d_point = plane_.point.vector(d_theta);
  const Vector3 d_normal = plane_.normal.vector(d_theta);
  for (const Active& c : active_) {
    const Vector3 end = embedding_.position(c.point, z);
    const double change = gap(end) - c.gap;
    const double d_gap_lag =
        normal_.dot(embedding_.position(c.point, d_lag) - d_point) + d_normal.dot(c.lag_position - plane_point_);
    const double d_gap_end =
        normal_.dot(embedding_.position(c.point, d_z) - d_point) + d_normal.dot(end - plane_point_);
    const double d_force = c.curvature * change * d_gap_lag + c.slope * d_gap_end;
    embedding_.add_transpose(c.point, d_force * normal_ + (c.force + c.slope * change) * d_normal, force);
  }
}

void PlaneContact::add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar,
                                     VectorX& theta_bar) {
  auto point_bar = theta_bar.segment<3>(plane_.point);
  auto normal_bar = theta_bar.segment<3>(plane_.normal);
  for (const Active& c : active_) {
    const Vector3 end = embedding_.position(c.point, z);
    const Vector3 force_bar = embedding_.position(c.point, w);
    const double change = gap(end) - c.gap;
    const double along = force_bar.dot(normal_);
    const double lag_gap_bar = c.curvature * change * along, end_gap_bar = c.slope * along;
    embedding_.add_transpose(c.point, lag_gap_bar * normal_, lag_bar);
    embedding_.add_transpose(c.point, end_gap_bar * normal_, z_bar);
    point_bar -= (lag_gap_bar + end_gap_bar) * normal_;
    normal_bar += lag_gap_bar * (c.lag_position - plane_point_) + end_gap_bar * (end - plane_point_) +
                  (c.force + c.slope * change) * force_bar;
  }
}

}  // namespace pliant
