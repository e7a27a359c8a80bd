#include "estimation/curve_fit.hpp"

#include <limits>
#include <stdexcept>

#include "base/error.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/material_tests.hpp"
#include "estimation/notes.hpp"
#include "estimation/press_fit.hpp"
#include "estimation/press_objective.hpp"
#include "estimation/problem.hpp"

namespace pliant {

namespace {

std::shared_ptr<const PressScene> scene_of(const Capture& capture, const FitOptions& options) {
  if (capture.scene.object.surface) {
    std::vector<Vector3> control_points;
    auto body = std::make_shared<Body>(
        *make_body_of(capture.scene, SignedDistance(), resolution_of_tests(capture, options), control_points));
    body->modulus = unit_element()->modulus;  // a specimen tells of one material
    body->modulus.relative.assign(std::size_t(body->element_count()), 1.0);
    return std::make_shared<PressScene>(make_press_scene(capture, std::move(body)));
  }
  PressScene scene;
  scene.body = unit_element();
  scene.unit_weight = Points::Zero(scene.body->node_count(), 3);
  scene.density = capture.scene.object.density.value_or(0.0);
  StaticTests tests;
  tests.curves = observed_curves(capture);
  scene.tests = std::make_shared<StaticTests>(std::move(tests));
  return std::make_shared<PressScene>(std::move(scene));
}

}  // namespace

FitOutcome fit_material_curves(const Capture& capture, const FitOptions& options) {
  if (options.material == MaterialKind::Sampled)
    throw InputError({{capture.file},
                      "material=sampled and no press to fit",
                      "blocks [[press]], whose markers show where the object is how stiff",
                      "leave out material, or choose ogden or linear"});
  FitOutcome outcome;
  LawOutcome law;
  law.scene = scene_of(capture, options);
  std::vector<MaterialTest> fitted;
  for (const ObservedCurve& curve : law.scene->static_tests().curves)
    if (curve.role == "fit") fitted.push_back(curve.test);
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
    law.tried.push_back({{1, tried.terms}, tried.cost, evidence, kept});
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
  if (outcome.evaluation.succeeded) add_uncertainty(outcome, {}, {}, agreements_of(*law.scene, {}, outcome.evaluation));
  outcome.converged = fit.converged;
  outcome.cells = options.cells;
  outcome.recordings.push_back(as_recording(law.scene->body, law.layout, outcome));
  for (std::string& note : unused_choices(options, false, false)) outcome.notes.push_back(std::move(note));
  add_law_notes(outcome, law, capture);
  outcome.law = std::move(law);
  return outcome;
}

}  // namespace pliant
