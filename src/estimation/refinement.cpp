#include "estimation/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "estimation/judgement.hpp"

namespace pliant {

namespace {

constexpr double least_order = 0.5;

/// The estimates that differ from the first in one of the two spacings alone, the first among them.
template <class Same>
std::vector<VectorX> alike(const Refinement& refinement, const ParameterSet& parameters, Same&& same) {
  std::vector<VectorX> p;
  for (const RefinedEstimate& e : refinement.estimates)
    if (same(e)) p.push_back(parameters.to_unconstrained(e.theta));
  return p;
}

struct Limits {
  VectorX values, errors;  // errors are of the last
};

/// Of the last three, where there are as many.
Limits limits_of(const std::vector<VectorX>& p, double ratio) {
  constexpr std::size_t most = 3;
  Limits limits{p.back(), VectorX::Zero(p.back().size())};
  for (Eigen::Index i = 0; i < p.back().size(); ++i) {
    std::vector<double> values;
    for (std::size_t k = p.size() - std::min(p.size(), most); k < p.size(); ++k) values.push_back(p[k][i]);
    const Limit limit = limit_of(values, ratio, Refinement::order);
    limits.values[i] = limit.value, limits.errors[i] = limit.error;
  }
  return limits;
}

}  // namespace

Limit limit_of(std::span<const double> values, double ratio, double order) {
  if (values.size() < 2 || values.size() > 3 || !(ratio > 1.0))
    throw std::invalid_argument("limit_of: two or three values at a ratio above one are needed");
  const double last = values.back(), change = last - values[values.size() - 2];
  const auto from = [&](double observed, double safety) {
    const double rest = change / (std::pow(ratio, observed) - 1.0);
    return Limit{last + rest, safety * std::abs(rest)};
  };
  if (values.size() == 2) return from(order, judgement.safety_of_two);
  const double before = values[1] - values[0];
  if (change == 0.0) return {last, 0.0};
  const double observed = std::log(before / change) / std::log(ratio);  // NaN where they swing
  if (!(observed > 0.0)) return {last, judgement.safety_of_three * std::max(std::abs(change), std::abs(before))};
  return from(std::clamp(observed, least_order, order), judgement.safety_of_three);
}

std::vector<Spacing> refined_spacings(Spacing first, int count, bool meshes, bool steps) {
  std::vector<Spacing> spacings;
  for (int i = 1; i < count && steps; ++i)
    spacings.push_back({first.cells, first.steps * std::pow(Refinement::step_ratio, i)});
  for (int i = 1; i < count && meshes; ++i)
    spacings.push_back({first.cells * std::pow(Refinement::mesh_ratio, i), first.steps});
  return spacings;
}

Refinement extrapolate(std::vector<RefinedEstimate> estimates, const ParameterSet& parameters) {
  if (estimates.empty()) throw std::invalid_argument("extrapolate: there is no estimate");
  Refinement r;
  r.estimates = std::move(estimates);
  const RefinedEstimate& first = r.estimates.front();
  for (std::size_t i = 1; i < r.estimates.size(); ++i)
    if (r.estimates[i].steps == first.steps) r.finest = int(i);
  r.extrapolated = parameters.to_unconstrained(r.estimates[std::size_t(r.finest)].theta);
  const auto meshes = alike(r, parameters, [&](const RefinedEstimate& e) { return e.steps == first.steps; });
  const auto steps = alike(r, parameters, [&](const RefinedEstimate& e) { return e.cells == first.cells; });
  if (meshes.size() > 1) {
    const Limits limits = limits_of(meshes, Refinement::mesh_ratio);
    r.mesh_error = limits.errors;
    r.extrapolated += limits.values - meshes.back();
  }
  if (steps.size() > 1) {
    // The result has the first step, whose error is that of the smallest and what has changed since.
    const Limits limits = limits_of(steps, Refinement::step_ratio);
    r.step_error = limits.errors + (steps.back() - steps.front()).cwiseAbs();
    r.extrapolated += limits.values - steps.front();
  }
  r.extrapolated = parameters.clamp(r.extrapolated);
  return r;
}

}  // namespace pliant
