#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimation/fit.hpp"
#include "model/result.hpp"

namespace pliant {

/// A fit of recordings on disk that leaves its files in a folder.
struct FitJob {
  std::vector<std::filesystem::path> captures;    ///< folders, or their capture.toml; of one object
  std::optional<std::filesystem::path> held_out;  ///< a recording that takes no part, and is predicted
  std::filesystem::path out;                      ///< folder for the result
  FitOptions options;
  bool resume = false;          ///< go on with the interrupted fit in the folder
  bool profile = false;         ///< the result reports where the time went
  std::string version, commit;  ///< of the program, for the result
};

/// The captures of a job, read and validated.
struct JobRecordings {
  std::vector<RecordedCapture> recordings;
  std::optional<RecordedCapture> held_out;
  std::string words;        ///< the captures' paths as the user named them
  std::string fingerprint;  ///< of what was recorded
};
/// Throws InputError where a capture is wrong.
JobRecordings read_recordings(const FitJob& job);

/// Watches a job. All members may be empty.
struct FitWatch {
  std::function<void(const std::string& line)> on_line;                          ///< something worth knowing
  std::function<void(const FitEvent& event, const std::string& line)> on_event;  ///< a step, and the same in words
  std::function<void(const char* what, int done, int total)> progress;
  std::function<bool()> interrupted;  ///< not with `processes`, which ask it themselves
  /// Processes that run the job together (`FitMonitor`), each called with the same job: the first one alone tells,
  /// writes, and has a result; null: this one alone.
  std::shared_ptr<ProcessGroup> processes;
};

struct FitJobOutcome {
  FitOutcome outcome;
  /// Nothing: it ended without an estimate, and no files but its log and its state; or another process has it.
  std::optional<Result> result;
  double seconds = 0.0;
};

/// Runs it, and writes the output folder of docs/formats.md, section 2: also `fit.toml` at once, `state.json` as long
/// as it is under way or was interrupted, and `log.txt`. Throws InputError where a capture or the state to resume
/// cannot be used, Interrupted where it was stopped before the fit began, std::runtime_error where processes that
/// should run it together were given different jobs.
FitJobOutcome run_fit_job(const FitJob& job, const FitWatch& watch = {});
FitJobOutcome run_fit_job(const FitJob& job, JobRecordings recordings, const FitWatch& watch = {});

/// A number with its unit, and a prefix of that where it reads better.
std::string with_prefix(double value, const std::string& unit);

}  // namespace pliant
