#pragma once

#include "estimation/fit.hpp"

namespace pliant {

/// Adds plain sentences about what the estimate can and cannot be trusted for.
void add_notes(FitOutcome& outcome, const std::vector<const Capture*>& captures);

/// "a neo-Hookean law", "Ogden's law of 2 terms".
std::string spoken_law(const LawForm& form);

}  // namespace pliant
