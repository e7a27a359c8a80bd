#pragma once

#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "motion/simulation.hpp"

namespace pliant {

/// How a body vibrates and sags, for small motions about rest.
struct SmallMotions {
  std::vector<double> frequencies;  ///< [Hz], lowest first; of a free object without the six rigid motions
  double sag = 0.0;                 ///< [m] of the point that moves most under gravity, linear; 0: nothing is held
};

/// A scene that only elasticity and what is held act in.
SimulationOptions elastic_alone(SimulationOptions options);

/// Small motions of a body that is held as the options say, or not at all.
/// @param options  `elastic_alone`
/// @param theta    by the options' blocks
/// @param points   at rest [m], n x 3, of which the sag is told
/// @param count    of frequencies, >= 1
/// Throws InputError where the vibrations of a free body are not found, or the stiffness of one that is held cannot be
/// factorised: it is not held as a whole.
SmallMotions small_motions(const std::shared_ptr<const Body>& body, const SimulationOptions& options,
                           const VectorX& theta, const Points& points, int count);

}  // namespace pliant
