#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

#include "estimation/gradient_check.hpp"
#include "estimation/press_objective.hpp"
#include "estimation/static_tests.hpp"

namespace pliant {

/// A body without weight under static tests.
inline std::shared_ptr<const PressScene> tested(std::shared_ptr<const Body> body, const std::vector<int>& held,
                                                StaticTests tests) {
  PressScene scene;
  scene.held = held;
  scene.unit_weight = Points::Zero(body->node_count(), 3);
  scene.body = std::move(body);
  scene.tests = std::make_shared<StaticTests>(std::move(tests));
  return std::make_shared<PressScene>(std::move(scene));
}

/// Forces of a ball over depths, all with one standard deviation [N].
inline ObservedIndentation pushed_ball(const Vector3& touch, const Vector3& normal, double radius,
                                       const std::vector<double>& depths, const std::vector<double>& forces, double std,
                                       const std::string& role = "fit") {
  return {"ball",
          role,
          {ProbeKind::Ball, touch, radius, -normal},
          {depths, forces, std::vector<double>(depths.size(), std)}};
}

/// The objective of all tests to fit of a scene.
inline PressObjective objective_of(const std::shared_ptr<const PressScene>& scene, const LawLayout& layout,
                                   const ParameterSet& parameters) {
  return {scene, {}, layout, parameters, PressTrialOptions{1.0, 1.0}};
}

/// Numbers, with null for those that are not finite.
inline nlohmann::json or_null(const std::vector<double>& values) {
  nlohmann::json list = nlohmann::json::array();
  for (const double v : values) list.push_back(std::isfinite(v) ? nlohmann::json(v) : nlohmann::json());
  return list;
}

/// Relative differences of the best central differences from the gradient, one a parameter. Throws where the cost
/// cannot be evaluated.
inline nlohmann::json derivative_errors(Objective& objective, const VectorX& p) {
  const GradientCheck check = check_gradient(objective, p);
  if (!check.succeeded) throw std::runtime_error(check.failure);
  nlohmann::json errors = nlohmann::json::array();
  for (const CheckedDerivative& d : check.derivatives)
    errors.push_back(std::abs(d.by_difference / d.by_tangents - 1.0));
  return errors;
}

}  // namespace pliant
