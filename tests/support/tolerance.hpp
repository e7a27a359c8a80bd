#pragma once

#include <cstdlib>

namespace pliant::test {

/// A tolerance, scaled by the environment variable PLIANT_TOLERANCE_SCALE: with 0 every comparison fails and prints
/// what the true residual is.
inline double tolerance(double value) {
  static const double scale = [] {
    const char* text = std::getenv("PLIANT_TOLERANCE_SCALE");
    return text ? std::atof(text) : 1.0;
  }();
  return scale * value;
}

}  // namespace pliant::test
