#include "motion/rigid_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace pliant {

namespace {

class HalfSpace : public RigidShape {
 public:
  HalfSpace(const Vector3& point, const Vector3& normal) : point_(point), normal_(normal.normalized()) {}
  Sample sample(const Vector3& p) const override { return {normal_.dot(p - point_), normal_, Matrix3::Zero()}; }

 private:
  Vector3 point_, normal_;
};

/// Distance to a point or a straight piece, less a radius.
class Capsule : public RigidShape {
 public:
  Capsule(const Vector3& from, const Vector3& to, double radius) : from_(from), along_(to - from), radius_(radius) {}
  Sample sample(const Vector3& p) const override {
    const double length = along_.squaredNorm();
    const double share = length > 0.0 ? along_.dot(p - from_) / length : 0.0;
    const bool is_beside = share > 0.0 && share < 1.0;
    const Vector3 offset = p - from_ - std::clamp(share, 0.0, 1.0) * along_;
    const double distance = offset.norm();
    if (distance == 0.0) return {-radius_, Vector3::UnitX(), Matrix3::Zero()};
    const Vector3 n = offset / distance;
    Matrix3 across = Matrix3::Identity() - n * n.transpose();
    if (is_beside) across -= along_ * along_.transpose() / length;
    return {distance - radius_, n, across / distance};
  }

 private:
  Vector3 from_, along_;
  double radius_;
};

class Punch : public RigidShape {
 public:
  Punch(const Vector3& tip, const Vector3& axis, double radius, double edge)
      : tip_(tip), axis_(axis.normalized()), radius_(radius), edge_(edge) {}
  /// In the plane of axis and point: a corner rounded by `edge_`.
  Sample sample(const Vector3& p) const override {
    const double height = axis_.dot(p - tip_);
    const Vector3 beside = p - tip_ - height * axis_;
    const double r = beside.norm();
    const Vector3 out = r > 0.0 ? Vector3(beside / r) : axis_.unitOrthogonal();
    const double x = r - (radius_ - edge_), y = height + edge_;
    double by_r = 0.0, by_height = 1.0, distance = height, bend = 0.0;
    if (x > 0.0 && y > 0.0) {
      const double corner = std::hypot(x, y);
      by_r = x / corner, by_height = y / corner, distance = corner - edge_, bend = 1.0 / corner;
    } else if (x > y) {
      by_r = 1.0, by_height = 0.0, distance = x - edge_;
    }
    const Vector3 gradient = by_r * out + by_height * axis_;
    const Vector3 tangent = by_height * out - by_r * axis_, around = axis_.cross(out);
    Matrix3 hessian = bend * tangent * tangent.transpose();
    if (r > 0.0) hessian += by_r / r * around * around.transpose();
    return {distance, gradient, hessian};
  }

 private:
  Vector3 tip_, axis_;
  double radius_, edge_;
};

class RoundedBox : public RigidShape {
 public:
  RoundedBox(const Vector3& centre, const Vector3& half, double edge)
      : centre_(centre), inner_((half.array() - edge).matrix()), edge_(edge) {}
  /// Distance to the box that is smaller by the edges' radius, less that.
  Sample sample(const Vector3& p) const override {
    const Vector3 q = p - centre_;
    const Vector3 beyond = q.cwiseAbs() - inner_;
    const Vector3 sign = q.unaryExpr([](double v) { return v < 0.0 ? -1.0 : 1.0; });
    const Vector3 outside = beyond.cwiseMax(0.0);
    const double distance = outside.norm();
    if (distance == 0.0) {  // by the nearest face
      Eigen::Index axis = 0;
      const double depth = beyond.maxCoeff(&axis);
      return {depth - edge_, sign[axis] * Vector3::Unit(axis), Matrix3::Zero()};
    }
    const Vector3 n = outside.cwiseProduct(sign) / distance;
    Matrix3 free = Matrix3::Zero();
    for (int i = 0; i < 3; ++i) free(i, i) = beyond[i] > 0.0 ? 1.0 : 0.0;
    return {distance - edge_, n, (free - n * n.transpose()) / distance};
  }

 private:
  Vector3 centre_, inner_;
  double edge_;
};

class Moved : public RigidShape {
 public:
  Moved(std::shared_ptr<const RigidShape> shape, const RigidMotion& motion)
      : shape_(std::move(shape)), motion_(motion), back_(motion.inverse()) {}
  Sample sample(const Vector3& p) const override {
    const Sample s = shape_->sample(back_(p));
    return {s.distance, motion_.rotation * s.gradient, motion_.rotation * s.hessian * back_.rotation};
  }

 private:
  std::shared_ptr<const RigidShape> shape_;
  RigidMotion motion_, back_;
};

class Grid : public RigidShape {
 public:
  Grid(SignedDistance distance, bool hollow) : distance_(std::move(distance)), sign_(hollow ? -1.0 : 1.0) {}
  Sample sample(const Vector3& p) const override {
    const SignedDistance::Sample s = distance_.sample(p);
    return {sign_ * s.value, sign_ * s.gradient, sign_ * distance_.hessian(p)};
  }

 private:
  SignedDistance distance_;
  double sign_;
};

/// A distance as a uniform cubic spline of its values at grid points, by the quasi-interpolant that keeps cubic
/// polynomials: coefficients (-f_-1 + 8 f_0 - f_1) / 6 along each axis.
class SmoothGrid : public RigidShape {
 public:
  explicit SmoothGrid(SignedDistance distance) : distance_(std::move(distance)) {
    const Box box = distance_.box();
    const double h = distance_.spacing();
    origin_ = box.min;
    size_ = (box.extent() / h).array().round().cast<int>() + 1;
    const std::size_t n = std::size_t(size_.x()) * std::size_t(size_.y()) * std::size_t(size_.z());
    std::vector<float> values(n), filtered(n);
    for (int k = 0; k < size_.z(); ++k)
      for (int j = 0; j < size_.y(); ++j)
        for (int i = 0; i < size_.x(); ++i)
          values[at(i, j, k)] = float(distance_.value(origin_ + h * Vector3(i, j, k)));
    const std::array<std::size_t, 3> stride = {1, std::size_t(size_.x()),
                                               std::size_t(size_.x()) * std::size_t(size_.y())};
    for (int axis = 0; axis < 3; ++axis) {
      for (int k = 0; k < size_.z(); ++k)
        for (int j = 0; j < size_.y(); ++j)
          for (int i = 0; i < size_.x(); ++i) {
            const std::size_t here = at(i, j, k), step = stride[std::size_t(axis)];
            const int place = Eigen::Vector3i(i, j, k)[axis];
            const bool is_inside = place > 0 && place + 1 < size_[axis];
            filtered[here] =
                is_inside ? (8.0f * values[here] - values[here - step] - values[here + step]) / 6.0f : values[here];
          }
      values.swap(filtered);
    }
    coefficients_ = std::move(values);
  }

  Sample sample(const Vector3& p) const override {
    const double h = distance_.spacing();
    const Vector3 place = (p - origin_) / h;
    Eigen::Vector3i first;
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = int(std::floor(place[axis])) - 1;
      if (!(place[axis] >= 1.0) || first[axis] + 3 >= size_[axis]) {  // at its border and beyond nobody touches it
        const SignedDistance::Sample far = distance_.sample(p);
        return {far.value, far.gradient, Matrix3::Zero()};
      }
    }
    std::array<std::array<std::array<double, 4>, 3>, 3> basis;  // [axis][derivative]
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto a = Eigen::Index(axis);
      const double t = place[a] - double(first[a] + 1), s = 1.0 - t;
      basis[axis][0] = {s * s * s / 6.0, (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
                        (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0, t * t * t / 6.0};
      basis[axis][1] = {-0.5 * s * s, 1.5 * t * t - 2.0 * t, 2.0 * s - 1.5 * s * s, 0.5 * t * t};
      basis[axis][2] = {s, 3.0 * t - 2.0, 3.0 * s - 2.0, t};
    }
    Sample out{0.0, Vector3::Zero(), Matrix3::Zero()};
    const auto& [bx, by, bz] = basis;
    for (std::size_t c = 0; c < 4; ++c)
      for (std::size_t b = 0; b < 4; ++b) {
        const float* row = &coefficients_[at(first.x(), first.y() + int(b), first.z() + int(c))];
        std::array<double, 3> along{};
        for (std::size_t a = 0; a < 4; ++a)
          for (std::size_t d = 0; d < 3; ++d) along[d] += bx[d][a] * double(row[a]);
        out.distance += along[0] * by[0][b] * bz[0][c];
        out.gradient +=
            Vector3(along[1] * by[0][b] * bz[0][c], along[0] * by[1][b] * bz[0][c], along[0] * by[0][b] * bz[1][c]);
        out.hessian(0, 0) += along[2] * by[0][b] * bz[0][c];
        out.hessian(1, 1) += along[0] * by[2][b] * bz[0][c];
        out.hessian(2, 2) += along[0] * by[0][b] * bz[2][c];
        out.hessian(0, 1) += along[1] * by[1][b] * bz[0][c];
        out.hessian(0, 2) += along[1] * by[0][b] * bz[1][c];
        out.hessian(1, 2) += along[0] * by[1][b] * bz[1][c];
      }
    out.gradient /= h;
    out.hessian(1, 0) = out.hessian(0, 1), out.hessian(2, 0) = out.hessian(0, 2), out.hessian(2, 1) = out.hessian(1, 2);
    out.hessian /= h * h;
    return out;
  }

 private:
  std::size_t at(int i, int j, int k) const {
    return (std::size_t(k) * std::size_t(size_.y()) + std::size_t(j)) * std::size_t(size_.x()) + std::size_t(i);
  }

  SignedDistance distance_;
  Vector3 origin_;
  Eigen::Vector3i size_;
  std::vector<float> coefficients_;
};

}  // namespace

std::shared_ptr<const RigidShape> rigid_half_space(const Vector3& point, const Vector3& normal) {
  return std::make_shared<HalfSpace>(point, normal);
}
std::shared_ptr<const RigidShape> rigid_ball(const Vector3& centre, double radius) {
  return std::make_shared<Capsule>(centre, centre, radius);
}
std::shared_ptr<const RigidShape> rigid_capsule(const Vector3& from, const Vector3& to, double radius) {
  return std::make_shared<Capsule>(from, to, radius);
}
std::shared_ptr<const RigidShape> rigid_punch(const Vector3& tip, const Vector3& axis, double radius, double edge) {
  return std::make_shared<Punch>(tip, axis, radius, edge);
}
std::shared_ptr<const RigidShape> rigid_box(const Vector3& centre, const Vector3& half, double edge) {
  return std::make_shared<RoundedBox>(centre, half, edge);
}
std::shared_ptr<const RigidShape> rigid_moved(std::shared_ptr<const RigidShape> shape, const RigidMotion& motion) {
  return std::make_shared<Moved>(std::move(shape), motion);
}
std::shared_ptr<const RigidShape> rigid_grid(SignedDistance distance, bool hollow) {
  return std::make_shared<Grid>(std::move(distance), hollow);
}
std::shared_ptr<const RigidShape> rigid_smooth_grid(SignedDistance distance) {
  return std::make_shared<SmoothGrid>(std::move(distance));
}

}  // namespace pliant
