#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "elasticity/body.hpp"
#include "motion/fixed_regions.hpp"

namespace pliant {

/// How an object is let go: straight from rest with a velocity, or at rest from the equilibrium in which a part of it
/// is held elsewhere until then.
struct StartingMotion {
  std::string name;
  Vector3 linear, angular;  ///< of and about the centre of mass [m/s], [rad/s]
  std::optional<Hold> led;  ///< the part that is held until then, and where
};

/// An object all of whose nodes are followed.
struct TrackedObject {
  std::shared_ptr<const Body> body;  ///< with its control points
  Hold held;
  std::vector<StartingMotion> motions;  ///< one a recording
  double size = 0.0;                    ///< [m], of which noise is a part
};

/// A bar of 756 nodes and 3000 tetrahedra, 1 m x 0.25 m x 0.25 m, held at one end, which twists, bends and stretches
/// (Wang 2015, figure 9): struck where it rests, or let go from poses in which its other end is held.
/// @param seed  0: control points are spread evenly along it, with linear weights; else they are nodes drawn at random,
///              with harmonic weights
TrackedObject make_bar(int controls, unsigned seed, bool deformed_starts);

/// A dinosaur on two legs, held at the feet, which swings (Wang 2015, figure 5b). Its control points stand at the
/// extremities, the first of: head, tail, hands, feet, and belly; weights are harmonic. About 1.1 m long.
/// @param controls  1..7
/// @param cell_size of the tetrahedra [m]
TrackedObject make_dinosaur(int controls, double cell_size);

}  // namespace pliant
