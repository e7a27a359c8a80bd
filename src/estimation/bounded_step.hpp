#pragma once

#include <vector>

#include "parameters/parameter_set.hpp"

namespace pliant {

/// A step of a quadratic model that stays within the parameters' bounds.
struct BoundedStep {
  VectorX step;
  std::vector<Eigen::Index> held;  ///< coordinates that end on a bound, beyond which the model falls
};

/// The least of g.s + s.H s / 2 with p + s within the bounds: -H^-1 g where that lies inside. A number that would cross
/// its bound goes there, and the others go where they then would: by an active set that only grows. What pushes itself
/// across goes first: another may be pushed by that alone, and what lies on a bound may leave it with the others.
/// @param p  unconstrained numbers, within their bounds
/// @param g  gradient there
/// @param H  symmetric and positive definite
BoundedStep step_within_bounds(const ParameterSet& parameters, const VectorX& p, const VectorX& g, const MatrixX& H);

}  // namespace pliant
