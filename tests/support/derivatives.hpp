#pragma once

#include <cmath>
#include <functional>
#include <limits>

#include "base/types.hpp"

namespace pliant::test {

/// Central differences of a vector function over a range of steps, judged at the bottom of the V:
/// the smallest |difference - derivative| / |derivative| over the steps h = scale * 10^-k, k = 2, ..., `last`.
inline double best_relative_error(const std::function<VectorX(double)>& along, const VectorX& derivative, double scale,
                                  int last = 9) {
  double best = std::numeric_limits<double>::infinity();
  const double norm = derivative.norm();
  for (int k = 2; k <= last; ++k) {
    const double h = scale * std::pow(10.0, -k);
    const VectorX difference = (along(h) - along(-h)) / (2.0 * h);
    best = std::min(best, (difference - derivative).norm() / norm);
  }
  return best;
}

}  // namespace pliant::test
