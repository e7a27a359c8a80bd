#pragma once

#include <array>
#include <span>

#include "base/types.hpp"
#include "geometry/tetrahedron.hpp"

namespace pliant {

/// Barycentric coordinates of a point in a tetrahedron, one a corner; they sum to one.
using Barycentric = Eigen::Vector4d;

/// Lagrange shape functions of the linear (N = 4) and the quadratic (N = 10: corners, then mid nodes) tetrahedron;
/// valid as polynomials outside the element too.
template <int N>
std::array<double, N> tet_shape_functions(const Barycentric& at) {
  static_assert(N == 4 || N == 10, "tetrahedra have 4 or 10 nodes");
  std::array<double, N> shape;
  for (int i = 0; i < 4; ++i) shape[i] = N == 4 ? at[i] : at[i] * (2.0 * at[i] - 1.0);
  if constexpr (N == 10)
    for (int m = 0; m < 6; ++m) shape[4 + m] = 4.0 * at[tet_edges[m][0]] * at[tet_edges[m][1]];
  return shape;
}

/// Their derivatives by the coordinates of corners 1, 2, 3, that of corner 0 making up the sum of one; N x 3.
template <int N>
Eigen::Matrix<double, N, 3> tet_shape_derivatives(const Barycentric& at) {
  static_assert(N == 4 || N == 10, "tetrahedra have 4 or 10 nodes");
  Eigen::Matrix<double, N, 4> by_all = Eigen::Matrix<double, N, 4>::Zero();
  for (int i = 0; i < 4; ++i) by_all(i, i) = N == 4 ? 1.0 : 4.0 * at[i] - 1.0;
  if constexpr (N == 10)
    for (int m = 0; m < 6; ++m) {
      const auto& [i, j] = tet_edges[m];
      by_all(4 + m, i) = 4.0 * at[j];
      by_all(4 + m, j) = 4.0 * at[i];
    }
  return by_all.template rightCols<3>().colwise() - by_all.col(0);
}

/// A point of a rule for integrals over a tetrahedron; the weights of a rule sum to one.
struct TetQuadraturePoint {
  Barycentric at;
  double weight;
};

/// The cheapest rule here that is exact for polynomials of that degree, 0..5: 1, 4 or 14 points, all inside and with
/// positive weights. Throws std::invalid_argument for another degree.
std::span<const TetQuadraturePoint> tet_quadrature(int degree);

}  // namespace pliant
