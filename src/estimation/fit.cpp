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
  const int recordings = int(outcome.recordings.size());
  const bool differ = !tests || recordings > 2;  // one specimen under tests has no parts of a motion
  outcome.uncertainty = uncertainty_of(outcome.evaluation, shifts, floor, differ ? recordings : 0);
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
    const bool density_of_another = p.role == Role::Inertia && p.name != "density";
    if (!is_of_object(p) || density_of_another) continue;
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

/// Whether static tests are all that there is to fit.
/// Throws InputError where a motion is held out of them.
bool tests_alone(const std::vector<RecordedCapture>& recordings, const std::optional<RecordedCapture>& held_out) {
  if (!std::ranges::all_of(recordings, is_of_static_tests, &RecordedCapture::capture)) return false;
  if (held_out && !is_of_static_tests(held_out->capture))
    throw InputError({{held_out->capture.file},
                      "a motion, held out of a fit of static tests",
                      "static tests of the same material",
                      "`pliant evaluate MODEL CAPTURE` says how well the fitted model predicts a motion"});
  return true;
}

FitOutcome fit_all(std::vector<RecordedCapture> recordings, const FitOptions& options, const FitMonitor& monitor,
                   FitState resume, std::optional<RecordedCapture> held_out) {
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{}, wrong, "", "see `pliant fit --help`"});
  if (recordings.empty()) throw InputError({{}, "no recording was given", "one or several", ""});
  if (tests_alone(recordings, held_out)) {
    if (monitor.processes && !monitor.processes->is_alone())
      throw InputError({{recordings.front().capture.file},
                        "static tests alone, and " + std::to_string(monitor.processes->size()) + " processes",
                        "one process, whose threads solve the tests side by side",
                        "start `pliant fit` by itself; `--threads` says how many processors it takes"});
    std::vector<const Capture*> captures;
    for (const RecordedCapture& r : recordings) captures.push_back(&r.capture);
    return fit_presses(captures, options, monitor, std::move(resume), held_out ? &held_out->capture : nullptr);
  }
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

}  // namespace

FitOutcome fit(std::vector<RecordedCapture> recordings, const FitOptions& options, const FitMonitor& monitor,
               FitState resume, std::optional<RecordedCapture> held_out) {
  FitOutcome outcome = fit_all(std::move(recordings), options, monitor, std::move(resume), std::move(held_out));
  outcome.given = options;
  outcome.used.parameters = options.parameters;            // passes begin elsewhere, from one another
  static_cast<JudgementOptions&>(outcome.used) = options;  // and only the last one is judged
  outcome.used.tracking = outcome.tracking && outcome.tracking->keeps_loop ? TrackingUse::Loop : TrackingUse::Off;
  return outcome;
}

}  // namespace pliant
