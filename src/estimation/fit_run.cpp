#include "estimation/fit_run.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace pliant {

namespace {

/// The overload that goes on from a state.
OptimiserSummary minimise_from(Objective& objective, const OptimiserState& state, const OptimiserOptions& options,
                               const std::function<bool(const Iteration&)>& on_iteration) {
  return minimise(objective, state, options, on_iteration);
}

}  // namespace

std::string in_three_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

FitRun::FitRun(std::vector<RecordedCapture> recorded, const FitOptions& fit_options, const FitMonitor& fit_monitor,
               FitState from)
    : options(fit_options),
      monitor(fit_monitor),
      state(std::move(from)),
      recordings(std::move(recorded), options, outcome.notes),
      parameters(recordings.parameters()),
      coarse(recordings.grid(options.coarse_cells, options.steps)),
      fine(recordings.grid(options.cells, options.steps)) {
  state.controls = recordings.controls();
}

ParameterSet FitRun::fixed_at(const VectorX& theta) const {
  std::vector<Parameter> list = parameters.parameters();
  for (Parameter& p : list) p.estimated = false;
  return {parameters.layout(), std::move(list), theta};
}

VectorX FitRun::without_pulls(VectorX theta) const {
  for (const Parameter& p : parameters.parameters())
    if (p.estimated && is_pull(p)) theta.segment<3>(p.at) = p.scale * p.prior_mean;
  return theta;
}

void FitRun::emit(FitEvent event) {
  event.fraction_done /= all_work();
  const std::lock_guard lock(mutex);
  if (monitor.on_event) monitor.on_event(event);
  outcome.history.push_back(std::move(event));
}

OptimiserSummary FitRun::optimise(Objective& objective, const OptimiserState& from, StageKind kind,
                                  const std::string& stage, int start, int iterations, int& counter, double done_from,
                                  double done_to, const std::function<void(const OptimiserState&)>& on_state) {
  OptimiserOptions o;
  o.kind = options.optimiser;
  o.max_iterations = iterations;
  const int first = counter;
  counter += from.iterations;
  const bool in_turns = options.load_free == LoadFreeScheme::InTurns && recordings.any_sags();
  OptimiserSummary s = (in_turns ? minimise_in_turns : minimise_from)(objective, from, o, [&](const Iteration& i) {
    ++counter;
    if (on_state) on_state(i.state());
    const double part = double(counter - first) / iterations;
    emit({kind, stage, start, counter, i.cost, i.damping, i.surface_rms, objective.parameters().to_theta(i.p),
          done_from + (done_to - done_from) * std::min(1.0, part)});
    return !interrupted();
  });
  const std::lock_guard lock(mutex);
  outcome.forward_steps += s.steps;
  return s;
}

std::vector<Spacing> FitRun::repetitions() const {
  return refined_spacings({options.cells, options.steps}, options.refine, recordings.any_meshed_here(),
                          !recordings.all_static());
}

double FitRun::all_work() const {
  double all = 1.0;
  for (const Spacing& s : repetitions()) all += work(s);
  return all;
}

}  // namespace pliant
