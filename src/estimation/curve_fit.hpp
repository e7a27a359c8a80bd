#pragma once

#include "estimation/press_fit.hpp"

namespace pliant {

/// Estimates a material from stress-strain curves alone: `fit_curves`, told as a fit of static tests. Where the capture
/// has a shape the scene's body is that of the object; else it is one tetrahedron.
/// Throws InputError where no stress of the curves has the sign of its strain.
FitOutcome fit_material_curves(const Capture& capture, const FitOptions& options);

}  // namespace pliant
