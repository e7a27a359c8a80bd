#include "estimation/curve_fit.hpp"

#include <limits>
#include <stdexcept>

#include "base/error.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/material_tests.hpp"
#include "estimation/notes.hpp"
#include "estimation/press_fit.hpp"
#include "estimation/press_objective.hpp"
#include "estimation/specimens.hpp"

namespace pliant {

FitOutcome fit_material_curves(const std::vector<const Capture*>& captures, const FitOptions& options) {
  const Capture& capture = *captures.front();
  if (options.material == MaterialKind::Sampled)
    throw InputError({{capture.file},
                      "material=sampled and no press to fit",
                      "blocks [[press]], whose markers show where the object is how stiff",
                      "leave out material, or choose ogden or linear"});
  FitOutcome outcome;
  LawOutcome law;
  const std::vector<TestedSpecimen> specimens = specimens_of(captures, options);
  std::vector<MaterialTest> fitted;
  std::vector<int> of;  // the number of each one's specimen
  for (std::size_t i = 0; i < specimens.size(); ++i)
    for (const ObservedCurve& curve : specimens[i].scene->static_tests().curves)
      if (curve.role == "fit") fitted.push_back(curve.test), of.push_back(int(i));
  law.scene = specimens.front().scene;
  CurveFitOptions choices;
  choices.poissons_ratio = known_poissons_ratio(options);
  if (options.law_terms > 0) choices.max_terms = options.law_terms;
  if (options.material == MaterialKind::Linear) choices.max_terms = 0;
  CurveFit fit;
  try {
    fit = fit_curves(fitted, choices);
  } catch (const std::invalid_argument& wrong) {
    throw InputError({{capture.file},
                      wrong.what(),
                      "stress-strain curves of an elastic material",
                      "stretches are 1 and shears 0 at rest; tension is positive"});
  }
  double before = 0.0;
  for (const CurveFit::Tried& tried : fit.tried) {
    const bool is_first = law.tried.empty();
    const double evidence = is_first ? std::numeric_limits<double>::infinity() : 0.5 * (before - tried.bic);
    before = tried.bic;
    const bool kept = fit.succeeded && tried.terms <= fit.layout.form().terms;
    law.tried.push_back({{1, tried.terms}, tried.cost, evidence, kept, tried.youngs_modulus});
  }
  outcome.reason = fit.succeeded ? fit.reason : fit.failure;
  if (!fit.succeeded) return outcome;
  law.layout = fit.layout;
  outcome.parameters = fit.parameters;
  outcome.parameters.set_reference(fit.theta);
  outcome.theta = fit.theta;
  Objective objective = curve_objective(fitted, fit.layout.form().terms, outcome.parameters, choices.noise);
  outcome.evaluation = objective.linearise(outcome.parameters.to_unconstrained(fit.theta));
  outcome.start_cost = fit.tried.front().cost, outcome.final_cost = outcome.evaluation.cost;
  law.law = press_law(*law.scene->body, fit.layout, fit.theta);
  for (std::size_t f = 0; f < outcome.evaluation.frames.size(); ++f) outcome.evaluation.frames[f].recording = of[f];
  for (std::size_t i = 0; i < specimens.size(); ++i) {
    const std::shared_ptr<const PressScene>& scene = specimens[i].scene;
    if (i > 0) law.others.push_back({scene, press_law(*scene->body, fit.layout, fit.theta), {}});
    outcome.recordings.push_back(as_recording(scene->body, law.layout, outcome, int(i)));
  }
  if (outcome.evaluation.succeeded)
    add_uncertainty(outcome, shifts_of_forms(outcome.parameters, law.layout.mean_modulus(outcome.theta), law.tried),
                    floor_of_tests(outcome, options), agreements_of(specimens, outcome.evaluation));
  outcome.converged = fit.converged;
  outcome.cells = options.cells;
  outcome.used = with_law(options, fit.layout.form(), false);
  for (std::string& note : unused_choices(options, false, false)) outcome.notes.push_back(std::move(note));
  add_law_notes(outcome, law, capture);
  outcome.law = std::move(law);
  return outcome;
}

}  // namespace pliant
