#pragma once

#include <optional>

#include "estimation/objective.hpp"

namespace pliant {

/// Young's modulus with which a body swings as fast as what was seen of its surface does.
struct SwingStart {
  double youngs_modulus = 0.0;  ///< [Pa], of the first control; the others keep their ratio to it
  double frequency = 0.0;       ///< observed [Hz]
};

/// The warm start of `modal_start` for points that nobody followed, and its second look at those of bodies that sag or
/// hang, which their weight slows down or speeds up: the middle of each frame's points swings, and so
/// does that of the simulated surface. Squares of frequencies are straight lines of the modulus, through the origin
/// where nothing weighs; a few simulations take in what modes about rest leave out: far swings, sag, and how the body
/// is held.
/// @param theta  where the simulation begins; moduli within a factor of a few hundred of the truth
/// Nothing where no oscillation is beyond doubt, in what was seen or in the simulation.
std::optional<SwingStart> swing_start(Simulation& simulation, VectorX theta,
                                      const std::vector<FrameObservations>& seen);

}  // namespace pliant
