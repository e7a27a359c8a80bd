#pragma once

#include <array>
#include <functional>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Signed distance to a closed surface on a regular grid [m], negative inside, interpolated trilinearly.
/// Beyond the grid the value of the nearest grid point plus the distance to the grid is given, so that it keeps
/// growing.
class SignedDistance {
 public:
  struct Sample {
    double value;      ///< [m]
    Vector3 gradient;  ///< [-], of the interpolant
  };

  SignedDistance() = default;

  /// Resamples any function onto a grid that covers `box` (analytic shapes, tests).
  template <class Function>
  SignedDistance(const Box& box, double spacing, Function&& function);

  [[nodiscard]] double value(const Vector3& point) const;
  [[nodiscard]] Sample sample(const Vector3& point) const;
  /// Second derivatives of the interpolant [1/m]: the mixed ones; where the gradient jumps, at the grid's planes, those
  /// of one side.
  [[nodiscard]] Matrix3 hessian(const Vector3& point) const;

  /// Signed distance of a surface that lies outside of this one by an offset [m], to first order: the distance less the
  /// offset, which is interpolated between every fourth grid points.
  [[nodiscard]] SignedDistance offset_by(const std::function<double(const Vector3&)>& offset) const;

  double spacing() const { return spacing_; }
  /// Box of the grid, not of the object.
  Box box() const { return {origin_, origin_ + spacing_ * (size_.cast<double>().array() - 1.0).matrix()}; }

 private:
  friend SignedDistance signed_distance(const TriangleMesh&, double, double);
  void allocate(const Box& box, double spacing);
  float& at(int i, int j, int k) { return values_[(std::size_t(k) * size_.y() + j) * size_.x() + i]; }
  const float* corner(const Vector3& point, Vector3& local, Vector3& outside) const;

  Vector3 origin_ = Vector3::Zero();
  double spacing_ = 0.0;
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<float> values_;
};

template <class Function>
SignedDistance::SignedDistance(const Box& box, double spacing, Function&& function) {
  allocate(box, spacing);
  for (int k = 0; k < size_.z(); ++k)
    for (int j = 0; j < size_.y(); ++j)
      for (int i = 0; i < size_.x(); ++i) at(i, j, k) = float(function(Vector3(origin_ + spacing_ * Vector3(i, j, k))));
}

}  // namespace pliant
