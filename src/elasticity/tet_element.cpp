#include "elasticity/tet_element.hpp"

namespace pliant {

namespace {

template <int N>
using NodeMatrix = Eigen::Matrix<double, N, 3>;

/// dx / d(b1, b2, b3) [m].
template <int N>
Matrix3 jacobian(const NodeMatrix<N>& X, const NodeMatrix<N>& derivatives) {
  return X.transpose() * derivatives;
}

template <int N>
bool is_straight(const NodeMatrix<N>& X) {
  if constexpr (N == 10) {
    const double size = (X.row(1) - X.row(0)).norm();
    for (int m = 0; m < 6; ++m) {
      const auto middle = 0.5 * (X.row(tet_edges[m][0]) + X.row(tet_edges[m][1]));
      if ((X.row(4 + m) - middle).norm() > 1e-12 * size) return false;
    }
  }
  return true;
}

/// Calls visit(volume [m^3], gradients [1/m]) for the points of a rule that is exact where edges are straight, and
/// where they are not still integrates the gradients exactly: constant stress then gives the exact nodal forces.
template <int N, class Visit>
void for_gradients(const NodeMatrix<N>& X, Visit&& visit) {
  const int degree = N == 4 ? 0 : is_straight<N>(X) ? 2 : 5;
  for (const TetQuadraturePoint& q : tet_quadrature(degree)) {
    const NodeMatrix<N> derivatives = tet_shape_derivatives<N>(q.at);
    const Matrix3 J = jacobian<N>(X, derivatives);
    visit(q.weight * J.determinant() / 6.0, NodeMatrix<N>(derivatives * J.inverse()));
  }
}

/// K for given Lame constants from G(3a+i, 3b+j) = integral of d_i N_a d_j N_b.
template <class Matrix>
Matrix stiffness(const Matrix& G, double lambda, double mu) {
  Matrix K = lambda * G;
  for (Eigen::Index b = 0; b < G.cols(); b += 3)
    for (Eigen::Index a = 0; a < G.rows(); a += 3) {
      const auto block = G.template block<3, 3>(a, b);
      K.template block<3, 3>(a, b) += mu * block.transpose() + mu * block.trace() * Matrix3::Identity();
    }
  return K;
}

}  // namespace

template <int N>
ElementStiffness<N> tet_stiffness(const NodeMatrix<N>& X, double poissons_ratio) {
  Eigen::Matrix<double, 3 * N, 3 * N> G = Eigen::Matrix<double, 3 * N, 3 * N>::Zero();
  for_gradients<N>(X, [&](double volume, const NodeMatrix<N>& g) {
    const Eigen::Matrix<double, 3, N> by_node = g.transpose();
    const Eigen::Map<const Eigen::Matrix<double, 3 * N, 1>> all(by_node.data());
    G.noalias() += volume * all * all.transpose();
  });
  const UnitLame c = unit_lame(poissons_ratio);
  return {stiffness(G, c.lambda, c.mu), stiffness(G, c.d_lambda, c.d_mu)};
}

template <int N>
std::vector<StiffnessPoint<N>> stiffness_points(const NodeMatrix<N>& X) {
  std::vector<StiffnessPoint<N>> points;
  for_gradients<N>(X, [&](double volume, const NodeMatrix<N>& g) { points.push_back({volume, g}); });
  return points;
}

template <int N>
Eigen::Matrix<double, N, N> tet_mass(const NodeMatrix<N>& X) {
  Eigen::Matrix<double, N, N> M = Eigen::Matrix<double, N, N>::Zero();
  for (const TetQuadraturePoint& q : tet_quadrature(N == 4 ? 2 : 5)) {
    const auto shape = tet_shape_functions<N>(q.at);
    const Eigen::Map<const Eigen::Matrix<double, N, 1>> S(shape.data());
    const double volume = q.weight * jacobian<N>(X, tet_shape_derivatives<N>(q.at)).determinant() / 6.0;
    M.noalias() += volume * S * S.transpose();
  }
  return M;
}

template <int N>
NodeMatrix<N> tet_gradients(const NodeMatrix<N>& X, const Barycentric& at) {
  const NodeMatrix<N> derivatives = tet_shape_derivatives<N>(at);
  return derivatives * jacobian<N>(X, derivatives).inverse();
}

template <int N>
NodeMatrix<N> tet_mean_gradients(const NodeMatrix<N>& X) {
  NodeMatrix<N> integral = NodeMatrix<N>::Zero();
  double total = 0.0;
  for_gradients<N>(X, [&](double volume, const NodeMatrix<N>& g) {
    integral += volume * g;
    total += volume;
  });
  return integral / total;
}

template ElementStiffness<4> tet_stiffness<4>(const NodeMatrix<4>&, double);
template ElementStiffness<10> tet_stiffness<10>(const NodeMatrix<10>&, double);
template std::vector<StiffnessPoint<10>> stiffness_points<10>(const NodeMatrix<10>&);
template Eigen::Matrix<double, 4, 4> tet_mass<4>(const NodeMatrix<4>&);
template Eigen::Matrix<double, 10, 10> tet_mass<10>(const NodeMatrix<10>&);
template NodeMatrix<4> tet_gradients<4>(const NodeMatrix<4>&, const Barycentric&);
template NodeMatrix<10> tet_gradients<10>(const NodeMatrix<10>&, const Barycentric&);
template NodeMatrix<4> tet_mean_gradients<4>(const NodeMatrix<4>&);
template NodeMatrix<10> tet_mean_gradients<10>(const NodeMatrix<10>&);

}  // namespace pliant
