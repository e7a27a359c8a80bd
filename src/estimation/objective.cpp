#include "estimation/objective.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include "base/parallel.hpp"
#include "estimation/cost_bytes.hpp"

namespace pliant {

namespace {

std::vector<std::unique_ptr<Trial>> trials_of(std::vector<ObservedMotion> motions) {
  std::vector<std::unique_ptr<Trial>> trials;
  for (ObservedMotion& motion : motions)
    trials.push_back(std::make_unique<MotionTrial>(std::move(motion), int(trials.size())));
  return trials;
}

/// What processes call an evaluation, with the bits of its vector: who comes with another one is found out.
std::string name_of(const char* what, std::span<const VectorX> points) {
  std::uint64_t digest = 0xcbf29ce484222325;  // FNV-1a
  for (const VectorX& p : points)
    for (const double number : p) digest = (digest ^ std::bit_cast<std::uint64_t>(number)) * 0x100000001b3;
  return fmt::format("{} {:016x}", what, digest);
}

}  // namespace

Objective::Objective(std::vector<std::unique_ptr<Trial>> trials, ParameterSet parameters,
                     std::shared_ptr<ProcessGroup> processes)
    : parameters_(std::move(parameters)), processes_(std::move(processes)), trials_(std::move(trials)) {
  if (!std::ranges::all_of(trials_, [](const auto& trial) { return trial != nullptr; }))
    throw std::invalid_argument("an objective of trials, one of which is missing");
  if (is_alone()) return;
  std::vector<double> work;
  for (const auto& trial : trials_) work.push_back(trial->expected_work());
  owners_ = shared_out(work, processes_->size());
  for (std::size_t i = 0; i < trials_.size(); ++i)
    if (owners_[i] != processes_->rank()) trials_[i].reset();
}

Objective::Objective(std::vector<ObservedMotion> motions, ParameterSet parameters)
    : Objective(trials_of(std::move(motions)), std::move(parameters)) {}

Objective::Objective(Mismatch mismatch, std::shared_ptr<const Body> body, SimulationOptions simulation,
                     std::shared_ptr<const std::vector<FrameObservations>> observations, ParameterSet parameters,
                     ObjectiveOptions options)
    : Objective({{std::move(mismatch), std::move(body), std::move(simulation), std::move(observations), options}},
                std::move(parameters)) {}

CostEvaluation Objective::sum(const VectorX& p, std::vector<Said> parts, bool has_gradient, bool has_matrix) const {
  CostEvaluation total;
  for (const Said& part : parts) total.steps += part.evaluation.steps, total.work += part.evaluation.work;
  for (const Said& part : parts)
    if (!part.evaluation.succeeded) return total.failure = part.evaluation.failure, total;
  MatrixX curvature;
  total.cost = parameters_.prior(p, &total.gradient, &curvature);
  if (has_matrix) total.gauss_newton = std::move(curvature);
  for (Said& part : parts) {
    total.cost += part.evaluation.cost;
    for (FrameFit& fit : part.evaluation.frames) {
      if (has_matrix) total.gradient += fit.gradient, total.gauss_newton += fit.gauss_newton;
      total.frames.push_back(std::move(fit));
    }
  }
  if (!has_gradient) total.gradient.resize(0);
  total.succeeded = std::isfinite(total.cost);
  if (!total.succeeded) total.failure = "the cost is not finite";
  return total;
}

// Shares of processes -------------------------------------------------------------------------------------------------

std::vector<Objective::Said> Objective::own_parts(const Run& run) {
  std::vector<Said> said(trials_.size());
  std::vector<std::size_t> own;
  for (std::size_t i = 0; i < trials_.size(); ++i)
    if (trials_[i]) own.push_back(i);
  parallel_tasks(own.size(), [&](std::size_t k) { said[own[k]] = run(*trials_[own[k]]); });
  return said;
}

void Objective::write_own(const std::vector<Said>& said, ByteWriter& to) const {
  for (std::size_t i = 0; i < said.size(); ++i)
    if (trials_[i]) write(said[i].evaluation, to), to.add(said[i].theta_bar);
}

void Objective::read_of(int rank, ByteReader& from, std::vector<Said>& said) const {
  for (std::size_t i = 0; i < said.size(); ++i)
    if (owners_[i] == rank) said[i].evaluation = read_evaluation(from), from.read(said[i].theta_bar);
}

std::vector<Objective::Said> Objective::parts(const char* what, const VectorX& p, const Run& run) {
  if (is_alone()) return own_parts(run);
  std::vector<Said> said(trials_.size());
  const std::vector<std::string> shares = processes_->gather(name_of(what, {&p, 1}), [&] {
    said = own_parts(run);
    ByteWriter writer;
    write_own(said, writer);
    return writer.take();
  });
  for (int rank = 0; rank < processes_->size(); ++rank) {
    if (rank == processes_->rank()) continue;
    ByteReader reader(shares[std::size_t(rank)]);
    read_of(rank, reader, said);
  }
  return said;
}

/// Each process runs its own trials at all points, side by side, and they exchange what came out once.
std::vector<CostEvaluation> Objective::evaluate_together(std::span<const VectorX> points,
                                                         const OnEvaluated& on_evaluated) {
  std::vector<std::vector<Said>> said(points.size(), std::vector<Said>(trials_.size()));
  const std::vector<std::string> shares = processes_->gather(name_of("costs", points), [&] {
    parallel_tasks(points.size(), [&](std::size_t i) { said[i] = anew()->own_parts(run_of(points[i], false)); });
    ByteWriter writer;
    for (const std::vector<Said>& at_point : said) write_own(at_point, writer);
    return writer.take();
  });
  for (int rank = 0; rank < processes_->size(); ++rank) {
    if (rank == processes_->rank()) continue;
    ByteReader reader(shares[std::size_t(rank)]);
    for (std::vector<Said>& at_point : said) read_of(rank, reader, at_point);
  }
  std::vector<CostEvaluation> all(points.size());
  bool goes_on = true;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!goes_on) {
      all[i].failure = "left out";
      continue;
    }
    all[i] = sum(points[i], std::move(said[i]), false, false);
    if (on_evaluated) goes_on = on_evaluated(i, all[i]);
  }
  return all;
}

// Evaluations ---------------------------------------------------------------------------------------------------------

Objective::Run Objective::run_of(const VectorX& p, bool with_tangents) const {
  VectorX theta = parameters_.to_theta(p);
  MatrixX directions = with_tangents ? parameters_.jacobian(p) : MatrixX(theta.size(), 0);
  return [theta = std::move(theta), directions = std::move(directions)](Trial& trial) {
    return Said{trial.run(theta, directions), {}};
  };
}

CostEvaluation Objective::run(const VectorX& p, bool with_tangents) {
  const char* what = with_tangents ? "a linearisation" : "a cost";
  return sum(p, parts(what, p, run_of(p, with_tangents)), with_tangents, with_tangents);
}

bool Objective::hold_own_shapes(const VectorX& p) {
  const VectorX theta = parameters_.to_theta(p);
  held_ = p;
  return std::ranges::all_of(trials_, [&](const auto& trial) { return !trial || trial->hold_shape(theta); });
}

bool Objective::hold_shapes(const VectorX& p) {
  if (is_alone()) return hold_own_shapes(p);
  const std::string yes = "yes";
  const std::vector<std::string> held =
      processes_->gather(name_of("held shapes", {&p, 1}), [&] { return hold_own_shapes(p) ? yes : std::string(); });
  return std::ranges::all_of(held, [&](const std::string& answer) { return answer == yes; });
}

CostEvaluation Objective::evaluate(const VectorX& p) { return run(p, false); }
CostEvaluation Objective::linearise(const VectorX& p) { return run(p, true); }

std::optional<Objective> Objective::anew() const {
  Objective same(std::vector<std::unique_ptr<Trial>>(), parameters_);
  for (const auto& trial : trials_) {
    same.trials_.push_back(trial ? trial->anew() : nullptr);
    if (trial && !same.trials_.back()) return std::nullopt;
  }
  if (held_.size() > 0 && !same.hold_own_shapes(held_)) return std::nullopt;
  return same;
}

std::vector<CostEvaluation> Objective::evaluate(std::span<const VectorX> points, const OnEvaluated& on_evaluated) {
  bool can_be_anew = false;
  if (is_alone()) {
    can_be_anew = anew().has_value();
  } else {
    const std::string yes = "yes";
    const auto answers =
        processes_->gather("whether trials can be had anew", [&] { return anew() ? yes : std::string(); });
    can_be_anew = std::ranges::all_of(answers, [&](const std::string& answer) { return answer == yes; });
  }
  if (!can_be_anew) return CostFunction::evaluate(points, on_evaluated);
  if (!is_alone()) return evaluate_together(points, on_evaluated);
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
  std::vector<Said> said = parts("a gradient", p, [&](Trial& trial) {
    Said one;
    one.evaluation = trial.gradient(theta, one.theta_bar);
    return one;
  });
  VectorX theta_bar = VectorX::Zero(theta.size());
  for (const Said& part : said)
    if (part.evaluation.succeeded) theta_bar += part.theta_bar;
  CostEvaluation total = sum(p, std::move(said), true, false);
  if (!total.succeeded) return total;
  total.gradient += parameters_.jacobian(p).transpose() * theta_bar;
  total.succeeded = total.gradient.allFinite();
  if (!total.succeeded) total.failure = "the gradient is not finite";
  return total;
}

}  // namespace pliant
