#pragma once

#include "estimation/fit.hpp"

namespace pliant {

/// For people.
std::string in_three_digits(double value);

/// @param cause, why  of an alternative that could not be tried
std::string note_of_untried(const std::string& cause, const std::string& why);

/// Adds plain sentences about what the estimate can and cannot be trusted for.
void add_notes(FitOutcome& outcome, const std::vector<const Capture*>& captures);

/// What forms of a law were tried, its zones and its noise, in plain sentences.
void add_law_notes(FitOutcome& outcome, const LawOutcome& law, const Capture& capture);

}  // namespace pliant
