#pragma once

#include <functional>
#include <memory>

#include "estimation/fit_pass.hpp"

namespace pliant {

/// Whether a fit with these options tracks its recordings: see `TrackingUse`.
bool tracks(const std::vector<RecordedCapture>& recordings, const FitOptions& options);

/// Plans tracking and estimation in turns (Wang 2015, section 3): the object is followed with the start values, its
/// parameters and load-free shape are fitted to the motion found, it is followed again with the estimate, until that
/// changes by less than two per cent or the rounds are up. Points of the surface take part in the fit where and when
/// points were seen about them: elsewhere the track is what its own dynamics say. With `TrackingUse::Both` every fifth
/// frame is left out, the points are also fitted themselves, and the estimate that predicts the frames left out better
/// is finished with all of them.
/// @param monitor  asked whether it is interrupted while it follows
/// @param resume   see `fit`
/// Throws InputError where a recording cannot be tracked or fitted.
std::unique_ptr<PassPlanner> planner_of_tracking(std::vector<RecordedCapture> recordings, const FitOptions& options,
                                                 const FitMonitor& monitor, FitState resume);

}  // namespace pliant
