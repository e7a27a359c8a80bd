#pragma once

#include "model/result.hpp"

namespace pliant::test {

/// Figures of a load that a cloud saw.
inline LoadError seen_load() {
  LoadError error;
  error.name = "load 1", error.role = "test", error.observed = "cloud";
  error.points = 400, error.outliers = 3;
  error.mean = 1e-3, error.max = 4e-3, error.relative_mean = 0.005, error.relative_max = 0.02;
  return error;
}

/// A load without an equilibrium.
inline LoadError failed_load() {
  LoadError error;
  error.name = "load <2>", error.role = "fit", error.failure = "no equilibrium was found";
  return error;
}

}  // namespace pliant::test
