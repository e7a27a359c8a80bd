#include "elasticity/tangent_projection.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace pliant {

TangentProjection::TangentProjection(const Matrix9& tangent, const Matrix3* F) {
  std::optional<PrincipalStretches> principal;
  if (F && principal.emplace(*F).is_valid)
    decompose(tangent, *principal);
  else
    decompose(tangent);
  positive = tangent;
  for (int i = 0; i < 9 && values[i] < 0.0; ++i)
    positive.noalias() -= (values[i] * vectors.col(i)) * vectors.col(i).transpose();
}

double TangentProjection::left_out(int i, int j) const {
  if (values[i] >= 0.0 && values[j] >= 0.0) return 0.0;
  if (values[i] < 0.0 && values[j] < 0.0) return 1.0;
  const double less = std::min(values[i], values[j]), more = std::max(values[i], values[j]);
  return less / (less - more);
}

void TangentProjection::decompose(const Matrix9& tangent) {
  const Eigen::SelfAdjointEigenSolver<Matrix9> solver(tangent);
  values = solver.eigenvalues();
  vectors = solver.eigenvectors();
}

void TangentProjection::decompose(const Matrix9& tangent, const PrincipalStretches& p) {
  Matrix9 own;
  Vector9 of_own;
  Eigen::Matrix<double, 9, 3> stretches;
  for (int i = 0; i < 3; ++i) stretches.col(i) = vec(Matrix3(p.U.col(i) * p.V.col(i).transpose()));
  const Eigen::SelfAdjointEigenSolver<Matrix3> solver(stretches.transpose() * tangent * stretches);
  own.leftCols<3>() = stretches * solver.eigenvectors();
  of_own.head<3>() = solver.eigenvalues();
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    const Matrix3 one = std::sqrt(0.5) * p.U.col(i) * p.V.col(j).transpose();
    const Matrix3 other = std::sqrt(0.5) * p.U.col(j) * p.V.col(i).transpose();
    own.col(3 + i) = vec(Matrix3(one + other));
    own.col(6 + i) = vec(Matrix3(one - other));
  }
  for (int i = 3; i < 9; ++i) of_own[i] = own.col(i).dot(tangent * own.col(i));
  std::array<int, 9> order = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  std::ranges::sort(order, {}, [&](int i) { return of_own[i]; });
  for (int i = 0; i < 9; ++i)
    values[i] = of_own[order[std::size_t(i)]], vectors.col(i) = own.col(order[std::size_t(i)]);
}

}  // namespace pliant
