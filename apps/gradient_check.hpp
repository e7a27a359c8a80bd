#pragma once

#include <filesystem>
#include <vector>

#include "estimation/fit.hpp"

namespace pliant::apps {

/// `pliant fit --check-gradient`: prints how the gradient of the fit's objective at its start agrees with central
/// differences, and writes `gradient.csv` with every step size into the folder.
/// @param recordings  as read, nothing observed yet
/// @param processes   that evaluate the objective together; the first one alone prints and writes
/// @return  the program's exit code: `Fine`, or `NotConverged` where a derivative disagrees or cannot be evaluated
int run_gradient_check(std::vector<RecordedCapture> recordings, const FitOptions& options,
                       const std::filesystem::path& out, const std::shared_ptr<ProcessGroup>& processes);

}  // namespace pliant::apps
