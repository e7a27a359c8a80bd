#pragma once

#include <optional>
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

/// All frames of all recordings, compared with what was simulated so many frames later.
struct ShiftedInTime {
  int later = 0;
  CostEvaluation evaluation;
};

/// Frames of a recording, from one on, that fit what was simulated some frames later or earlier.
struct TimeDoubt {
  int recording = 0;   ///< as `FrameFit` numbers it
  int frame = 0;       ///< as stated
  int later = 0;       ///< frames; negative: earlier
  double share = 0.0;  ///< of what noise does not explain that goes with it
};

/// Whether frames are missing in a recording, or repeated, that its times do not tell. A motion that a model does not
/// follow drifts from it, a gap in time begins at once: a frame that costs four times what the one before it does, and
/// less than a quarter of that at another time. Nothing where residuals are about noise, or where the shift takes off
/// less than half of what noise does not explain, as far after that frame as it takes off most: parameters that were
/// estimated across a gap are wrong, and times soon differ again.
/// @param stated   of all frames as they are
/// @param shifted  the same at other times; what has no frame there counts as it does as stated
std::optional<TimeDoubt> doubt_of_time(const CostEvaluation& stated, const std::vector<ShiftedInTime>& shifted);

}  // namespace pliant
