#include "estimation/given_quantities.hpp"

#include <algorithm>

#include "estimation/alternative.hpp"
#include "estimation/judgement.hpp"

namespace pliant {

namespace {

std::string sensor_of(const std::string& name) { return name.substr(name.find('@') + 1); }

}  // namespace

std::vector<GivenQuantity> given_quantities(const ParameterSet& parameters,
                                            const std::vector<CommonError>& common_errors) {
  std::vector<GivenQuantity> given;
  const auto error_of = [&](const Parameter& p) {
    for (const CommonError& e : common_errors)
      if (p.at == e.sensor.turn || p.at == e.sensor.shift) return e.relative;
    return 0.0;
  };
  double worst_error = 0.0;
  for (const CommonError& e : common_errors) worst_error = std::max(worst_error, e.relative);
  for (const Parameter& p : parameters.parameters()) {
    if (p.estimated) continue;
    if (p.role == Role::Sensor && p.is_scalar())
      given.push_back({p.name, (p.name.starts_with("outline_error") ? "outlines of " : "range of ") + sensor_of(p.name),
                       judgement.given_shift.value});
    else if (p.role == Role::Sensor)
      given.push_back({p.name, "pose of " + sensor_of(p.name),
                       p.unit == "rad" ? std::max(judgement.given_turn.value, 2.0 * error_of(p))
                                       : std::max(judgement.given_shift.value, error_of(p))});
    else if (p.transform == Transform::Direction)
      given.push_back({p.name, "direction of gravity", std::max(judgement.given_gravity.value, 2.0 * worst_error)});
    else if (p.role == Role::Inertia && p.transform == Transform::Logarithm)
      given.push_back({p.name, cause_mass, judgement.given_density.value});
    else if (p.role == Role::Obstacle && p.transform == Transform::Shift)
      given.push_back({p.name, "friction", judgement.given_friction.value});
    else if (p.role == Role::Obstacle && p.transform == Transform::Logarithm)
      given.push_back({p.name, "stiffness of contact", judgement.given_contact.value});
  }
  return given;
}

ParameterSet with_given(const ParameterSet& parameters, const std::vector<GivenQuantity>& given) {
  std::vector<Parameter> list = parameters.parameters();
  const VectorX& theta = parameters.reference();
  for (Parameter& p : list) {
    const auto it = std::ranges::find(given, p.name, &GivenQuantity::parameter);
    if (it == given.end()) continue;
    p.estimated = true;
    p.prior_std = it->deviation;
    ParameterSet alone(parameters.layout(), {p}, theta);
    p.prior_mean = alone.to_unconstrained(theta);
  }
  return {parameters.layout(), std::move(list), theta};
}

std::vector<ModelShift> shifts_of_given(const CostEvaluation& evaluation, const ParameterSet& all,
                                        const std::vector<GivenQuantity>& given) {
  std::vector<Eigen::Index> estimated, moving;
  std::vector<std::string> causes;
  const std::vector<const Parameter*> of = all.coordinate_parameters();
  for (std::size_t i = 0; i < of.size(); ++i) {
    const auto it = std::ranges::find(given, of[i]->name, &GivenQuantity::parameter);
    if (it == given.end()) {
      estimated.push_back(Eigen::Index(i));
      continue;
    }
    moving.push_back(Eigen::Index(i));
    causes.push_back(it->cause);
  }
  std::vector<ModelShift> shifts;
  if (moving.empty() || estimated.empty()) return shifts;
  const MatrixX moved_by = shifts_of_given(evaluation.gauss_newton, estimated, moving);
  for (std::size_t k = 0; k < causes.size(); ++k) shifts.push_back({causes[k], moved_by.col(Eigen::Index(k))});
  return shifts;
}

}  // namespace pliant
