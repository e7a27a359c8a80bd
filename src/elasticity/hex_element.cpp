#include "elasticity/hex_element.hpp"

#include <Eigen/Cholesky>

namespace pliant {

UnitLame unit_lame(double nu) {
  const double a = 1.0 + nu, b = 1.0 - 2.0 * nu;
  return {nu / (a * b), 0.5 / a, (1.0 + 2.0 * nu * nu) / (a * a * b * b), -0.5 / (a * a)};
}

namespace {

constexpr int bubbles = 3;              // 4 t (1 - t) along each axis
constexpr int functions = 8 + bubbles;  // nodes, then bubbles

/// H[i][j](a, b) = integral of d_i N_a d_j N_b, for nodes and bubbles [m].
using GradientProducts = std::array<std::array<Eigen::Matrix<double, functions, functions>, 3>, 3>;

Eigen::Matrix<double, functions, 3> gradients(const Vector3& local, const Vector3& mean_local) {
  Eigen::Matrix<double, functions, 3> g = Eigen::Matrix<double, functions, 3>::Zero();
  g.topRows<8>() = shape_gradients(local);
  // The mean is taken away so that constant strain does no work on the modes: then the patch test holds in cut cells.
  for (int m = 0; m < bubbles; ++m) g(8 + m, m) = 8.0 * (mean_local[m] - local[m]);
  return g;
}

GradientProducts gradient_products(const CellQuadrature& inside, double cell_size) {
  const auto& points = CellQuadrature::points();
  Vector3 mean_local = Vector3::Zero();
  for (int q = 0; q < CellQuadrature::count; ++q) mean_local += inside.weights[q] * points[q];
  mean_local /= inside.volume_fraction();
  GradientProducts H;
  for (auto& row : H)
    for (auto& entry : row) entry.setZero();
  for (int q = 0; q < CellQuadrature::count; ++q) {
    const auto g = gradients(points[q], mean_local);
    const double w = inside.weights[q] * cell_size;  // h^3 / h^2
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) H[i][j].noalias() += w * g.col(i) * g.col(j).transpose();
  }
  return H;
}

template <int N>
Eigen::Matrix<double, 3 * N, 3 * N> stiffness(const GradientProducts& H, double lambda, double mu) {
  Eigen::Matrix<double, 3 * N, 3 * N> K;
  for (int a = 0; a < N; ++a)
    for (int b = 0; b < N; ++b) {
      const double trace = H[0][0](a, b) + H[1][1](a, b) + H[2][2](a, b);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          K(3 * a + i, 3 * b + j) = lambda * H[i][j](a, b) + mu * H[j][i](a, b) + (i == j ? mu * trace : 0.0);
    }
  return K;
}

}  // namespace

HexStiffness hex_stiffness(const CellQuadrature& inside, double cell_size, double nu, HexFormulation formulation) {
  const UnitLame c = unit_lame(nu);
  const GradientProducts H = gradient_products(inside, cell_size);
  if (formulation == HexFormulation::Trilinear)
    return {stiffness<8>(H, c.lambda, c.mu), stiffness<8>(H, c.d_lambda, c.d_mu)};
  const auto K = stiffness<functions>(H, c.lambda, c.mu);
  const auto dK = stiffness<functions>(H, c.d_lambda, c.d_mu);
  // Static condensation; T maps the nodes' displacements to nodes and modes in equilibrium, so K* = T^T K T and, the
  // modes being stationary, dK* = T^T dK T.
  Eigen::Matrix<double, 3 * functions, 24> T;
  T.topRows<24>().setIdentity();
  T.bottomRows<3 * bubbles>() =
      -K.bottomRightCorner<3 * bubbles, 3 * bubbles>().ldlt().solve(K.bottomLeftCorner<3 * bubbles, 24>());
  HexStiffness result;
  result.value = T.transpose() * K * T;
  result.d_poissons_ratio = T.transpose() * dK * T;
  result.value = 0.5 * (result.value + result.value.transpose().eval());
  result.d_poissons_ratio = 0.5 * (result.d_poissons_ratio + result.d_poissons_ratio.transpose().eval());
  return result;
}

Matrix8 hex_mass(const CellQuadrature& inside, double cell_size) {
  Matrix8 M = Matrix8::Zero();
  for (int q = 0; q < CellQuadrature::count; ++q) {
    const auto shape = shape_functions(CellQuadrature::points()[q]);
    const Eigen::Map<const Eigen::Matrix<double, 8, 1>> N(shape.data());
    M.noalias() += inside.weights[q] * N * N.transpose();
  }
  return M * cell_size * cell_size * cell_size;
}

Eigen::Matrix<double, 8, 3> hex_mean_gradients(const CellQuadrature& inside, double cell_size) {
  Eigen::Matrix<double, 8, 3> g = Eigen::Matrix<double, 8, 3>::Zero();
  for (int q = 0; q < CellQuadrature::count; ++q) g += inside.weights[q] * shape_gradients(CellQuadrature::points()[q]);
  return g / (inside.volume_fraction() * cell_size);
}

}  // namespace pliant
