#include "estimation/gradient_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace pliant {

namespace {

constexpr double trust = 10.0;         // times the spread of neighbouring differences: what they cannot tell
constexpr double least_digits = 0.05;  // of the derivative: differences less certain than this decide nothing

using Outcome = CheckedDerivative::Verdict;

double difference(CostFunction& cost, const VectorX& p, Eigen::Index i, double h) {
  const VectorX step = h * VectorX::Unit(p.size(), i);
  const CostEvaluation up = cost.evaluate(p + step), down = cost.evaluate(p - step);
  return up.succeeded && down.succeeded ? (up.cost - down.cost) / (2.0 * h) : not_a_number;
}

/// The middle of the three neighbouring steps whose differences spread least.
void take_best_step(CheckedDerivative& d) {
  d.by_difference = not_a_number;
  d.uncertainty = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k + 1 < d.differences.size(); ++k) {
    const auto [low, high] = std::minmax({d.differences[k - 1], d.differences[k], d.differences[k + 1]});
    const double spread = high - low + 0.0 * (d.differences[k - 1] + d.differences[k] + d.differences[k + 1]);
    if (!(spread < d.uncertainty)) continue;
    d.uncertainty = spread;
    d.by_difference = d.differences[k];
    d.step = d.steps[k];
  }
}

Outcome judge(const CheckedDerivative& d, double cost, double tolerance) {
  const double size = std::max({std::abs(d.by_tangents), std::abs(d.by_adjoint), d.scale});
  if (!(std::abs(d.by_tangents - d.by_adjoint) <= tolerance * size)) return Outcome::Disagree;
  if (!std::isfinite(d.by_difference)) return Outcome::Undecided;
  const double rounding = std::numeric_limits<double>::epsilon() * std::abs(cost) / d.step;
  const double unknown = trust * (d.uncertainty + rounding) + tolerance * size;
  if (std::abs(d.by_tangents - d.by_difference) > unknown) return Outcome::Disagree;
  return unknown > least_digits * size && unknown > 0.0 && size > 0.0 ? Outcome::Undecided : Outcome::Agree;
}

const char* word(Outcome verdict) {
  switch (verdict) {
    case Outcome::Agree:
      return "agree";
    case Outcome::Disagree:
      return "DISAGREE";
    case Outcome::Undecided:
      return "undecided";
  }
  return "";
}

}  // namespace

bool GradientCheck::agrees() const {
  return std::ranges::none_of(derivatives, [](const auto& d) { return d.verdict == Outcome::Disagree; });
}

namespace {

/// Where the greatest step to either side stays within the bounds: at a bound differences see half a derivative.
VectorX beside_bounds(const ParameterSet& parameters, VectorX p, double step) {
  const VectorX up = VectorX::Constant(p.size(), step);
  p += (parameters.clamp(p - up) - (p - up)) + (parameters.clamp(p + up) - (p + up));
  return parameters.clamp(p);
}

}  // namespace

GradientCheck check_gradient(CostFunction& cost, const VectorX& at, const GradientCheckOptions& options) {
  if (!(options.greatest_step > 0.0) || options.steps < 3 || !(options.tolerance >= 0.0))
    throw std::invalid_argument("a gradient's check needs a positive step, three of them and a tolerance");
  const VectorX p = beside_bounds(cost.parameters(), at, options.greatest_step);
  GradientCheck check;
  const CostEvaluation by_tangents = cost.linearise(p), by_adjoint = cost.gradient(p);
  for (const CostEvaluation* e : {&by_tangents, &by_adjoint})
    if (!e->succeeded) return check.failure = e->failure, check;
  check.succeeded = true;
  check.cost = by_tangents.cost;
  const std::vector<std::string> names = cost.parameters().coordinate_names();
  for (Eigen::Index i = 0; i < p.size(); ++i) {
    CheckedDerivative d;
    d.name = names[std::size_t(i)];
    d.by_tangents = by_tangents.gradient[i];
    d.by_adjoint = by_adjoint.gradient[i];
    d.scale = std::sqrt(std::max(0.0, by_tangents.gauss_newton(i, i)));
    for (int k = 0; k < options.steps; ++k) {
      d.steps.push_back(options.greatest_step * std::pow(10.0, -0.5 * k));
      d.differences.push_back(difference(cost, p, i, d.steps.back()));
    }
    take_best_step(d);
    d.verdict = judge(d, check.cost, options.tolerance);
    check.derivatives.push_back(std::move(d));
  }
  return check;
}

std::string describe(const GradientCheck& check) {
  if (!check.succeeded) return "the gradient cannot be checked: " + check.failure + "\n";
  std::size_t width = 9;
  for (const CheckedDerivative& d : check.derivatives) width = std::max(width, d.name.size());
  std::string text = fmt::format("{:{}}  {:>14}  {:>14}  {:>14}  {:>9}  {:>8}  verdict\n", "parameter", width,
                                 "tangents", "adjoint", "difference", "+-", "step");
  for (const CheckedDerivative& d : check.derivatives)
    text += fmt::format("{:{}}  {:14.7g}  {:14.7g}  {:14.7g}  {:9.2g}  {:8.1e}  {}\n", d.name, width, d.by_tangents,
                        d.by_adjoint, d.by_difference, d.uncertainty, d.step, word(d.verdict));
  const auto count = [&](Outcome verdict) {
    return std::ranges::count(check.derivatives, verdict, &CheckedDerivative::verdict);
  };
  if (const auto wrong = count(Outcome::Disagree); wrong > 0)
    text += fmt::format("{} of {} derivatives disagree beyond what the differences can tell\n", wrong,
                        check.derivatives.size());
  else
    text += "tangents, adjoint and differences agree as far as the differences can tell\n";
  if (const auto open = count(Outcome::Undecided); open > 0)
    text += fmt::format("of {} derivatives no step size gives differences to compare with\n", open);
  return text;
}

}  // namespace pliant
