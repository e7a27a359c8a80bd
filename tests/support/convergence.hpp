#pragma once

#include <cmath>
#include <vector>

namespace pliant::test {

/// Order of convergence: least-squares slope of log(error) over log(size).
inline double fitted_order(const std::vector<double>& sizes, const std::vector<double>& errors) {
  double mean_x = 0.0, mean_y = 0.0, xx = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < sizes.size(); ++i)
    mean_x += std::log(sizes[i]) / double(sizes.size()), mean_y += std::log(errors[i]) / double(sizes.size());
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const double x = std::log(sizes[i]) - mean_x;
    xx += x * x, xy += x * (std::log(errors[i]) - mean_y);
  }
  return xy / xx;
}

}  // namespace pliant::test
