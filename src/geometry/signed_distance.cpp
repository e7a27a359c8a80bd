#include "geometry/signed_distance.hpp"

#include <algorithm>
#include <cmath>

namespace pliant {

void SignedDistance::allocate(const Box& box, double spacing) {
  origin_ = box.min;
  spacing_ = spacing;
  for (int d = 0; d < 3; ++d) size_[d] = std::max(2, int(std::ceil(box.extent()[d] / spacing)) + 1);
  values_.assign(std::size_t(size_.x()) * size_.y() * size_.z(), 0.0f);
}

const float* SignedDistance::corner(const Vector3& point, Vector3& local, Vector3& outside) const {
  std::array<int, 3> index;
  for (int d = 0; d < 3; ++d) {
    const double s = (point[d] - origin_[d]) / spacing_;
    const double clamped = std::clamp(s, 0.0, double(size_[d] - 1));
    outside[d] = (s - clamped) * spacing_;
    index[d] = std::min(int(clamped), size_[d] - 2);
    local[d] = clamped - index[d];
  }
  return &values_[(std::size_t(index[2]) * size_.y() + index[1]) * size_.x() + index[0]];
}

SignedDistance::Sample SignedDistance::sample(const Vector3& point) const {
  Vector3 t, outside;
  const float* c = corner(point, t, outside);
  const std::size_t sx = 1, sy = std::size_t(size_.x()), sz = sy * std::size_t(size_.y());
  const double c000 = c[0], c100 = c[sx], c010 = c[sy], c110 = c[sx + sy];
  const double c001 = c[sz], c101 = c[sx + sz], c011 = c[sy + sz], c111 = c[sx + sy + sz];
  const double x = t.x(), y = t.y(), z = t.z();
  const double c00 = c000 + x * (c100 - c000), c10 = c010 + x * (c110 - c010);
  const double c01 = c001 + x * (c101 - c001), c11 = c011 + x * (c111 - c011);
  const double c0 = c00 + y * (c10 - c00), c1 = c01 + y * (c11 - c01);
  Sample s;
  s.value = c0 + z * (c1 - c0);
  s.gradient.x() =
      ((1 - z) * ((1 - y) * (c100 - c000) + y * (c110 - c010)) + z * ((1 - y) * (c101 - c001) + y * (c111 - c011)));
  s.gradient.y() = (1 - z) * (c10 - c00) + z * (c11 - c01);
  s.gradient.z() = c1 - c0;
  s.gradient /= spacing_;
  const double distance = outside.norm();
  if (distance > 0.0) {
    s.value += distance;
    for (int d = 0; d < 3; ++d)
      if (outside[d] != 0.0) s.gradient[d] = 0.0;
    s.gradient += outside / distance;
  }
  return s;
}

Matrix3 SignedDistance::hessian(const Vector3& point) const {
  Vector3 t, outside;
  const float* c = corner(point, t, outside);
  const std::array<std::size_t, 3> stride = {1, std::size_t(size_.x()),
                                             std::size_t(size_.x()) * std::size_t(size_.y())};
  Matrix3 H = Matrix3::Zero();
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    if (outside[i] != 0.0 || outside[j] != 0.0) continue;
    const auto twist = [&](const float* at) {
      return double(at[0]) - double(at[stride[std::size_t(i)]]) - double(at[stride[std::size_t(j)]]) +
             double(at[stride[std::size_t(i)] + stride[std::size_t(j)]]);
    };
    H(i, j) = H(j, i) = ((1.0 - t[k]) * twist(c) + t[k] * twist(c + stride[std::size_t(k)])) / (spacing_ * spacing_);
  }
  const double distance = outside.norm();
  if (distance == 0.0) return H;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      if (outside[i] == 0.0 || outside[j] == 0.0) continue;
      H(i, j) = ((i == j ? 1.0 : 0.0) - outside[i] * outside[j] / (distance * distance)) / distance;
    }
  return H;
}

SignedDistance SignedDistance::offset_by(const std::function<double(const Vector3&)>& offset) const {
  constexpr double coarser = 4.0;
  const SignedDistance outwards(box(), coarser * spacing_, offset);
  SignedDistance other = *this;
  for (int k = 0; k < size_.z(); ++k)
    for (int j = 0; j < size_.y(); ++j)
      for (int i = 0; i < size_.x(); ++i)
        other.at(i, j, k) -= float(outwards.value(origin_ + spacing_ * Vector3(i, j, k)));
  return other;
}

double SignedDistance::value(const Vector3& point) const { return sample(point).value; }

}  // namespace pliant
