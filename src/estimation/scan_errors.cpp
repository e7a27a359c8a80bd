#include "estimation/scan_errors.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/dense.hpp"

namespace pliant {

namespace {

/// So many vertices of a surface, each as far as can be from those before it.
std::vector<Vector3> places_over(const TriangleMesh& surface, int count) {
  std::vector<Vector3> places = {surface.vertices.front()};
  std::vector<double> distance(surface.vertices.size(), std::numeric_limits<double>::infinity());
  while (int(places.size()) < count) {
    for (std::size_t v = 0; v < distance.size(); ++v)
      distance[v] = std::min(distance[v], (surface.vertices[v] - places.back()).squaredNorm());
    places.push_back(surface.vertices[std::size_t(std::ranges::max_element(distance) - distance.begin())]);
  }
  return places;
}

}  // namespace

ScanErrors::ScanErrors(const TriangleMesh& scan, double deviation, double size, std::span<const double> coefficients) {
  constexpr double alike = 0.2;    // of the object's size: over so far are smooth errors alike
  constexpr double nugget = 1e-3;  // of the kernel: places of a small scan may be near each other
  constexpr int smooth = count - 1;
  const double part = std::sqrt(0.5) * deviation;
  common_ = part * coefficients[0];
  inverse_square_ = 0.5 / std::pow(alike * size, 2);
  places_ = places_over(scan, smooth);
  MatrixX kernel(smooth, smooth);
  for (int i = 0; i < smooth; ++i)
    for (int j = 0; j < smooth; ++j)
      kernel(i, j) = std::exp(-inverse_square_ * (places_[std::size_t(i)] - places_[std::size_t(j)]).squaredNorm()) +
                     (i == j ? nugget : 0.0);
  VectorX independent(smooth);
  for (int i = 0; i < smooth; ++i) independent[i] = part * coefficients[std::size_t(i) + 1];
  weights_ = kernel.llt().matrixU().solve(independent);
}

double ScanErrors::operator()(const Vector3& p) const {
  double offset = common_;
  for (std::size_t i = 0; i < places_.size(); ++i)
    offset += weights_[Eigen::Index(i)] * std::exp(-inverse_square_ * (p - places_[i]).squaredNorm());
  return offset;
}

double prior_of_scan_errors(std::span<const double> coefficients) {
  double sum = 0.0;
  for (const double c : coefficients) sum += 0.5 * c * c;
  return sum;
}

ScanErrorStep scan_error_step(const CostEvaluation& at, const CostEvaluation& about,
                              std::span<const CostEvaluation> moved, double width,
                              std::span<const double> coefficients) {
  const Eigen::Index n = at.gradient.size(), m = Eigen::Index(moved.size());
  MatrixX by_both = MatrixX::Zero(n, m), by_errors = MatrixX::Identity(m, m);
  VectorX gradient(m);
  for (Eigen::Index k = 0; k < m; ++k) gradient[k] = coefficients[std::size_t(k)];
  for (std::size_t f = 0; f < at.frames.size(); ++f)
    for (std::size_t part = 0; part < at.frames[f].rows.size(); ++part) {
      const ResidualRows& rows = at.frames[f].rows[part];
      MatrixX D = MatrixX::Zero(rows.residual.size(), m);
      for (Eigen::Index k = 0; k < m; ++k) {
        const CostEvaluation& other = moved[std::size_t(k)];
        if (!about.succeeded || !other.succeeded) continue;
        const ResidualRows &here = about.frames[f].rows[part], &there = other.frames[f].rows[part];
        for (Eigen::Index i = 0; i < D.rows(); ++i)  // what is not matched in all has no difference
          if (rows.weight[i] > 0.0 && here.weight[i] > 0.0 && there.weight[i] > 0.0)
            D(i, k) = (there.residual[i] - here.residual[i]) / width;
      }
      const MatrixX weighted = rows.weight.asDiagonal() * D;
      by_both += rows.J.transpose() * weighted;
      by_errors += D.transpose() * weighted;
      gradient += weighted.transpose() * rows.residual;
    }
  // What is estimated is eliminated.
  const MatrixX follow = -solve_symmetric(at.gauss_newton, by_both);
  const VectorX own = -solve_symmetric(at.gauss_newton, at.gradient);
  const MatrixX left = by_errors + by_both.transpose() * follow;
  const VectorX pull = gradient + by_both.transpose() * own;
  VectorX step = -solve_symmetric(left, pull);
  ScanErrorStep result;
  for (Eigen::Index k = 0; k < m; ++k) {
    const double before = coefficients[std::size_t(k)];
    result.coefficients.push_back(std::clamp(before + step[k], -most_deviations, most_deviations));
    step[k] = result.coefficients.back() - before;
  }
  result.shift = own + follow * step;
  result.promise = -0.5 * at.gradient.dot(own) - step.dot(pull + 0.5 * left * step);
  result.follows = follow;
  return result;
}

}  // namespace pliant
