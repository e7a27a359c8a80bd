#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "estimation/fit.hpp"

namespace pliant {

/// One fit of a batch: a recording, by choices, by a program. It leaves its files in the folder `name` of the batch.
struct BatchJob {
  std::filesystem::path capture;  ///< folder of the recording
  std::string name;               ///< of its folder: the recording's and the first digits of the key
  std::string key;                ///< SHA-256 of what was recorded, the choices and the program: 64 digits
};

/// How a job ended; `job.json` of its folder.
struct BatchStatus {
  enum class State { Converged, NotConverged, Failed, TimedOut };
  std::string key;
  State state = State::Failed;
  std::string reason;  ///< why, in words; empty where it converged
  bool operator==(const BatchStatus&) const = default;
};

/// Name of a state in files: "converged", "not converged", "failed", "timed out".
const char* name_of(BatchStatus::State state);

/// Folders with a capture.toml that patterns name: a folder, or one whose last parts hold `*` or `?`, such as
/// "recordings/*". Sorted, each once. Throws InputError for a pattern that names none.
std::vector<std::filesystem::path> captures_of(const std::vector<std::string>& patterns);

/// Jobs of recordings in the order of their keys. A recording that is wrong has one too: what is wrong is found when it
/// is run. The key holds the capture.toml and the names and sizes of all files in its folder, the choices that are
/// written to `fit.toml`, and `program` (version and commit).
std::vector<BatchJob> batch_jobs(const std::vector<std::filesystem::path>& captures, const FitOptions& options,
                                 const std::string& program);

/// How a job ended, where it did: nothing where `job.json` is not there, is damaged or belongs to another key.
std::optional<BatchStatus> read_status(const std::filesystem::path& batch, const BatchJob& job);
/// Throws InputError where it cannot be written.
void write_status(const std::filesystem::path& batch, const BatchJob& job, const BatchStatus& status);

}  // namespace pliant
