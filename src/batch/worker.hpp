#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "batch/job_list.hpp"

namespace pliant {

/// How jobs are run.
struct WorkerOptions {
  std::filesystem::path batch;                  ///< folder of the batch
  std::vector<std::string> program;             ///< words before "fit": the program
  std::vector<std::string> words;               ///< of the fit beyond capture and folder: choices
  int workers = 1;                              ///< fits at once
  int threads = 0;                              ///< of each; 0: all processors divided among them
  std::optional<std::chrono::seconds> timeout;  ///< of one fit; after it the fit is asked to end
  std::function<bool()> interrupted;            ///< asked a few times a second; may be empty
  /// Told of each job that ended here, and how many of all have.
  std::function<void(const BatchJob& job, const BatchStatus& status)> on_end;
};

/// Runs the jobs that have no end yet and that no other process holds, each in a process of its own, until none is left
/// that it could take. An interrupted or killed worker leaves its jobs to others, who go on from where they stood.
/// Returns how many jobs ended here. Throws InputError where the folder cannot be written.
int work(const std::vector<BatchJob>& jobs, const WorkerOptions& options);

}  // namespace pliant
