#pragma once

#include <memory>
#include <vector>

#include "estimation/fit.hpp"

namespace pliant {

/// A cost function and the unconstrained vector where its minimisation begins.
struct StartObjective {
  std::shared_ptr<CostFunction> cost;
  VectorX p;
};

/// The objective of a fit on its full grid with all that it estimates, where the fit begins: of recordings over all
/// frames in the wide band of outliers; of a capture of static tests alone with the first form of the law.
/// @param processes  that evaluate that of recordings together; null: this one alone
/// Throws InputError where a recording cannot be fitted, with the reason.
StartObjective start_objective(std::vector<RecordedCapture> recordings, const FitOptions& options,
                               std::shared_ptr<ProcessGroup> processes = nullptr);

}  // namespace pliant
