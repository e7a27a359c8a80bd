#pragma once

#include "estimation/press_fit.hpp"

namespace pliant {

/// Estimates a material from stress-strain curves alone: `fit_curves`, told as a fit of static tests.
/// @param captures  one at least
/// Throws InputError where no stress of the curves has the sign of its strain.
FitOutcome fit_material_curves(const std::vector<const Capture*>& captures, const FitOptions& options);

}  // namespace pliant
