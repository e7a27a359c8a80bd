#pragma once

#include <filesystem>
#include <vector>

#include "batch/job_list.hpp"

namespace pliant {

/// What all jobs of a batch came to, told from their folders.
struct BatchSummary {
  int jobs = 0, ended = 0, converged = 0;
};

/// Writes `results.csv` and `results.html`: a row a job, by its recording's name: state, verdict, and each parameter
/// with its unit, deviation and 90 % interval. The same bytes whoever ran the jobs, and in which parts. Throws
/// InputError where they cannot be written.
BatchSummary write_batch_table(const std::filesystem::path& batch, const std::vector<BatchJob>& jobs);

}  // namespace pliant
