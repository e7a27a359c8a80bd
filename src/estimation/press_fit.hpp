#pragma once

#include "estimation/fit.hpp"

namespace pliant {

/// Whether presses are all that there is to fit in a capture.
bool is_of_presses_alone(const Capture& capture);

/// Estimates an object's material from presses with known force: Ogden's law of one term from the stiffness of a punch
/// on a half space, more terms, and Poisson's ratios of their own for them, as long as the Bayesian information
/// criterion falls; then zones of laws of their own, cut one after the other where that promises most, as long as the
/// evidence supports them (`log_bayes_factor`) and each takes three per cent off the squares of the residuals, or,
/// where a capture names regions, a law for each of them; and where no zone is kept, control points of Young's modulus
/// by their evidence. The noise is what the residuals say, robustly. For a sampled material the law of one term is what
/// each press's field is smooth about.
/// @return  with `FitOutcome::law`
/// Throws InputError where the capture has no presses to fit or cannot be fitted, or where options are chosen that
/// presses do not know.
FitOutcome fit_presses(const Capture& capture, const FitOptions& options, const FitMonitor& monitor = {},
                       FitState resume = {});

}  // namespace pliant
