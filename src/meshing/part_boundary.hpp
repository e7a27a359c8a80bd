#pragma once

#include <array>
#include <functional>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// Makes the faces of a mesh follow the boundary of a part of space, so that no element lies on both sides of it: nodes
/// outside and near it are moved onto it along an edge, and edges that still cross it get a node there, which divides
/// the elements around them. Elements inside may become thin. Nodes on the boundary are inside by `contains`. The
/// mesh's own surface keeps its shape: its nodes move within flat or straight parts of it only. The same input gives
/// the same result.
/// @param nodes      [m]; new ones come last
/// @param tets       positively oriented
/// @param contains   whether a point lies in the part; its boundary crosses an edge once or not at all
/// @param tolerance  how far the mesh's surface may change where a node of it moves [m]
void follow_part(std::vector<Vector3>& nodes, std::vector<std::array<int, 4>>& tets,
                 const std::function<bool(const Vector3&)>& contains, double tolerance);

}  // namespace pliant
