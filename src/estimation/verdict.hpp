#pragma once

#include <string>
#include <vector>

#include "estimation/cost.hpp"
#include "estimation/uncertainty.hpp"

namespace pliant {

/// Whether an estimate can be quoted.
struct Verdict {
  enum class Kind {
    Explained,     ///< the model meets what was seen to within the noise, and the moduli are known
    Unexplained,   ///< the residuals are far above the noise, or most of what was seen is not matched
    Undetermined,  ///< the recording cannot tell a modulus
  };
  Kind kind = Kind::Explained;
  std::vector<std::string> reasons;  ///< plain sentences; none where all is well with the whole
};

/// "explained", "unexplained" or "undetermined".
std::string name_of(Verdict::Kind kind);

/// Root mean square distance of a frame's points over that of the sensor's noise, the median of a window of frames
/// about each; empty where no surface was seen.
std::vector<double> residuals_over_noise(const CostEvaluation& evaluation);

/// One number for how far an evaluation is from what was seen: the root mean square distance over the noise, more
/// where fewer points are matched than a verdict accepts. About 1 where the model is right; infinite where nothing is
/// matched.
double misfit_of(const CostEvaluation& evaluation);

/// Whether residuals are near the noise, over all frames and for every while, and most points are matched: within
/// closer limits than those of a verdict, for choosing what is fitted. Never where followed points alone were seen: a
/// tracker's noise is a guess.
bool is_explained(const CostEvaluation& evaluation);

/// How far one kind of measurement of static tests is from what the estimate has there.
struct Agreement {
  std::string what;         ///< for people: "the markers under presses"
  double over_noise = 0.0;  ///< root mean square residual over the measurement's noise; infinite where that is unknown
  double relative = 0.0;    ///< the same over the greatest that was measured of its kind
};

/// Static tests are unexplained where a kind of measurement is missed by more than its noise and by more than a small
/// part of what was measured: a law of few numbers need not meet a load cell to its last digit.
Verdict verdict_of(const std::vector<Agreement>& agreements, const Uncertainty& uncertainty,
                   const ParameterSet& parameters);

/// @param evaluation   at the estimate
/// @param uncertainty  of the estimate; empty where nothing was estimated
Verdict verdict_of(const CostEvaluation& evaluation, const Uncertainty& uncertainty, const ParameterSet& parameters);

}  // namespace pliant
