#include "geometry/lens.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace pliant {

namespace {

constexpr double widest = 10.0;  // radius of a ray that a lens of this model may see

/// From the lens to a sensor that is tilted about its x and y axes, as OpenCV has it.
Matrix3 tilt_matrix(double tau_x, double tau_y) {
  const double cx = std::cos(tau_x), sx = std::sin(tau_x), cy = std::cos(tau_y), sy = std::sin(tau_y);
  Matrix3 about_x, about_y, onto_sensor;
  about_x << 1, 0, 0, 0, cx, sx, 0, -sx, cx;
  about_y << cy, 0, -sy, 0, 1, 0, sy, 0, cy;
  const Matrix3 turn = about_y * about_x;
  onto_sensor << turn(2, 2), 0, -turn(0, 2), 0, turn(2, 2), -turn(1, 2), 0, 0, 1;
  return onto_sensor * turn;
}

}  // namespace

bool LensDistortion::takes(std::size_t count) {
  return count == 4 || count == 5 || count == 8 || count == 12 || count == 14;
}

LensDistortion::LensDistortion(std::vector<double> coefficients) : coefficients_(std::move(coefficients)) {
  const bool are_finite = std::ranges::all_of(coefficients_, [](double c) { return std::isfinite(c); });
  if (!are_finite || (!coefficients_.empty() && !takes(coefficients_.size())))
    throw std::invalid_argument(std::string("a lens has ") + counts + " finite coefficients");
  std::ranges::copy(coefficients_, c_.begin());
  bends_ = std::ranges::any_of(c_, [](double c) { return c != 0.0; });
  is_tilted_ = c_[TauX] != 0.0 || c_[TauY] != 0.0;
  if (is_tilted_) tilt_ = tilt_matrix(c_[TauX], c_[TauY]);
  constexpr int steps = 2000;
  for (int i = 1; i <= steps && bends_; ++i) {
    const double r = widest * i / steps;
    const Radial at = radial(r * r);
    if (at.factor > 0.0 && at.factor + 2.0 * r * r * at.slope > 0.0) continue;
    reach_ = widest * (i - 1) / steps;
    break;
  }
}

LensDistortion::Radial LensDistortion::radial(double r2) const {
  const double above = 1.0 + r2 * (c_[K1] + r2 * (c_[K2] + r2 * c_[K3]));
  const double below = 1.0 + r2 * (c_[K4] + r2 * (c_[K5] + r2 * c_[K6]));
  const double d_above = c_[K1] + r2 * (2.0 * c_[K2] + r2 * 3.0 * c_[K3]);
  const double d_below = c_[K4] + r2 * (2.0 * c_[K5] + r2 * 3.0 * c_[K6]);
  if (!(below > 0.0)) return {0.0, 0.0};  // beyond a pole nothing is seen
  return {above / below, (d_above * below - above * d_below) / (below * below)};
}

Vector2 LensDistortion::within_reach(const Vector2& p, Eigen::Matrix2d* derivative) const {
  const double x = p.x(), y = p.y(), r2 = p.squaredNorm();
  const Radial at = radial(r2);
  const double p1 = c_[P1], p2 = c_[P2];
  Vector2 seen = at.factor * p;
  seen.x() += 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + r2 * (c_[S1] + r2 * c_[S2]);
  seen.y() += p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + r2 * (c_[S3] + r2 * c_[S4]);
  Eigen::Matrix2d J;
  if (derivative) {
    const Vector2 prism(c_[S1] + 2.0 * r2 * c_[S2], c_[S3] + 2.0 * r2 * c_[S4]);
    J << 2.0 * p1 * y + 6.0 * p2 * x, 2.0 * p1 * x + 2.0 * p2 * y, 2.0 * p1 * x + 2.0 * p2 * y,
        6.0 * p1 * y + 2.0 * p2 * x;
    J += at.factor * Eigen::Matrix2d::Identity() + 2.0 * (at.slope * p + prism) * p.transpose();
  }
  if (is_tilted_) {
    const Vector3 tilted = tilt_ * seen.homogeneous();
    seen = tilted.hnormalized();
    if (derivative) J = (tilt_.topLeftCorner<2, 2>() - seen * tilt_.row(2).head<2>()) / tilted.z() * J;
  }
  if (derivative) *derivative = J;
  return seen;
}

Vector2 LensDistortion::distorted(const Vector2& straight, Eigen::Matrix2d* derivative) const {
  if (!bends_) {
    if (derivative) derivative->setIdentity();
    return straight;
  }
  const double radius = straight.norm();
  if (radius <= reach_) return within_reach(straight, derivative);
  const Vector2 outwards = straight / radius;
  if (derivative) derivative->setIdentity();
  return within_reach(reach_ * outwards, nullptr) + (radius - reach_) * outwards;
}

Vector2 LensDistortion::straight(const Vector2& distorted) const {
  if (!bends_) return distorted;
  constexpr int most = 30;
  constexpr double near_enough = 1e-13;  // far below a pixel's rounding
  Vector2 p = distorted;
  if (const double radius = p.norm(); radius > reach_) p *= reach_ / radius;
  Eigen::Matrix2d J;
  for (int i = 0; i < most; ++i) {
    const Vector2 off = within_reach(p, &J) - distorted;
    if (off.norm() < near_enough * (1.0 + distorted.norm())) return p;
    p -= J.inverse() * off;
    if (!p.allFinite()) break;
    if (const double radius = p.norm(); radius > reach_) p *= reach_ / radius;
  }
  const bool came_back = p.allFinite() && (within_reach(p, nullptr) - distorted).norm() < 1e-9;
  return came_back ? p : Vector2(Vector2::Constant(std::numeric_limits<double>::quiet_NaN()));
}

}  // namespace pliant
