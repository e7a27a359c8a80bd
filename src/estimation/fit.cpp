#include "estimation/fit.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/fit_pass.hpp"
#include "estimation/followed.hpp"
#include "estimation/press_fit.hpp"
#include "estimation/press_scene.hpp"
#include "estimation/tracking_loop.hpp"

namespace pliant {

void add_uncertainty(FitOutcome& outcome, const std::vector<ModelShift>& shifts, const VectorX& floor,
                     const std::optional<std::vector<Agreement>>& tests) {
  outcome.uncertainty = uncertainty_of(outcome.evaluation, shifts, floor, int(outcome.recordings.size()));
  outcome.covariance = outcome.uncertainty.covariance;
  outcome.std = outcome.uncertainty.std;
  outcome.verdict = tests ? verdict_of(*tests, outcome.uncertainty, outcome.parameters)
                          : verdict_of(outcome.evaluation, outcome.uncertainty, outcome.parameters);
  const VectorX inverse = outcome.std.cwiseMax(1e-300).cwiseInverse();
  outcome.correlation = inverse.asDiagonal() * outcome.covariance * inverse.asDiagonal();
}

namespace {

/// How well a fitted material predicts a recording that was kept out: only its own start, planes and sensors are
/// estimated, from its own observations.
OnePass pass_of_held_out(RecordedCapture held_out, const FitOutcome& fitted, const FitOptions& options) {
  FitOptions fixed = options;
  fixed.tracking = TrackingUse::Off;
  fixed.cells = fitted.cells, fixed.refine = 1, fixed.alternatives = false;
  fixed.control_points = fitted.recordings.front().discretisation.body->modulus.controls;
  for (const Parameter& p : fitted.parameters.parameters()) {
    if (!is_of_object(p)) continue;
    FitOptions::Override& change = fixed.parameters[p.name];
    change.estimated = false;
    if (p.name != "density" || p.estimated) change.start = VectorX::Constant(1, fitted.theta[p.at]);
  }
  return {{std::move(held_out)}, fixed, {}};
}

std::unique_ptr<PassPlanner> planner_of(std::vector<RecordedCapture> recordings, const FitOptions& options,
                                        const FitMonitor& monitor, FitState resume) {
  if (tracks(recordings, options))
    return planner_of_tracking(std::move(recordings), options, monitor, std::move(resume));
  return planner_of_points(std::move(recordings), options, std::move(resume), monitor.processes);
}

/// The capture whose presses are all that there is to fit; null where more than presses is fitted.
/// Throws InputError where they stand beside what they cannot be fitted with.
const Capture* presses_alone(const std::vector<RecordedCapture>& recordings,
                             const std::optional<RecordedCapture>& held_out) {
  const auto it = std::ranges::find_if(recordings, is_of_static_tests, &RecordedCapture::capture);
  if (it == recordings.end()) return nullptr;
  const auto refuse = [&](const char* what, const char* advice) {
    throw InputError({{it->capture.file}, what, "a fit of one capture's presses", advice});
  };
  if (recordings.size() > 1) refuse("presses beside other recordings", "put all presses into one capture");
  if (held_out) refuse("presses and --hold-out", "give a press role = \"test\"");
  return &it->capture;
}

}  // namespace

FitOutcome fit(std::vector<RecordedCapture> recordings, const FitOptions& options, const FitMonitor& monitor,
               FitState resume, std::optional<RecordedCapture> held_out) {
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{}, wrong, "", "see `pliant fit --help`"});
  if (recordings.empty()) throw InputError({{}, "no recording was given", "one or several", ""});
  if (const Capture* capture = presses_alone(recordings, held_out))
    return fit_presses(*capture, options, monitor, std::move(resume));
  const bool has_presses =
      std::ranges::any_of(recordings, [](const RecordedCapture& r) { return !r.capture.presses.empty(); });
  const auto stops = [&] { return monitor.agrees_to_stop(); };
  const auto look_before_release = [&](RecordedCapture& r) {
    const std::optional<RegisteredPose> found = registered_pose(r, options, stops);
    if (!found) return;
    r.pose = found->points;
    r.capture.scene.initial.pulled_at = found->pulled_at;
  };
  for (RecordedCapture& r : recordings) look_before_release(r);
  if (held_out) look_before_release(*held_out);
  FitOutcome outcome = carry_out(*planner_of(std::move(recordings), options, monitor, std::move(resume)), monitor);
  for (std::string& note : unused_choices(options, true, has_presses)) outcome.notes.push_back(std::move(note));
  if (held_out && outcome.evaluation.succeeded && !outcome.interrupted) {
    FitMonitor of_another_fit = monitor;
    of_another_fit.on_state = {};
    outcome.held_out = {held_out->capture.name, held_out->capture.sha256, {}};
    OnePass pass = pass_of_held_out(std::move(*held_out), outcome, options);
    outcome.held_out->evaluation = carry_out(pass, of_another_fit).evaluation;
  }
  return outcome;
}

}  // namespace pliant
