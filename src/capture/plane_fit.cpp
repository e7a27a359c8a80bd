#include "capture/plane_fit.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "base/median.hpp"

namespace pliant {

namespace {

bool is_allowed(const Vector3& normal, const PlaneFitOptions& options) {
  return !options.normal || std::abs(normal.dot(*options.normal)) >= std::cos(options.greatest_angle);
}

bool is_on(const PlaneFit& plane, const Vector3& point, float noise, double reach) {
  return std::abs(plane.height(point)) <= reach * double(noise);
}

// Evenly spread indices, all of them if there are few.
std::vector<std::size_t> spread(std::size_t count, std::size_t most) {
  std::vector<std::size_t> indices(std::min(count, most));
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = i * count / indices.size();
  return indices;
}

std::optional<PlaneFit> best_hypothesis(std::span<const Vector3> points, std::span<const float> noise,
                                        const PlaneFitOptions& options) {
  const auto sample = spread(points.size(), std::size_t(options.sample));
  std::mt19937_64 random(options.seed);
  const auto draw = [&]() -> const Vector3& { return points[sample[random() % sample.size()]]; };
  std::optional<PlaneFit> best;
  for (int i = 0; i < options.hypotheses; ++i) {
    const Vector3 &a = draw(), &b = draw(), &c = draw();
    const Vector3 cross = (b - a).cross(c - a);
    if (!(cross.norm() > 1e-12)) continue;
    PlaneFit plane{a, cross.normalized(), 0.0, 0};
    if (!is_allowed(plane.normal, options)) continue;
    for (const std::size_t s : sample) plane.inliers += is_on(plane, points[s], noise[s], options.reach);
    if (!best || plane.inliers > best->inliers) best = plane;
  }
  return best;
}

// Least squares on the points that `plane` explains.
std::optional<PlaneFit> refined(const PlaneFit& plane, std::span<const Vector3> points, std::span<const float> noise,
                                double reach) {
  double weights = 0.0;
  Vector3 mean = Vector3::Zero();
  PlaneFit result;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_on(plane, points[i], noise[i], reach)) continue;
    const double weight = 1.0 / (double(noise[i]) * double(noise[i]));
    weights += weight;
    mean += weight * points[i];
    ++result.inliers;
  }
  if (result.inliers < 3) return std::nullopt;
  result.point = mean / weights;
  Matrix3 moment = Matrix3::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!is_on(plane, points[i], noise[i], reach)) continue;
    const Vector3 arm = points[i] - result.point;
    moment += arm * arm.transpose() / (double(noise[i]) * double(noise[i]));
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(moment);
  if (!(eigen.eigenvalues()[1] > 1e-12 * eigen.eigenvalues()[2])) return std::nullopt;  // a line
  result.normal = eigen.eigenvectors().col(0);
  if (result.normal.dot(plane.normal) < 0) result.normal = -result.normal;
  double squares = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (is_on(plane, points[i], noise[i], reach)) squares += std::pow(result.height(points[i]), 2);
  result.rms = std::sqrt(squares / result.inliers);
  return result;
}

// How much less than their noise claims the points on a plane scatter: 1, or down to a third.
double relative_scatter(const PlaneFit& plane, std::span<const Vector3> points, std::span<const float> noise,
                        double reach) {
  std::vector<double> ratios;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (is_on(plane, points[i], noise[i], reach))
      ratios.push_back(std::abs(plane.height(points[i])) / double(noise[i]));
  if (ratios.empty()) return 1.0;
  constexpr double median_to_deviation = 1.4826;  // of a normal distribution
  return std::clamp(median_to_deviation * median(std::move(ratios)), 1.0 / 3.0, 1.0);
}

}  // namespace

std::optional<PlaneFit> fit_plane(std::span<const Vector3> points, std::span<const float> noise,
                                  const PlaneFitOptions& options) {
  if (points.size() < 3) return std::nullopt;
  std::optional<PlaneFit> plane = best_hypothesis(points, noise, options);
  for (int i = 0, before = -1; plane && i < 20 && plane->inliers != before; ++i) {
    before = plane->inliers;
    const double reach = options.reach * relative_scatter(*plane, points, noise, options.reach);
    plane = refined(*plane, points, noise, reach);
  }
  if (!plane || !is_allowed(plane->normal, options)) return std::nullopt;
  if (options.normal && plane->normal.dot(*options.normal) < 0) plane->normal = -plane->normal;
  return plane;
}

}  // namespace pliant
