#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cstdint>
#include <limits>
#include <vector>

namespace pliant {

inline constexpr double infinite = std::numeric_limits<double>::infinity();
inline constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using VectorX = Eigen::VectorXd;
using MatrixX = Eigen::MatrixXd;

/// Points or vectors of a mesh, n x 3, one row a node. Flattened row by row it is the vector of unknowns
/// (x0 y0 z0 x1 y1 z1 ...) that solvers see.
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// The same memory seen as one column of 3 n unknowns.
inline Eigen::Map<VectorX> flat(Points& points) { return {points.data(), points.size()}; }
inline Eigen::Map<const VectorX> flat(const Points& points) { return {points.data(), points.size()}; }

/// A vector of 3 n unknowns seen as n x 3 points.
inline Eigen::Map<Points> as_points(VectorX& vector) { return {vector.data(), vector.size() / 3, 3}; }
inline Eigen::Map<const Points> as_points(const VectorX& vector) { return {vector.data(), vector.size() / 3, 3}; }

/// The matrix of the cross product: cross_matrix(a) b = a x b.
inline Matrix3 cross_matrix(const Vector3& a) {
  Matrix3 m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

}  // namespace pliant
