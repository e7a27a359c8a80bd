#pragma once

#include <array>
#include <functional>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// Moves the nodes of a mesh's boundary so that about each of them the boundary's faces cut off as much volume of the
/// solid that they stand for as they add. Faces whose corners lie on a round surface are chords of it: a stem meshed as
/// a hexagonal prism has 83 % of its volume and 68 % of its bending stiffness. Where faces lie on the surface, as on
/// flat parts and straight sharp edges, nodes stay. Nodes inside stay, too. The same input gives the same result.
/// @param nodes    [m]
/// @param tets     positively oriented; remain so. No node moves so far that an element's worst dihedral angle
///                 suffers much
/// @param nearest  the point of the solid's surface that is nearest to a point near it [m]
void match_volume(std::vector<Vector3>& nodes, const std::vector<std::array<int, 4>>& tets,
                  const std::function<Vector3(const Vector3&)>& nearest);

}  // namespace pliant
