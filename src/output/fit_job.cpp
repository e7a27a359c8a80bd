#include "output/fit_job.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/profile.hpp"
#include "base/sha256.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/fit_state.hpp"
#include "estimation/press_scene.hpp"
#include "output/fit_output.hpp"
#include "scan/scan_pose.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

/// Poisson's ratio and dampings, where the event's parameters have them.
std::string describe_others(const FitEvent& event) {
  const auto value = [&](const char* name) { return event.theta[event.layout->at(name)]; };
  const auto has = [&](const char* name) { return event.layout && event.layout->contains(name); };
  std::string text;
  if (has("poissons_ratio")) text += "  nu " + with_prefix(value("poissons_ratio"), "1");
  if (has("mass_damping") && has("stiffness_damping"))
    text +=
        "  damping " + with_prefix(value("mass_damping"), "1/s") + ", " + with_prefix(value("stiffness_damping"), "s");
  return text;
}

std::string describe(const FitEvent& event, double seconds) {
  const double rms = 1e3 * (event.surface_rms > 0.0 ? event.surface_rms : event.marker_rms);
  std::string text;
  if (event.kind == StageKind::Sample)
    text = fmt::format("{:<18} {:2} iterations  rms {:6.3g} mm", event.stage, event.iteration, rms);
  else if (event.kind == StageKind::Law)
    text = fmt::format("{:<18} iteration {:2}  cost {:10.4g}", event.stage, event.iteration, event.cost) +
           (rms > 0.0 ? fmt::format("  rms {:6.3g} mm", rms) : "");
  else
    text = fmt::format("{:<15} start {}  iteration {:2}  cost {:10.4g}  rms {:6.3g} mm", event.stage, event.start + 1,
                       event.iteration, event.cost, rms);
  text += "  E " + with_prefix(event.youngs_modulus, "Pa") + describe_others(event);
  if (event.fraction_done > 0.02)
    text += fmt::format("  about {:.0f} s left", seconds * (1.0 - event.fraction_done) / event.fraction_done);
  return text;
}

/// Reads what the sensors saw, with the scan placed first where its pose is unknown.
void observe_recording(RecordedCapture& recording, const FitOptions& options, const FitWatch& watch,
                       const ProcessGroup& processes, const std::function<void(const std::string&)>& say) {
  if (is_of_static_tests(recording.capture)) return;
  const Timed timed(Activity::Reading);
  ObserveOptions observe_options;
  observe_options.max_points_per_frame = options.points_per_frame;
  std::optional<ScanPose> pose;
  recording.observed = observe_placed(
      recording.capture, observe_options,
      [&](int done, int total) {
        if (watch.progress && processes.is_first()) watch.progress("read", done, total);
      },
      &pose);
  if (pose)
    say(fmt::format("the scan was placed: {:.3g} mm rms, outlines overlap by {:.0f} %", 1e3 * pose->rms,
                    100.0 * pose->overlap));
  if (pose && pose->runner_up > 0.0 && pose->runner_up < 1.3)
    say("note: another pose of the scan fits nearly as well; `pliant place` draws the one that was taken");
  if (processes.is_asked_to_stop()) throw Interrupted();
}

}  // namespace

std::string with_prefix(double value, const std::string& unit) {
  const double size = std::abs(value);
  if (unit == "Pa" && size >= 1e6) return fmt::format("{:.4g} MPa", value * 1e-6);
  if (unit == "Pa" && size >= 1e4) return fmt::format("{:.4g} kPa", value * 1e-3);
  if (unit == "s" && size < 0.1) return fmt::format("{:.3g} ms", value * 1e3);
  return fmt::format("{:.4g}{}{}", value, unit.empty() || unit == "1" ? "" : " ", unit == "1" ? "" : unit);
}

JobRecordings read_recordings(const FitJob& job) {
  JobRecordings read;
  for (const fs::path& path : job.captures) {
    read.recordings.push_back({read_capture(path), {}});
    read.words += (read.words.empty() ? "" : " ") + path.string();
    read.fingerprint += read.recordings.back().capture.sha256 + "\n";
  }
  if (job.held_out) read.held_out = RecordedCapture{read_capture(*job.held_out), {}};
  return read;
}

FitJobOutcome run_fit_job(const FitJob& job, const FitWatch& watch) {
  return run_fit_job(job, read_recordings(job), watch);
}

FitJobOutcome run_fit_job(const FitJob& job, JobRecordings all, const FitWatch& watch) {
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  Profile profile;
  std::optional<Profile::Recording> recording_profile;
  if (job.profile) recording_profile.emplace(profile);
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  const fs::path state_file = job.out / "state.json";
  const std::string key = all.fingerprint + to_toml(job.options);
  const std::shared_ptr<ProcessGroup> processes =
      watch.processes ? watch.processes
                      : std::make_shared<ProcessGroup>(std::make_shared<SingleProcess>(), watch.interrupted);
  const bool is_first = processes->is_first();

  std::string log;
  const auto say = [&](const std::string& line) {
    log += line + "\n";
    if (watch.on_line && is_first) watch.on_line(line);
  };
  say("pliant " + job.version + " fit " + all.words);
  (void)processes->of_first("the folder", [&] {
    make_folder(job.out);
    return std::string();
  });
  (void)processes->gather("recordings and choices " + sha256({job.version, job.commit, key}), [&] {
    for (RecordedCapture& recording : all.recordings) observe_recording(recording, job.options, watch, *processes, say);
    if (all.held_out) observe_recording(*all.held_out, job.options, watch, *processes, say);
    return std::string();
  });

  const std::string left = processes->of_first("the state that was left", [&] {
    if (job.resume && !is_file(state_file))
      throw InputError({{state_file},
                        "there is no interrupted fit to resume",
                        "the state that an interrupted fit leaves",
                        "begin the fit anew, without resuming"});
    std::string text;
    if (job.resume)
      text = read_file(state_file);
    else
      remove_file(state_file);
    write_file(job.out / "fit.toml", to_toml(job.options));
    return text;
  });
  FitState state;
  if (job.resume) {
    state = to_fit_state(left, state_file, key);
    say("resuming the fit in " + job.out.string());
  }

  FitMonitor monitor;
  if (is_first) {
    monitor.on_event = [&](const FitEvent& event) {
      const std::string line = describe(event, seconds());
      log += line + "\n";
      if (watch.on_event) watch.on_event(event, line);
    };
    monitor.on_state = [&](const FitState& s) { write_fit_state(state_file, s, key); };
  }
  monitor.processes = processes;
  FitJobOutcome done;
  done.outcome = fit(all.recordings, job.options, monitor, std::move(state), std::move(all.held_out));
  const FitOutcome& outcome = done.outcome;
  done.seconds = seconds();
  if (!is_first) return done;
  if (outcome.interrupted && !is_file(state_file)) write_fit_state(state_file, {}, key);  // nothing was done yet
  if (!outcome.evaluation.succeeded) {
    say("the fit ended without a result: " + outcome.reason);
  } else {
    const RunFacts facts{job.version, job.commit, all.words, seconds()};
    done.result = make_result(all.recordings, outcome, facts);
    {
      const Timed timed(Activity::Pictures);
      write_fit_output(job.out, all.recordings, outcome, *done.result, facts, watch.progress);
    }
    if (job.profile) {
      done.result->time.activities = profile.activities(), done.result->time.stages = profile.stages();
      write_result(job.out / "result.json", *done.result);
    }
    say(outcome.reason);
    if (!outcome.interrupted) remove_file(state_file);
  }
  write_file(job.out / "log.txt", log);
  done.seconds = seconds();
  return done;
}

}  // namespace pliant
