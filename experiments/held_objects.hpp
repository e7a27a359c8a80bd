#pragma once

#include <string>

#include "geometry/triangle_mesh.hpp"
#include "motion/fixed_regions.hpp"

namespace pliant {

/// An object that stands or sticks out from what holds it, free of load; y points up.
struct HeldObject {
  TriangleMesh surface;  ///< [m]
  Hold held;
  double feature_angle_deg = 180.0;  ///< of its sharp edges, see TetMeshOptions
};

/// The kinds of object of Wang 2015, table 2, as simple shapes:
///   plant   three bent stalks on one foot, each with a leaf that droops
///   beam    0.6 m x 0.03 m x 0.03 m, held at one end, lying
///   holder  a phone holder: a heavy foot, a bent gooseneck, and a plate at its end
/// Throws std::invalid_argument for another name.
HeldObject make_held_object(const std::string& name);

}  // namespace pliant
