#include "estimation/alternative.hpp"

#include <algorithm>
#include <cmath>

#include "estimation/uncertainty.hpp"

namespace pliant {

namespace {

/// What is still promised where the steps end, and where the last one may be trusted, in the cost's units.
constexpr double promise_of_alternative = 0.1, promise_to_trust = 0.5;

}  // namespace

double share_within(const VectorX& shift, const std::vector<const Parameter*>& coordinates, double most) {
  double of_modulus = 0.0;
  for (std::size_t i = 0; i < coordinates.size(); ++i)
    if (is_modulus(*coordinates[i])) of_modulus = std::max(of_modulus, std::abs(shift[Eigen::Index(i)]));
  return of_modulus > most ? most / of_modulus : 1.0;
}

MovedEstimate move_estimate(Objective& objective, const ParameterSet& parameters, int iterations,
                            const std::function<bool()>& goes_on) {
  OptimiserOptions o;
  o.max_iterations = iterations;
  o.promise_tolerance = promise_of_alternative;
  const OptimiserState from{0, parameters.to_unconstrained(parameters.reference()), {}};
  MovedEstimate moved{minimise(objective, from, o, [&](const Iteration&) { return goes_on(); }), false, {}};
  const OptimiserSummary& s = moved.summary;
  if (!s.succeeded) return moved;
  const VectorX rest = gauss_newton_shift(s.evaluation, largest_shift);
  const double promised = -(s.evaluation.gradient + 0.5 * s.evaluation.gauss_newton * rest).dot(rest);
  moved.converged = promised < promise_to_trust;
  moved.p = parameters.clamp(moved.converged ? VectorX(s.p + rest) : s.p);
  return moved;
}

}  // namespace pliant
