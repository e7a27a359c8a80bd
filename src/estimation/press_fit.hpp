#pragma once

#include "estimation/fit.hpp"

namespace pliant {

/// Static tests as the recording of a fit that they are.
/// @param layout    of the law in the outcome's theta
/// @param specimen  whose frames the evaluation is to have (`FrameFit::recording`)
RecordingOutcome as_recording(const std::shared_ptr<const Body>& body, const LawLayout& layout,
                              const FitOutcome& outcome, int specimen = 0);

/// Poisson's ratio where the choices give it and keep it; nothing: it is estimated.
std::optional<double> known_poissons_ratio(const FitOptions& options);

/// Estimates a material from static tests with known forces of one object or several (presses, force-depth curves,
/// measurements between grips, stress-strain curves): Ogden's law of one term from the stiffness of a punch on a half
/// space, more terms, and Poisson's ratios of their own for them, as long as the Bayesian information criterion falls;
/// then zones of laws of their own, cut one after the other where that promises most, as long as the evidence supports
/// them
/// (`log_bayes_factor`) and each takes three per cent off the squares of the residuals, or, where a capture names
/// regions, a law for each of them; and where no zone is kept, control points of Young's modulus by the same rule. The
/// noise, and how it grows with displacement, is what the residuals say, robustly (`robust_noise`). A sampled material
/// (`PressSampling`) begins with one law of one or two terms. Several objects are of one material: they have neither
/// zones nor control points.
/// @param captures  one at least; they stay where they are as long as this runs
/// @param held_out  static tests that take no part and are predicted; null: none
/// @return  with `FitOutcome::law`
/// Throws InputError where a capture has no static test to fit or cannot be fitted, or where options are chosen that
/// static tests do not know.
FitOutcome fit_presses(const std::vector<const Capture*>& captures, const FitOptions& options,
                       const FitMonitor& monitor = {}, FitState resume = {}, const Capture* held_out = nullptr);

/// The choices of a fit of static tests as they were used: the law that was kept, of regions or zones or of a field.
FitOptions with_law(FitOptions options, const LawForm& form, bool is_field);

/// The floor of the deviations of what static tests tell, as `uncertainty_of` takes it; empty where alternatives are
/// switched off.
VectorX floor_of_tests(const FitOutcome& outcome, const JudgementOptions& options);

/// By how much Young's moduli would differ in a form of the law that was tried and left although the evidence does not
/// rule it out (ln of the Bayes factor above -3): of those forms the one that is farthest. None where there is none.
/// @param youngs_modulus  of the form that was kept [Pa]
std::vector<ModelShift> shifts_of_forms(const ParameterSet& parameters, double youngs_modulus,
                                        const std::vector<TriedLaw>& tried);

}  // namespace pliant
