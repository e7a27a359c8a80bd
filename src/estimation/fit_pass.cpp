#include "estimation/fit_pass.hpp"

#include <algorithm>

#include "estimation/explained_span.hpp"
#include "estimation/field_choice.hpp"
#include "estimation/fit_run.hpp"

namespace pliant {

namespace {

void rename(const Pass& pass, FitEvent& event) {
  if (!pass.stage.empty() && event.kind != StageKind::Finer) event.stage = pass.stage;
  event.stage = pass.name + event.stage;
}

}  // namespace

FitOutcome carry_out(PassPlanner& planner, const FitMonitor& monitor) {
  FitState state;
  const auto save = [&] {
    planner.write(state);
    if (monitor.on_state) monitor.on_state(state);
  };
  while (std::optional<Pass> pass = planner.next()) {
    PassState reached = pass->begin;
    FitMonitor of_pass;
    of_pass.interrupted = monitor.interrupted, of_pass.processes = monitor.processes;
    of_pass.on_event = [&](FitEvent event) {
      event.fraction_done = pass->done_from + (pass->done_to - pass->done_from) * event.fraction_done;
      rename(*pass, event);
      if (monitor.on_event) monitor.on_event(event);
    };
    of_pass.on_state = [&](const FitState& s) {
      reached = s.pass;
      if (!pass->is_saved) return;
      state.pass = s.pass;
      save();
    };
    FitOutcome outcome = FitRun(pass->recordings, pass->options, of_pass, pass->begin, pass->limits).run();
    for (FitEvent& event : outcome.history) rename(*pass, event);
    const bool was_interrupted = outcome.interrupted;
    if (!planner.take(std::move(outcome), std::move(reached)) || was_interrupted) continue;
    state.pass = {};
    save();
  }
  return planner.outcome();
}

OnePass::OnePass(std::vector<RecordedCapture> recordings, const FitOptions& options, PassState begin) {
  pass_.recordings = std::move(recordings), pass_.options = options, pass_.begin = std::move(begin);
}

std::optional<Pass> OnePass::next() {
  if (outcome_) return std::nullopt;
  return pass_;
}

bool OnePass::take(FitOutcome outcome, PassState) {
  outcome_ = std::move(outcome);
  return false;
}

namespace {

/// Whether how many moduli the object needs is asked without being told to. Where it is held, and bends and swings, it
/// shows where it is how stiff. Under impacts errors of the contact would be taken for that, and a motion that was
/// tracked bends where the tracker bent it.
bool shows_where_it_is_stiff(const RecordedCapture& r) {
  const Scene& scene = r.capture.scene;
  return !r.followed && !scene.fixed.empty() && scene.led.empty() && !scene.is_touched() && !scene.timing.is_static &&
         r.capture.markers.empty() && (!r.capture.clouds.empty() || !r.capture.depth.empty());
}

bool looks_for_fields(const std::vector<RecordedCapture>& recordings, const FitOptions& options) {
  if (!named_moduli(recordings.front().capture.scene).empty()) return false;
  if (options.control_points != FitOptions::unsaid) return options.control_points == FitOptions::automatic;
  return !options.parameters.contains("youngs_modulus") && !options.law_of_motion() && options.scan_points == 0 &&
         std::ranges::all_of(recordings, shows_where_it_is_stiff);
}

}  // namespace

std::unique_ptr<PassPlanner> planner_of_points(std::vector<RecordedCapture> recordings, const FitOptions& options,
                                               FitState resume, std::shared_ptr<ProcessGroup> processes) {
  if (looks_for_fields(recordings, options))
    return std::make_unique<FieldChoice>(std::move(recordings), options, std::move(resume), std::move(processes));
  FitOptions given = options;
  if (given.control_points == FitOptions::automatic) given.control_points = 1;  // the capture names the field
  if (ExplainedSpan::suits(recordings, given))
    return std::make_unique<ExplainedSpan>(std::move(recordings), given, std::move(resume));
  return std::make_unique<OnePass>(std::move(recordings), given, std::move(resume.pass));
}

}  // namespace pliant
