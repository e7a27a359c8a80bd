#pragma once

#include <optional>
#include <string>

#include "estimation/fit_plan.hpp"
#include "estimation/recordings.hpp"

namespace pliant {

/// What a fit begins with where the object was seen to swing.
struct SeenSwing {
  VectorX theta;     ///< moduli and, where they show, dampings
  std::string told;  ///< for people
};

/// The modulus whose vibrations are as fast as those that were seen (Wang 2015, section 6.3), if some were: by points
/// that were followed, else by the middle of those that were not.
/// @param theta  to begin with; of it all that a swing does not show stays
std::optional<SeenSwing> seen_swing(const Recordings& recordings, const PlanFacts& facts, const Grid& coarse,
                                    const VectorX& theta);

}  // namespace pliant
