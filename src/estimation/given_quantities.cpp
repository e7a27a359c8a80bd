#include "estimation/given_quantities.hpp"

#include <algorithm>

#include "estimation/alternative.hpp"
#include "estimation/judgement.hpp"

namespace pliant {

namespace {

std::string sensor_of(const std::string& name) { return name.substr(name.find('@') + 1); }

/// Which error of a sensor's readings, for people.
std::string error_of_readings(const std::string& name) {
  return name.starts_with("range_scale")     ? "range scale of "
         : name.starts_with("focal_error")   ? "focal length of "
         : name.starts_with("outline_error") ? "outlines of "
                                             : "range of ";
}

/// Power of a length in a parameter that is measured in kilograms, metres and seconds. Where a density is given, masses
/// have the third.
int power_of_length(const std::string& unit, bool masses_are_known) {
  const int of_mass = masses_are_known ? 0 : 3;
  if (unit == "m" || unit == "m/s" || unit == "m/s^2") return 1;
  if (unit == "Pa") return of_mass - 1;
  if (unit == "Pa/m") return of_mass - 2;
  if (unit == "kg/m^3") return of_mass - 3;
  return 0;
}

/// How far an unconstrained number changes for each unit of the logarithm of its value.
double change_by_logarithm(const Parameter& parameter, double p) {
  if (parameter.transform == Transform::Logarithm) return 1.0;
  return parameter.transform == Transform::Shift || parameter.transform == Transform::Vector ? p : 0.0;
}

/// Curvature by one coordinate more, the logarithm of true lengths over those that are taken, the estimated ones
/// staying what they are in true lengths.
MatrixX with_scale(const MatrixX& gauss_newton, const ParameterSet& all, const std::vector<Eigen::Index>& estimated,
                   const GivenScale& scale) {
  const std::vector<const Parameter*> of = all.coordinate_parameters();
  const VectorX p = all.to_unconstrained(all.reference());
  const Eigen::Index n = p.size();
  VectorX along = VectorX::Zero(n);  // how numbers in lengths that are taken change
  for (Eigen::Index i = 0; i < n; ++i)
    if (of[std::size_t(i)]->transform == Transform::Strength) along[i] = -1.0;
  for (const Eigen::Index i : estimated) {
    const Parameter& q = *of[std::size_t(i)];
    along[i] = -power_of_length(q.unit, scale.masses_are_known) * change_by_logarithm(q, p[i]);
  }
  MatrixX H(n + 1, n + 1);
  H.topLeftCorner(n, n) = gauss_newton;
  H.topRightCorner(n, 1) = gauss_newton * along;
  H.bottomLeftCorner(1, n) = H.topRightCorner(n, 1).transpose();
  H(n, n) = along.dot(gauss_newton * along) + 1.0 / (scale.deviation * scale.deviation);
  return H;
}

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
    const auto add = [&](const std::string& cause, double judged, double least = 0.0) {
      const double deviation = std::max(p.given_std.value_or(judged), least);
      if (deviation > 0.0) given.push_back({p.name, cause, deviation});
    };
    if (p.role == Role::Sensor && p.is_scalar())
      add(error_of_readings(p.name) + sensor_of(p.name), judgement.given_shift);
    else if (p.role == Role::Sensor && p.unit == "rad")
      add("pose of " + sensor_of(p.name), judgement.given_turn, 2.0 * error_of(p));
    else if (p.role == Role::Sensor)
      add("pose of " + sensor_of(p.name), judgement.given_shift, error_of(p));
    else if (p.transform == Transform::Direction)
      add("direction of gravity", judgement.given_gravity, 2.0 * worst_error);
    else if (p.role == Role::Inertia && p.transform == Transform::Logarithm)
      add(cause_mass, judgement.given_density);
    else if (p.role == Role::Obstacle && p.transform == Transform::Shift)
      add("friction", judgement.given_friction);
    else if (p.role == Role::Obstacle && p.transform == Transform::Logarithm)
      add("stiffness of contact", judgement.given_contact);
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

ParameterSet with_strengths_of_gravity(const ParameterSet& parameters) {
  std::vector<Parameter> list = parameters.parameters();
  for (const Parameter& p : parameters.parameters()) {
    if (p.transform != Transform::Direction || p.origin.norm() == 0.0) continue;
    Parameter strength{p.name + " strength", p.unit, Transform::Strength, p.at};
    strength.origin = p.origin;
    strength.estimated = true;
    list.push_back(std::move(strength));
  }
  return {parameters.layout(), std::move(list), parameters.reference()};
}

std::vector<ModelShift> shifts_of_given(const CostEvaluation& evaluation, const ParameterSet& all,
                                        const std::vector<GivenQuantity>& given, const GivenScale& scale) {
  std::vector<Eigen::Index> estimated, moving;
  std::vector<std::string> causes;
  const std::vector<const Parameter*> of = all.coordinate_parameters();
  for (std::size_t i = 0; i < of.size(); ++i) {
    if (of[i]->transform == Transform::Strength) continue;  // moves with the scale alone
    const auto it = std::ranges::find(given, of[i]->name, &GivenQuantity::parameter);
    if (it == given.end()) {
      estimated.push_back(Eigen::Index(i));
      continue;
    }
    moving.push_back(Eigen::Index(i));
    causes.push_back(it->cause);
  }
  MatrixX H = evaluation.gauss_newton;
  if (scale.deviation > 0.0) {
    H = with_scale(H, all, estimated, scale);
    moving.push_back(H.rows() - 1);
    causes.emplace_back(cause_scale);
  }
  std::vector<ModelShift> shifts;
  if (moving.empty() || estimated.empty()) return shifts;
  const MatrixX moved_by = shifts_of_given(H, estimated, moving);
  for (std::size_t k = 0; k < causes.size(); ++k) shifts.push_back({causes[k], moved_by.col(Eigen::Index(k))});
  return shifts;
}

}  // namespace pliant
