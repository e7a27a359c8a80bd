#pragma once

#include <filesystem>
#include <functional>

#include "ensemble/ensemble.hpp"

namespace pliant {

/// Writes what all members of an ensemble together say, once all of them are there: `members.csv`, `quantiles.csv`,
/// `frames.csv`, `points.csv` and `surface.pvd` where these are kept, `ensemble.html`, and at last `ensemble.json`
/// (docs/ensemble.md). One process at a time does so, and none where it was done. The same bytes whoever simulated the
/// members, and in which parts. Of each member the numbers are held in memory, never the paths.
/// @param progress  frames done and their total; false stops
/// Returns whether it is done; false where another process is at it. Throws InputError where files cannot be read or
/// written, Interrupted where it was stopped.
bool gather_ensemble(const std::filesystem::path& ensemble, const Model& model, const EnsembleScene& scene,
                     const EnsemblePlan& plan, const std::function<bool(int done, int total)>& progress = {});

}  // namespace pliant
