#pragma once

#include <string>
#include <vector>

#include "estimation/objective.hpp"

namespace pliant {

/// A systematic error of a recording that can be estimated: a sensor's range, its pose, the direction of gravity.
struct Correction {
  std::string what;                     ///< for people: "the pose of front"
  std::vector<std::string> parameters;  ///< that are estimated together
};

/// Those of all parameters that are neither estimated nor in `chosen`, what the user has decided about.
std::vector<Correction> possible_corrections(const ParameterSet& parameters, const std::vector<std::string>& chosen);

/// A correction that the residuals ask for.
struct NeededCorrection {
  Correction correction;
  double gain = 0.0;   ///< by which the cost would fall, to first order
  double least = 0.0;  ///< that is worth the correction's parameters
};

/// Whether residuals leave so much that a correction may be needed: their mean square is more than twice that of their
/// noise. An elastic model errs about as much as the sensor that sees it; that is no sensor's fault.
/// @param observations  independent ones behind the cost
bool may_need_correction(double cost, double observations);

/// Rao's score test (1948) of each correction at an estimate that lacks it: one Gauss-Newton step with it, all
/// that was estimated following along. A model that is a little wrong leaves residuals that any correction lowers
/// somewhat; so one is needed only where the residuals' mean square is more than twice that of their noise, where it
/// explains at least half of what the noise does not, and more than Schwarz's criterion (1978) asks, scaled by how much
/// larger they are. The one that gains most comes first, then those still needed beside it.
/// @param evaluation  with derivatives by all of `parameters`: what was estimated, and the corrections
/// @param parameters  that set, with the corrections estimated
/// @param observations  independent ones behind the cost
std::vector<NeededCorrection> needed_corrections(const CostEvaluation& evaluation, const ParameterSet& parameters,
                                                 const std::vector<Correction>& corrections, double observations);

}  // namespace pliant
