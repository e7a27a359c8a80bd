#pragma once

#include <cstdint>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// A smooth random function of places: nearly Gaussian, of mean 0 and covariance s^2 exp(-|p - q|^2 / (2 l^2)), as a
/// sum of waves (Rahimi and Recht 2007). The same seed gives the same function.
class RandomField {
 public:
  /// @param deviation  s >= 0, in the unit of the function
  /// @param length     l > 0, over which it is alike [m]
  RandomField(double deviation, double length, std::uint64_t seed);

  double operator()(const Vector3& p) const;

 private:
  struct Wave {
    Vector3 number;  // [rad/m]
    double phase;
  };
  std::vector<Wave> waves_;
  double amplitude_;
};

}  // namespace pliant
