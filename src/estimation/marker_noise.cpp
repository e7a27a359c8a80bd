#include "estimation/marker_noise.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/median.hpp"

namespace pliant {

namespace {

/// Degrees of freedom of Student's distribution, whose likelihood bears outliers, and what its scale is of normal
/// residuals of deviation 1: c of E[(n + 1) z^2 / (n c^2 + z^2)] = 1.
constexpr double freedom = 4.0, scale_of_normal = 0.8310035;

/// Of one ratio: a, and the mean of minus the logarithm of the likelihood.
struct Scaled {
  double at_rest, cost;
};

}  // namespace

double MarkerNoise::deviation(double weight, double displacement) const {
  return std::hypot(weight * at_rest, growth * displacement);
}

MarkerNoise robust_noise(std::span<const double> residuals, std::span<const double> weights,
                         std::span<const double> displacements, double least) {
  if (residuals.empty()) return least;
  const std::size_t count = residuals.size();
  std::vector<double> squares(count);
  double begin = least;
  for (const double r : residuals) begin += std::abs(r) / double(count);
  const auto scaled = [&](double ratio) -> Scaled {
    double logs = 0.0, a = begin;
    for (std::size_t i = 0; i < count; ++i) {
      const double s = std::hypot(weights[i], ratio * displacements[i]);
      squares[i] = residuals[i] * residuals[i] / (s * s);
      logs += std::log(s);
    }
    const auto mean_of = [&](const auto& term) {
      double sum = 0.0;
      for (const double square : squares) sum += term(square / (a * a));
      return sum / double(count);
    };
    // Expectation and maximisation.
    for (int k = 0; k < 100; ++k) {
      const double before = a;
      a *= std::sqrt(mean_of([](double z) { return (freedom + 1.0) * z / (freedom + z); }));
      a = std::max(a, least * scale_of_normal);
      if (std::abs(a - before) < 1e-4 * a) break;
    }
    const double loss = mean_of([](double z) { return 0.5 * (freedom + 1.0) * std::log1p(z / freedom); });
    return {a / scale_of_normal, std::log(a) + logs / double(count) + loss};
  };
  const Scaled constant = scaled(0.0);
  const double unit = median(std::vector(displacements.begin(), displacements.end()));
  if (!(unit > 0.0)) return constant.at_rest;
  // The ratio, as how much more than at rest a marker errs that has moved as far as the middle one.
  const auto at = [&](double log_ratio) { return scaled(std::exp(log_ratio) / unit); };
  constexpr double lowest = -3.0, highest = 8.0, step = 0.5;
  double best = lowest, least_cost = at(lowest).cost;
  for (double t = lowest + step; t <= highest; t += step)
    if (const double cost = at(t).cost; cost < least_cost) best = t, least_cost = cost;
  double low = best - step, high = best + step;
  constexpr double golden = 1.0 / std::numbers::phi;
  double left = high - golden * (high - low), right = low + golden * (high - low);
  double left_cost = at(left).cost, right_cost = at(right).cost;
  for (int k = 0; k < 16; ++k) {
    if (left_cost < right_cost) {
      high = right, right = left, right_cost = left_cost;
      left = high - golden * (high - low), left_cost = at(left).cost;
    } else {
      low = left, left = right, left_cost = right_cost;
      right = low + golden * (high - low), right_cost = at(right).cost;
    }
  }
  const double log_ratio = left_cost < right_cost ? left : right;
  const Scaled growing = at(log_ratio);
  if (double(count) * (constant.cost - growing.cost) < 0.5 * std::log(double(count))) return constant.at_rest;
  return {growing.at_rest, growing.at_rest * std::exp(log_ratio) / unit};
}

}  // namespace pliant
