#include "estimation/curve_fit.hpp"

#include <limits>
#include <stdexcept>

#include "base/error.hpp"
#include "estimation/material_tests.hpp"
#include "estimation/problem.hpp"

namespace pliant {

namespace {

std::shared_ptr<const PressScene> scene_of(const Capture& capture, const PressFitOptions& options) {
  if (capture.scene.object.surface) {
    Resolution resolution;
    resolution.cells = options.cells;
    resolution.element = options.quadratic ? ElementKind::QuadraticTetrahedron : ElementKind::Tetrahedron;
    std::vector<Vector3> control_points;
    auto body = std::make_shared<Body>(*make_body_of(capture.scene, SignedDistance(), resolution, control_points));
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

PressFitOutcome fit_material_curves(const Capture& capture, const PressFitOptions& options) {
  if (options.material == PressMaterial::Sampled)
    throw InputError({{capture.file},
                      "material=sampled and no press to fit",
                      "blocks [[press]], whose markers show where the object is how stiff",
                      "leave out material, or choose ogden or linear"});
  PressFitOutcome outcome;
  outcome.scene = scene_of(capture, options);
  std::vector<MaterialTest> fitted;
  for (const ObservedCurve& curve : outcome.scene->static_tests().curves)
    if (curve.role == "fit") fitted.push_back(curve.test);
  CurveFitOptions choices;
  choices.poissons_ratio = options.poissons_ratio;
  if (options.terms > 0) choices.max_terms = options.terms;
  if (options.material == PressMaterial::Linear) choices.max_terms = 0;
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
    const bool is_first = outcome.tried.empty();
    const double evidence = is_first ? std::numeric_limits<double>::infinity() : 0.5 * (before - tried.bic);
    before = tried.bic;
    const bool kept = fit.succeeded && tried.terms <= fit.layout.form().terms;
    outcome.tried.push_back({{1, tried.terms}, tried.cost, evidence, kept});
  }
  outcome.reason = fit.succeeded ? fit.reason : fit.failure;
  if (!fit.succeeded) return outcome;
  outcome.layout = fit.layout;
  outcome.parameters = fit.parameters;
  outcome.parameters.set_reference(fit.theta);
  outcome.theta = fit.theta;
  Objective objective = curve_objective(fitted, fit.layout.form().terms, outcome.parameters, choices.noise);
  outcome.evaluation = objective.linearise(outcome.parameters.to_unconstrained(fit.theta));
  outcome.start_cost = fit.tried.front().cost;
  outcome.law = press_law(*outcome.scene->body, fit.layout, fit.theta);
  outcome.covariance = parameter_covariance(outcome.evaluation);
  outcome.std = outcome.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const VectorX inverse = outcome.std.cwiseMax(1e-300).cwiseInverse();
  outcome.correlation = inverse.asDiagonal() * outcome.covariance * inverse.asDiagonal();
  outcome.succeeded = outcome.evaluation.succeeded;
  outcome.converged = fit.converged;
  return outcome;
}

}  // namespace pliant
