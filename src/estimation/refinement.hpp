#pragma once

#include <span>
#include <string>
#include <vector>

#include "parameters/parameter_set.hpp"

namespace pliant {

/// An estimate at one resolution.
struct RefinedEstimate {
  double cells = 0.0, steps = 0.0;  ///< as in `Resolution`
  int elements = 0;
  VectorX theta;
  double cost = 0.0;
  bool converged = false;
  std::string reason;  ///< why the optimiser stopped
};

/// Where a sequence of values leads as its spacing goes to zero, by Richardson's extrapolation.
struct Limit {
  double value = 0.0;
  double error = 0.0;  ///< of the last value, by the grid convergence index of Roache (1994)
};

/// @param values  two or three, finest last; each at a spacing `ratio` times smaller than that before
/// @param order   of convergence, assumed for two values; the most that is believed of three, whose order is observed.
///                Three that do not approach anything are not extrapolated: their spread is the error.
Limit limit_of(std::span<const double> values, double ratio, double order);

/// What discretisation leaves of an estimate's error, in unconstrained numbers. Empty vectors: not varied.
struct Refinement {
  static constexpr double mesh_ratio = 1.5, step_ratio = 2.0;  ///< from one resolution to the next
  static constexpr double order = 2.0;                         ///< of the elements and of the time steps

  std::vector<RefinedEstimate> estimates;  ///< in the order in which they were made
  int finest = 0;                          ///< of them the one that is the result
  VectorX mesh_error, step_error;          ///< of the result's coordinates
  VectorX extrapolated;                    ///< the result's coordinates with both taken to zero
};

/// The resolutions at which an estimate is repeated after the first, finer time steps before finer meshes.
/// @param count   resolutions in all, of meshes and of steps, 1..3
/// @param meshes  whether elements can be made smaller
/// @param steps   whether there are time steps
struct Spacing {
  double cells = 0.0, steps = 0.0;
};
std::vector<Spacing> refined_spacings(Spacing first, int count, bool meshes, bool steps);

/// @param estimates   the first, then those of `refined_spacings` as far as they succeeded; at least one
/// @param parameters  that they estimate
Refinement extrapolate(std::vector<RefinedEstimate> estimates, const ParameterSet& parameters);

}  // namespace pliant
