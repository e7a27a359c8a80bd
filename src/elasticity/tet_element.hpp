#pragma once

#include <vector>

#include "base/types.hpp"
#include "elasticity/lame.hpp"
#include "mesh/tet_shape.hpp"

namespace pliant {

// Linear (N = 4) and quadratic (N = 10) tetrahedra. X holds an element's rest positions [m], N x 3: its corners,
// positively oriented, then the mid nodes of its edges 01 02 03 12 13 23. Mid nodes away from their edges' middles make
// curved elements, as long as det dx/db > 0 everywhere. Linear elements lock towards Poisson's ratio 1/2, quadratic
// ones do not.
// All are templates for N = 4 and N = 10 only.

/// Linear elastic stiffness of one element [m] for E = 1 Pa, and its derivative with respect to Poisson's ratio.
/// Unknowns node by node (x0 y0 z0 x1 ...). Exact for straight edges.
template <int N>
struct ElementStiffness {
  Eigen::Matrix<double, 3 * N, 3 * N> value, d_poissons_ratio;
};
template <int N>
ElementStiffness<N> tet_stiffness(const Eigen::Matrix<double, N, 3>& X, double poissons_ratio);

/// A point of the rule that integrates the stiffness: exactly for straight edges.
template <int N>
struct StiffnessPoint {
  double volume = 0.0;                    ///< that it stands for [m^3]
  Eigen::Matrix<double, N, 3> gradients;  ///< of the shape functions [1/m]
};
/// All of them: 4 of a quadratic element with straight edges, 14 of one with curved ones.
template <int N>
std::vector<StiffnessPoint<N>> stiffness_points(const Eigen::Matrix<double, N, 3>& X);

/// Consistent mass for unit density [m^3], N x N (the same for x, y and z). Exact for straight edges; total and centre
/// of mass are exact for curved ones too.
template <int N>
Eigen::Matrix<double, N, N> tet_mass(const Eigen::Matrix<double, N, 3>& X);

/// Gradients of the shape functions at a point [1/m], N x 3.
template <int N>
Eigen::Matrix<double, N, 3> tet_gradients(const Eigen::Matrix<double, N, 3>& X, const Barycentric& at);

/// Their mean over the element [1/m], N x 3: F = sum_a x_a g_a^T (Weiss 2020, eq. 30).
template <int N>
Eigen::Matrix<double, N, 3> tet_mean_gradients(const Eigen::Matrix<double, N, 3>& X);

}  // namespace pliant
