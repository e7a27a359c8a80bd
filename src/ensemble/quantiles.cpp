#include "ensemble/quantiles.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/types.hpp"

namespace pliant {

namespace {

/// Calls take(k, quantile) for each share, which are ascending. What lies behind one is put in order no further than
/// the next one needs.
template <class Number, class Shares, class Take>
void find_quantiles(Number* begin, Number* end, const Shares& shares, const Take& take) {
  end = std::partition(begin, end, [](Number value) { return std::isfinite(value); });
  const auto n = std::size_t(end - begin);
  Number* ordered = begin;  // all before it stand in order
  for (std::size_t k = 0; k < std::size(shares); ++k) {
    if (n == 0) {
      take(k, not_a_number);
      continue;
    }
    const double place = shares[k] * double(n - 1);
    const auto below = std::min(std::size_t(place), n - 1), above = std::min(below + 1, n - 1);
    for (const std::size_t rank : {below, above}) {
      if (begin + rank < ordered) continue;
      std::nth_element(ordered, begin + rank, end);
      ordered = begin + rank + 1;
    }
    const double low = double(begin[below]), high = double(begin[above]), part = place - double(below);
    take(k, low + part * (high - low));
  }
}

/// From 0; of equal numbers the mean.
std::vector<double> ranks(const std::vector<double>& numbers) {
  std::vector<std::size_t> order(numbers.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return numbers[i]; });
  std::vector<double> of(numbers.size());
  for (std::size_t i = 0, end = 0; i < order.size(); i = end) {
    while (end < order.size() && numbers[order[end]] == numbers[order[i]]) ++end;
    for (std::size_t k = i; k < end; ++k) of[order[k]] = 0.5 * double(i + end - 1);
  }
  return of;
}

}  // namespace

std::vector<double> quantiles(std::vector<double> numbers, const std::vector<double>& shares) {
  std::vector<double> found(shares.size());
  find_quantiles(numbers.data(), numbers.data() + numbers.size(), shares,
                 [&](std::size_t k, double value) { found[k] = value; });
  return found;
}

std::array<double, 5> told_quantiles(std::vector<double> numbers) {
  std::array<double, 5> found{};
  find_quantiles(numbers.data(), numbers.data() + numbers.size(), told_shares,
                 [&](std::size_t k, double value) { found[k] = value; });
  return found;
}

std::array<double, 5> told_quantiles(float* begin, float* end) {
  std::array<double, 5> found{};
  find_quantiles(begin, end, told_shares, [&](std::size_t k, double value) { found[k] = value; });
  return found;
}

double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> x, y;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (std::isfinite(a[i]) && std::isfinite(b[i])) x.push_back(a[i]), y.push_back(b[i]);
  if (x.size() < 3) return not_a_number;
  x = ranks(x), y = ranks(y);
  const double middle = 0.5 * double(x.size() - 1);
  double xx = 0.0, yy = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double dx = x[i] - middle, dy = y[i] - middle;
    xx += dx * dx, yy += dy * dy, xy += dx * dy;
  }
  return xx > 0.0 && yy > 0.0 ? xy / std::sqrt(xx * yy) : not_a_number;
}

}  // namespace pliant
