#pragma once

#include <functional>

#include "estimation/objective.hpp"
#include "estimation/optimiser.hpp"

namespace pliant {

inline constexpr const char *cause_mesh = "mesh", *cause_mass = "mass", *cause_scale = "scale of lengths",
                            *cause_scan = "errors of the scan", *cause_unevenness = "uneven stiffness";
inline constexpr double largest_shift = 1.0;  ///< of an unconstrained coordinate, by a few steps

/// Where an estimate goes under another model of the same object.
struct MovedEstimate {
  OptimiserSummary summary;  ///< of the steps but the last
  bool converged = false;    ///< the last, short Gauss-Newton step, which is not evaluated, can be trusted
  VectorX p;                 ///< unconstrained, with that step where it can be trusted; empty where the steps failed
  /// By how much it moved, each coordinate as far as a few steps can tell.
  /// @param from  the estimate, of as many coordinates
  VectorX shift(const VectorX& from) const { return (p - from).cwiseMax(-largest_shift).cwiseMin(largest_shift); }
};

/// How much of a shift of unconstrained coordinates is taken for it where none of the moduli moves by more than `most`:
/// at most all of it, 1.
/// @param coordinates  the parameter of each
double share_within(const VectorX& shift, const std::vector<const Parameter*>& coordinates, double most);

/// At most so many iterations from the reference of the parameters, and a last step.
/// @param goes_on  asked at each
MovedEstimate move_estimate(Objective& objective, const ParameterSet& parameters, int iterations,
                            const std::function<bool()>& goes_on);

}  // namespace pliant
