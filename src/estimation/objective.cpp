#include "estimation/objective.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "base/parallel.hpp"

namespace pliant {

namespace {

std::vector<std::unique_ptr<Trial>> trials_of(std::vector<ObservedMotion> motions) {
  std::vector<std::unique_ptr<Trial>> trials;
  for (ObservedMotion& motion : motions)
    trials.push_back(std::make_unique<MotionTrial>(std::move(motion), int(trials.size())));
  return trials;
}

}  // namespace

Objective::Objective(std::vector<std::unique_ptr<Trial>> trials, ParameterSet parameters)
    : parameters_(std::move(parameters)), trials_(std::move(trials)) {
  if (!std::ranges::all_of(trials_, [](const auto& trial) { return trial != nullptr; }))
    throw std::invalid_argument("an objective of trials, one of which is missing");
}

Objective::Objective(std::vector<ObservedMotion> motions, ParameterSet parameters)
    : Objective(trials_of(std::move(motions)), std::move(parameters)) {}

Objective::Objective(Mismatch mismatch, std::shared_ptr<const Body> body, SimulationOptions simulation,
                     std::shared_ptr<const std::vector<FrameObservations>> observations, ParameterSet parameters,
                     ObjectiveOptions options)
    : Objective({{std::move(mismatch), std::move(body), std::move(simulation), std::move(observations), options}},
                std::move(parameters)) {}

CostEvaluation Objective::sum(const VectorX& p, std::vector<CostEvaluation> parts, bool has_gradient,
                              bool has_matrix) const {
  CostEvaluation total;
  for (const CostEvaluation& part : parts) total.steps += part.steps, total.work += part.work;
  for (const CostEvaluation& part : parts)
    if (!part.succeeded) return total.failure = part.failure, total;
  MatrixX curvature;
  total.cost = parameters_.prior(p, &total.gradient, &curvature);
  if (has_matrix) total.gauss_newton = std::move(curvature);
  for (CostEvaluation& part : parts) {
    total.cost += part.cost;
    for (FrameFit& fit : part.frames) {
      if (has_matrix) total.gradient += fit.gradient, total.gauss_newton += fit.gauss_newton;
      total.frames.push_back(std::move(fit));
    }
  }
  if (!has_gradient) total.gradient.resize(0);
  total.succeeded = std::isfinite(total.cost);
  if (!total.succeeded) total.failure = "the cost is not finite";
  return total;
}

CostEvaluation Objective::run(const VectorX& p, bool with_tangents) {
  const VectorX theta = parameters_.to_theta(p);
  const MatrixX directions = with_tangents ? parameters_.jacobian(p) : MatrixX(theta.size(), 0);
  std::vector<CostEvaluation> parts(trials_.size());
  parallel_tasks(trials_.size(), [&](std::size_t i) { parts[i] = trials_[i]->run(theta, directions); });
  return sum(p, std::move(parts), with_tangents, with_tangents);
}

bool Objective::hold_shapes(const VectorX& p) {
  const VectorX theta = parameters_.to_theta(p);
  held_ = p;
  return std::ranges::all_of(trials_, [&](const auto& trial) { return trial->hold_shape(theta); });
}

CostEvaluation Objective::evaluate(const VectorX& p) { return run(p, false); }
CostEvaluation Objective::linearise(const VectorX& p) { return run(p, true); }

std::optional<Objective> Objective::anew() const {
  std::vector<std::unique_ptr<Trial>> trials;
  for (const auto& trial : trials_) {
    trials.push_back(trial->anew());
    if (!trials.back()) return std::nullopt;
  }
  Objective same(std::move(trials), parameters_);
  if (held_.size() > 0 && !same.hold_shapes(held_)) return std::nullopt;
  return same;
}

std::vector<CostEvaluation> Objective::evaluate(std::span<const VectorX> points, const OnEvaluated& on_evaluated) {
  if (!anew()) return CostFunction::evaluate(points, on_evaluated);
  std::vector<CostEvaluation> all(points.size());
  std::atomic<bool> goes_on = true;
  parallel_tasks(points.size(), [&](std::size_t i) {
    if (!goes_on) {
      all[i].failure = "left out";
      return;
    }
    all[i] = anew()->run(points[i], false);
    if (on_evaluated && !on_evaluated(i, all[i])) goes_on = false;
  });
  return all;
}

CostEvaluation Objective::gradient(const VectorX& p) {
  const VectorX theta = parameters_.to_theta(p);
  std::vector<CostEvaluation> parts(trials_.size());
  std::vector<VectorX> bars(trials_.size());
  parallel_tasks(trials_.size(), [&](std::size_t i) { parts[i] = trials_[i]->gradient(theta, bars[i]); });
  CostEvaluation total = sum(p, std::move(parts), true, false);
  if (!total.succeeded) return total;
  VectorX theta_bar = VectorX::Zero(theta.size());
  for (const VectorX& bar : bars) theta_bar += bar;
  total.gradient += parameters_.jacobian(p).transpose() * theta_bar;
  total.succeeded = total.gradient.allFinite();
  if (!total.succeeded) total.failure = "the gradient is not finite";
  return total;
}

}  // namespace pliant
