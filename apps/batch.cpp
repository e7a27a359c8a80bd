#include <fmt/format.h>

#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "base/error.hpp"
#include "batch/job_table.hpp"
#include "batch/worker.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "estimation/fit_config.hpp"
#include "jobs/processes.hpp"
#include "jobs/shards.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<std::string> captures, settings;
  std::string out, config, shard, timeout;
  int workers = 1, threads = 0;
  bool dry_run = false;
};

/// "90", "90s", "30m", "2h".
std::optional<std::chrono::seconds> duration_of(const std::string& text) {
  if (text.empty()) return std::nullopt;
  double number = 0.0;
  char unit = 's';
  int end = 0;
  const int read = std::sscanf(text.c_str(), "%lf%n%c%n", &number, &end, &unit, &end);
  const double seconds = unit == 's' ? 1.0 : unit == 'm' ? 60.0 : unit == 'h' ? 3600.0 : 0.0;
  if (read < 1 || std::size_t(end) != text.size() || !(number * seconds >= 1.0))
    throw InputError({{}, "--timeout " + text, "a time such as 90s, 30m or 2h", ""});
  return std::chrono::seconds(std::int64_t(number * seconds));
}

void say_jobs(const fs::path& batch, const std::vector<BatchJob>& jobs) {
  for (const BatchJob& job : jobs) {
    const auto status = read_status(batch, job);
    std::cout << fmt::format("{:<14} {:<40} {}\n", status ? name_of(status->state) : "to be run", job.name,
                             job.capture.string());
  }
}

int run(const Arguments& arguments) {
  FitOptions choices;
  if (!arguments.config.empty()) read_fit_options(arguments.config, choices);
  for (const std::string& assignment : arguments.settings) set_fit_option(choices, assignment);
  if (const std::string wrong = choices.validate(); !wrong.empty())
    throw InputError({{arguments.config}, wrong, "", "see `pliant fit --help`"});
  const Shard shard = shard_named(arguments.shard);
  const std::vector<BatchJob> jobs =
      batch_jobs(captures_of(arguments.captures), choices, PLIANT_VERSION " " PLIANT_COMMIT);
  const std::vector<BatchJob> own = shard_of(jobs, shard);
  if (arguments.dry_run) {
    say_jobs(arguments.out, own);
    return Fine;
  }
  WorkerOptions options;
  options.batch = arguments.out;
  options.program = own_program();
  if (!arguments.config.empty()) options.words = {"--config", arguments.config};
  for (const std::string& assignment : arguments.settings)
    options.words.insert(options.words.end(), {"--set", assignment});
  options.workers = arguments.workers, options.threads = arguments.threads;
  options.timeout = duration_of(arguments.timeout);
  options.interrupted = [] { return is_interrupted(); };
  int ended = 0;
  options.on_end = [&](const BatchJob& job, const BatchStatus& status) {
    std::cerr << fmt::format("{:3}: {:<14} {}{}\n", ++ended, name_of(status.state), job.name,
                             status.reason.empty() ? "" : ": " + status.reason);
  };
  (void)work(own, options);
  const BatchSummary summary = write_batch_table(arguments.out, jobs);
  std::cout << fmt::format("{} of {} recordings ended, {} converged; {}/results.csv and results.html\n", summary.ended,
                           summary.jobs, summary.converged, arguments.out);
  if (is_interrupted()) return WasInterrupted;
  if (summary.ended < summary.jobs)
    std::cout << "others are with other processes, or in other parts: run the same again to go on or to gather\n";
  return summary.converged == summary.jobs ? Fine : NotConverged;
}

}  // namespace

void add_batch(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("batch", "Fit many recordings, each on its own, on any number of machines");
  command.option("captures", arguments->captures, "folders with a capture.toml, or patterns in quotes: 'recordings/*'")
      .required()
      .type_name("CAPTURE...");
  command.option("--out,-o", arguments->out, "folder of the batch, which all machines share")
      .required()
      .type_name("DIR");
  command.option("--config", arguments->config, "choices of all fits (TOML)").type_name("FILE");
  command.option("--set", arguments->settings, "one choice of all fits; may be given many times")
      .type_name("KEY=VALUE")
      .one_value_a_use();
  command.option("--workers", arguments->workers, "fits at once on this machine").positive().type_name("N");
  command.option("--threads", arguments->threads, "of each fit; all processors divided among them where left out")
      .positive();
  command.option("--shard", arguments->shard, "this part of the recordings alone, such as 3/50")
      .type_name("PART/PARTS");
  command
      .option("--timeout", arguments->timeout, "of one fit, such as 30m: it is asked to end, and counts as timed out")
      .type_name("TIME");
  command.flag("--dry-run", arguments->dry_run, "say what would be run, and how what was run ended");
  command.footer(R"(Examples:
  pliant batch 'recordings/*' --out fits --workers 4
  pliant batch 'recordings/*' --out fits --shard $SLURM_ARRAY_TASK_ID/50

A job is a recording, the choices and this program: what ended is not run again, whoever asks. Processes that share the folder share
the work; one that is killed leaves its fits to the others after three minutes, who go on from where they stood. A recording that
fails stops no other. fits/results.csv and results.html have a row a recording.)");
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
