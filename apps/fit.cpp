#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/parallel.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "estimation/fit_config.hpp"
#include "estimation/fit_state.hpp"
#include "estimation/press_scene.hpp"
#include "gradient_check.hpp"
#include "output/fit_output.hpp"
#include "output/press_output.hpp"
#include "report/report.hpp"
#include "scan/scan_pose.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct Arguments {
  std::vector<std::string> captures;
  std::string out, config, held_out;
  std::vector<std::string> settings;
  int threads = 0, refine = 0;
  std::string budget;
  bool resume = false, check_gradient = false;
};

/// Lines for people on stderr, kept for log.txt.
class Log {
 public:
  void line(const std::string& text) {
    clear_live();
    std::fprintf(stderr, "%s\n", text.c_str());
    text_ += text + "\n";
  }
  /// Replaces the last live line on a terminal; elsewhere an ordinary line.
  void live(const std::string& text) {
    if (!terminal_) return line(text);
    text_ += text + "\n";
    std::fprintf(stderr, "\r\033[K%s", text.c_str());
    std::fflush(stderr);
    is_live_ = true;
  }
  void clear_live() {
    if (is_live_) std::fprintf(stderr, "\n");
    is_live_ = false;
  }
  const std::string& text() const { return text_; }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) != 0, is_live_ = false;
  std::string text_;
};

std::string with_prefix(double value, const char* unit) {
  char text[48];
  const double size = std::abs(value);
  const bool pascal = std::string(unit) == "Pa", second = std::string(unit) == "s";
  if (pascal && size >= 1e6)
    std::snprintf(text, sizeof text, "%.4g MPa", value * 1e-6);
  else if (pascal && size >= 1e4)
    std::snprintf(text, sizeof text, "%.4g kPa", value * 1e-3);
  else if (second && size < 0.1)
    std::snprintf(text, sizeof text, "%.3g ms", value * 1e3);
  else
    std::snprintf(text, sizeof text, "%.4g%s%s", value, *unit && std::string(unit) != "1" ? " " : "",
                  std::string(unit) == "1" ? "" : unit);
  return text;
}

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
  const double rms = event.surface_rms > 0.0 ? event.surface_rms : event.marker_rms;
  char head[160];
  if (event.kind == StageKind::Sample)
    std::snprintf(head, sizeof head, "%-18s %2d iterations  rms %6.2f mm", event.stage.c_str(), event.iteration,
                  1e3 * rms);
  else if (event.kind == StageKind::Law)
    std::snprintf(head, sizeof head, "%-18s iteration %2d  cost %10.4g  rms %6.2f mm", event.stage.c_str(),
                  event.iteration, event.cost, 1e3 * rms);
  else
    std::snprintf(head, sizeof head, "%-15s start %d  iteration %2d  cost %10.4g  rms %6.2f mm", event.stage.c_str(),
                  event.start + 1, event.iteration, event.cost, 1e3 * rms);
  std::string text = head + ("  E " + with_prefix(event.youngs_modulus, "Pa")) + describe_others(event);
  if (event.fraction_done > 0.02) {
    char left[40];
    std::snprintf(left, sizeof left, "  about %.0f s left",
                  seconds * (1.0 - event.fraction_done) / event.fraction_done);
    text += left;
  }
  return text;
}

FitOptions read_options(const Arguments& arguments) {
  FitOptions options;
  if (!arguments.config.empty()) read_fit_options(arguments.config, options);
  for (const std::string& assignment : arguments.settings) set_fit_option(options, assignment);
  if (arguments.refine > 0) options.refine = arguments.refine;
  if (!arguments.budget.empty()) set_fit_option(options, "budget=" + arguments.budget);
  if (const std::string wrong = options.validate(); !wrong.empty())
    throw InputError({{arguments.config}, wrong, "", "see `pliant fit --help`"});
  return options;
}

void print_parameter(const ParameterResult& p) {
  if (const auto* value = std::get_if<double>(&p.value)) {
    std::optional<double> std;
    if (p.std) std = std::get<double>(*p.std);
    std::cout << "  " << spoken_name(p.name) << ": " << value_with_uncertainty(*value, std, p.unit);
    if (p.extrapolated) std::cout << "; " << discretisation_words(p);
    std::cout << "\n";
  } else if (const auto* vector = std::get_if<Vector3>(&p.value)) {
    std::cout << "  " << spoken_name(p.name) << ": " << vector->transpose() << " " << p.unit << "\n";
  } else if (const auto* plane = std::get_if<PlaneValue>(&p.value)) {
    std::cout << "  " << spoken_name(p.name) << ": through " << plane->point.transpose() << " m, normal "
              << plane->normal.transpose() << "\n";
  }
}

void print_error(const RecordingResult& r, const char* what) {
  std::cout << "  " << what << r.name << ": ";
  if (r.error.surface_rms) std::cout << 1e3 * *r.error.surface_rms << " mm rms of the surface ";
  if (r.error.marker_rms) std::cout << 1e3 * *r.error.marker_rms << " mm rms of the markers ";
  std::cout << "\n";
}

void print_agreement(const Result& result, const FitOutcome& outcome, double seconds) {
  if (outcome.law)
    for (const StaticError& press : press_errors(*outcome.law->scene, outcome.law->predictions))
      if (press.role == "test") std::cout << "  " << press_sentence(press) << "\n";
  for (const CurvePrediction& curve : result.curves) std::cout << "  " << curve_sentence(curve) << "\n";
  char line[200] = "  ";
  if (outcome.law && result.error.marker_rms)
    std::snprintf(line, sizeof line, "  markers %.2f mm rms over what was fitted; ", 1e3 * *result.error.marker_rms);
  else if (!outcome.law)
    std::snprintf(line, sizeof line, "  surface error %.2f mm rms over %lld points; ",
                  1e3 * result.error.surface_rms.value_or(0.0), result.error.points);
  std::cout << line;
  std::snprintf(line, sizeof line, "%s after %.0f s\n", outcome.reason.c_str(), seconds);
  std::cout << line;
  for (const RecordingResult& r : result.recordings) print_error(r, "");
  if (result.held_out) print_error(*result.held_out, "held out, ");
}

void print_result(const Result& result, const FitOutcome& outcome, const fs::path& out, double seconds) {
  std::cout << result.capture.name << (result.verdict.empty() ? "" : ": " + result.verdict) << "\n";
  for (const std::string& reason : result.reasons) std::cout << "  " << reason << "\n";
  for (const ParameterResult& p : result.parameters)
    if (p.estimated) print_parameter(p);
  print_agreement(result, outcome, seconds);
  if (const std::string most = largest_share_sentence(result); !most.empty()) std::cout << "  " << most << "\n";
  for (const std::string& note : result.notes) std::cout << "  note: " << note << "\n";
  const std::string model = (out / "model.toml").string();
  std::cout << "Look at " << (out / "report.html").string();
  if (is_file(model))
    std::cout << (outcome.law ? "; press it with: pliant press " + model + " --contact X,Y,Z --force X,Y,Z --out DIR"
                              : "; simulate with: pliant simulate " + model + " --out DIR");
  std::cout << "\n";
}

/// Where the fit in the output folder begins: where an interrupted one was, or anew.
FitState begun(const Arguments& arguments, const FitOptions& options, const std::string& key, Log& log) {
  const fs::path out = arguments.out, state_file = out / "state.json";
  FitState state;
  if (arguments.resume) {
    if (!is_file(state_file))
      throw InputError({{state_file},
                        "there is no interrupted fit to resume",
                        "the state that an interrupted fit leaves",
                        "leave out --resume"});
    state = read_fit_state(state_file, key);
    log.line("resuming the fit in " + out.string());
  } else {
    remove_file(state_file);
  }
  write_file(out / "fit.toml", to_toml(options));
  return state;
}

int ended_without_result(const std::string& reason, bool interrupted, const fs::path& out, Log& log) {
  log.line("the fit ended without a result: " + reason);
  write_file(out / "log.txt", log.text());
  return interrupted ? WasInterrupted : NotConverged;
}

/// Says how to go on with an interrupted fit, or drops its state.
int ended(bool converged, bool interrupted, const std::string& words, const fs::path& out) {
  if (interrupted) {
    std::cout << "Interrupted: this is the best so far. Go on with: pliant fit " << words << " --out " << out.string()
              << " --resume\n";
    return WasInterrupted;
  }
  remove_file(out / "state.json");
  return converged ? Fine : NotConverged;
}

int run(const Arguments& arguments) {
  const auto begin = Clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(Clock::now() - begin).count(); };
  const FitOptions options = read_options(arguments);
  std::vector<RecordedCapture> recordings;
  std::optional<RecordedCapture> held_out;
  std::string words, fingerprint;
  for (const std::string& path : arguments.captures) {
    recordings.push_back({read_capture(path), {}});
    words += (words.empty() ? "" : " ") + path;
    fingerprint += recordings.back().capture.sha256 + "\n";
  }
  if (!arguments.held_out.empty()) held_out = RecordedCapture{read_capture(arguments.held_out), {}};
  const fs::path out = arguments.out;
  make_folder(out);

  std::optional<ThreadLimit> threads;
  if (arguments.threads > 0) threads.emplace(arguments.threads);

  Log log;
  log.line("pliant " PLIANT_VERSION " fit " + words);
  if (arguments.check_gradient) return run_gradient_check(std::move(recordings), options, out);
  ObserveOptions observe_options;
  observe_options.max_points_per_frame = options.points_per_frame;
  const auto read = [&](RecordedCapture& recording) {
    if (is_of_static_tests(recording.capture)) return;
    std::optional<ScanPose> pose;
    recording.observed = observe_placed(
        recording.capture, observe_options, [](int done, int total) { show_progress("read", done, total); }, &pose);
    if (pose)
      log.line(formatted("the scan was placed: %.2f mm rms, outlines overlap by %.0f %%", 1e3 * pose->rms,
                         100.0 * pose->overlap));
    if (pose && pose->runner_up > 0.0 && pose->runner_up < 1.3)
      log.line("note: another pose of the scan fits nearly as well; `pliant place` draws the one that was taken");
    stop_if_interrupted();
  };
  for (RecordedCapture& recording : recordings) read(recording);
  if (held_out) read(*held_out);

  const std::string key = fingerprint + to_toml(options);
  const fs::path state_file = out / "state.json";
  FitState state = begun(arguments, options, key, log);

  FitMonitor monitor;
  monitor.on_event = [&](const FitEvent& event) { log.live(describe(event, seconds())); };
  monitor.on_state = [&](const FitState& s) { write_fit_state(state_file, s, key); };
  monitor.interrupted = [] { return is_interrupted(); };
  const FitOutcome outcome = fit(recordings, options, monitor, std::move(state), std::move(held_out));
  log.clear_live();
  if (outcome.interrupted && !is_file(state_file)) write_fit_state(state_file, {}, key);  // nothing was done yet
  if (!outcome.evaluation.succeeded) return ended_without_result(outcome.reason, outcome.interrupted, out, log);
  const RunFacts facts{PLIANT_VERSION, PLIANT_COMMIT, words, seconds()};
  const Result result = make_result(recordings, outcome, facts);
  write_fit_output(out, recordings, outcome, result, facts, show_progress);
  log.line(outcome.reason);
  write_file(out / "log.txt", log.text());
  print_result(result, outcome, out, seconds());
  return ended(outcome.converged, outcome.interrupted, words, out);
}

std::string key_help() {
  std::ostringstream text;
  text << "Keys of --set and --config:\n";
  for (const FitKey& k : fit_keys()) {
    text << "  " << k.name << " = " << k.standard << "   " << k.sentence;
    if (!k.range.empty()) text << " (" << k.range << (k.unit.empty() ? "" : " " + k.unit) << ")";
    text << "\n";
  }
  text << parameter_key_help() << "\n\nExamples:\n"
       << "  pliant fit recordings/bear --out out/bear\n"
       << "  pliant fit recordings/bear --out out/bear --set cells=16 --set poissons_ratio=0.3 --set "
          "poissons_ratio.estimate=false\n"
       << "Ctrl-C leaves the best result so far; --resume goes on from there.";
  return text.str();
}

}  // namespace

void add_fit(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("fit", "Estimate stiffness, damping and what else a recording leaves unknown");
  command
      .option("captures", arguments->captures,
              "recordings of one object: folders with capture.toml in them; they share its material")
      .required()
      .type_name("CAPTURE...");
  command
      .option("--hold-out", arguments->held_out,
              "a recording that takes no part in the fit; how well it is predicted stands in the result")
      .type_name("CAPTURE");
  command.option("--out,-o", arguments->out, "folder for the result").required().type_name("DIR");
  command.option("--config", arguments->config, "choices (TOML); none is needed").type_name("FILE");
  command.option("--set", arguments->settings, "one choice; may be given many times")
      .type_name("KEY=VALUE")
      .one_value_a_use();
  command
      .option("--refine", arguments->refine,
              "make the estimate at so many resolutions of mesh and time step (2, or 3: several times the work), "
              "take it to the limit, and state what error is left")
      .range(1, 3)
      .type_name("N");
  command
      .option("--budget", arguments->budget,
              "about as long as the fit may take on two cores of a laptop with repetitions on finer meshes, which are "
              "made as long as the mesh contributes to the uncertainty of a modulus more than half of what the noise "
              "does; counted in steps, so that a busy machine gives the same answer; 0: none")
      .type_name("MINUTES");
  command.option("--threads", arguments->threads, "most threads to use; all processors where left out").positive();
  command.flag("--resume", arguments->resume, "go on with the interrupted fit in DIR");
  command.flag("--check-gradient", arguments->check_gradient,
               "instead of fitting compare the objective's gradient at the start by tangents, by the adjoint and by "
               "central differences; fails where they disagree");
  command.footer(key_help());
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
