#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/parallel.hpp"
#include "base/process_group.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "estimation/fit_config.hpp"
#include "gradient_check.hpp"
#include "output/fit_job.hpp"
#include "output/press_output.hpp"
#include "report/report.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<std::string> captures;
  std::string out, config, held_out;
  std::vector<std::string> settings;
  int threads = 0, refine = 0;
  std::string budget;
  bool resume = false, profile = false, check_gradient = false;
};

/// Lines for people on stderr.
class Screen {
 public:
  void line(const std::string& text) {
    clear_live();
    std::fprintf(stderr, "%s\n", text.c_str());
  }
  /// Replaces the last live line on a terminal; elsewhere an ordinary line.
  void live(const std::string& text) {
    if (!terminal_) return line(text);
    std::fprintf(stderr, "\r\033[K%s", text.c_str());
    std::fflush(stderr);
    is_live_ = true;
  }
  void clear_live() {
    if (is_live_) std::fprintf(stderr, "\n");
    is_live_ = false;
  }

 private:
  bool terminal_ = ::isatty(STDERR_FILENO) != 0, is_live_ = false;
};

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
  if (!r.error.surface_rms && !r.error.marker_rms) return;  // of curves alone, which have lines of their own
  std::cout << "  " << what << r.name << ": ";
  if (r.error.surface_rms) std::cout << 1e3 * *r.error.surface_rms << " mm rms of the surface ";
  if (r.error.marker_rms) std::cout << 1e3 * *r.error.marker_rms << " mm rms of the markers ";
  std::cout << "\n";
}

void print_agreement(const Result& result, const FitOutcome& outcome, double seconds) {
  const auto print_tests = [](const PressScene& scene, const std::vector<PressPrediction>& predictions) {
    for (const StaticError& press : press_errors(scene, predictions))
      if (press.role == "test") std::cout << "  " << press_sentence(press) << "\n";
  };
  if (outcome.law) {
    print_tests(*outcome.law->scene, outcome.law->predictions);
    for (const TestedObject& other : outcome.law->others) print_tests(*other.scene, other.predictions);
  }
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

/// Where the time went, by activity and by stage.
void print_profile(const TimeResult& time) {
  double all = 0.0;
  for (const ActivityTime& a : time.activities) all += a.seconds;
  std::printf("Where threads were busy, %.1f s in all:\n", all);
  for (const ActivityTime& a : time.activities)
    std::printf("  %-18s %9.2f s %5.1f %%  %10lld times\n", a.name.c_str(), a.seconds, 100.0 * a.seconds / all,
                a.count);
  std::printf("Stages, of wall time; those of several starts run side by side:\n");
  for (const StageTime& s : time.stages)
    std::printf("  %-18s %9.2f s  start %d, %3d iterations, %6d elements\n", s.name.c_str(), s.seconds, s.start + 1,
                s.iterations, s.elements);
}

/// Says how to go on with an interrupted fit.
int ended(const FitJobOutcome& done, const std::string& words, const std::string& out) {
  if (done.result && done.outcome.interrupted)
    std::cout << "Interrupted: this is the best so far. Go on with: pliant fit " << words << " --out " << out
              << " --resume\n";
  if (done.outcome.interrupted) return WasInterrupted;
  return done.outcome.evaluation.succeeded && done.outcome.converged ? Fine : NotConverged;
}

/// Processes of one machine share out its processors where the user does not say how many each takes.
int threads_of(const Arguments& arguments, Communicator& processes) {
  if (arguments.threads > 0 || processes.size() == 1) return arguments.threads;
  return fair_threads(processes);
}

std::string words_of(const ProcessGroup& processes, int started, std::size_t recordings, int threads) {
  std::string text = std::to_string(processes.size()) + " processes share out " + std::to_string(recordings) +
                     " recordings; this one with " + std::to_string(threads) + (threads == 1 ? " thread" : " threads");
  if (const int idle = started - processes.size(); idle > 0)
    text += "; " + std::to_string(idle) + " more " + (idle == 1 ? "has" : "have") + " nothing to do";
  return text;
}

/// @param started  processes that were started together, with those that have nothing to do
int run_fit(const Arguments& arguments, const std::shared_ptr<Communicator>& communicator, int started) {
  const auto processes = std::make_shared<ProcessGroup>(communicator, [] { return is_interrupted(); });
  FitJob job;
  JobRecordings recordings;
  (void)processes->gather("captures", [&] {
    job.options = read_options(arguments);
    job.captures.assign(arguments.captures.begin(), arguments.captures.end());
    if (!arguments.held_out.empty()) job.held_out = arguments.held_out;
    job.out = arguments.out, job.resume = arguments.resume, job.profile = arguments.profile;
    job.version = PLIANT_VERSION, job.commit = PLIANT_COMMIT;
    recordings = read_recordings(job);
    return std::string();
  });
  const int most_threads = threads_of(arguments, *communicator);
  std::optional<ThreadLimit> threads;
  if (most_threads > 0) threads.emplace(most_threads);
  if (arguments.check_gradient)
    return run_gradient_check(std::move(recordings.recordings), job.options, job.out, processes);
  Screen screen;
  if (processes->is_first() && started > 1)
    screen.line(words_of(*processes, started, arguments.captures.size(), most_threads));
  FitWatch watch;
  watch.processes = processes;
  watch.on_line = [&](const std::string& line) { screen.line(line); };
  watch.on_event = [&](const FitEvent&, const std::string& line) { screen.live(line); };
  watch.progress = [&](const char* what, int count, int total) {
    screen.clear_live();
    show_progress(what, count, total);
  };
  const std::string words = recordings.words;
  const FitJobOutcome done = run_fit_job(job, std::move(recordings), watch);
  screen.clear_live();
  if (done.result) print_result(*done.result, done.outcome, job.out, done.seconds);
  if (done.result && job.profile) print_profile(done.result->time);
  return ended(done, words, arguments.out);
}

/// The end of one of several processes: what one of them alone could not do ends all of them, and what all could not do
/// is told once.
int end_together(Communicator& all, const std::function<int()>& run_own) {
  constexpr std::chrono::seconds patience{3};  // for the others to fail alike
  int exit_code = Fine;
  try {
    exit_code = run_own();
  } catch (...) {
    const Failure failure = failure_at_hand();
    const auto codes = all.end(failure.exit_code, patience);
    const bool is_told_by_first = all.rank() > 0 && codes && codes->front() != Fine;
    if (!is_told_by_first)
      std::cerr << (all.rank() > 0 ? "process " + std::to_string(all.rank() + 1) + ": " : "") << failure.message
                << std::endl;
    if (!codes) all.abort(failure.exit_code);
    return failure.exit_code;
  }
  (void)all.end(exit_code);
  return exit_code;
}

int run(const Arguments& arguments) {
  if (const Launch launch = launch_of_environment(); launch.size > 1 && launch.rank > 0 && !has_mpi())
    return Fine;  // the first one says what is wrong
  const std::shared_ptr<Communicator> all = launched_processes();
  if (all->size() == 1) return run_fit(arguments, all, 1);
  stop_on_termination();
  const std::shared_ptr<Communicator> working = all->first(std::min(all->size(), int(arguments.captures.size())));
  return end_together(*all, [&] { return working ? run_fit(arguments, working, all->size()) : int(Fine); });
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
              "a recording that takes no part in the fit; its prediction error is reported in the result")
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
              "does; counted in steps, so that a busy machine gives the same answer, and 10 % slower where the mesh is "
              "not what contributes most; 0: none")
      .type_name("MINUTES");
  command
      .option("--threads", arguments->threads,
              "most threads to use; all processors where left out, divided among the processes that mpirun starts on a "
              "machine")
      .positive();
  command.flag("--resume", arguments->resume, "go on with the interrupted fit in DIR");
  command.flag("--profile", arguments->profile, "tell where the time went, also in result.json");
  command.flag("--check-gradient", arguments->check_gradient,
               "instead of fitting compare the objective's gradient at the start by tangents, by the adjoint and by "
               "central differences; fails where they disagree");
  command.footer(key_help());
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
