#pragma once

#include <filesystem>
#include <functional>

#include "capture/observe.hpp"
#include "model/result.hpp"
#include "output/fitted_model.hpp"

namespace pliant {

/// Facts about a run that a result records beside the estimate.
struct RunFacts {
  std::string version, commit;
  std::string capture_path;  ///< as the user named it
  double wall_seconds = 0.0;
};

/// The estimate as `result.json` tells it.
/// @param recordings  of the fit, in its order
Result make_result(const std::vector<RecordedCapture>& recordings, const FitOutcome& outcome, const RunFacts& facts);

/// Distances of observed points to a simulated surface, frame by frame.
ErrorResult surface_errors(const CostEvaluation& evaluation);

/// Writes the whole output folder of a fit (docs/formats.md, section 2) but for its log.
/// @param result  of `make_result`, with what else is known
void write_fit_output(const std::filesystem::path& folder, const std::vector<RecordedCapture>& recordings,
                      const FitOutcome& outcome, const Result& result, const RunFacts& facts,
                      const std::function<void(const char*, int, int)>& progress = {});

}  // namespace pliant
