#pragma once

#include <array>
#include <vector>

#include "base/types.hpp"

namespace pliant {

struct TetImprovement {
  double least_dihedral_deg = 15.0;  ///< elements with an angle below it, or above 180 degrees less it, are worked on
  double surface_tolerance = 0.0;    ///< [m] how far the boundary may move where two of its faces change their diagonal
};

/// Makes the worst shaped elements of a mesh better, worst first, as long as that goes: the elements around an edge or
/// beside a face are replaced by others, nodes inside are moved, and a flat element inside gives way to a node. Nodes
/// of the boundary stay where they are; of its faces only pairs that are flat to 20 degrees and within the tolerance
/// are exchanged, or lose a flat element below them. The same input gives the same result.
/// @param nodes  [m]; new ones come last
/// @param tets   positively oriented, flat ones allowed; the boundary is a surface on which each edge has two faces
void improve(std::vector<Vector3>& nodes, std::vector<std::array<int, 4>>& tets, const TetImprovement& options);

}  // namespace pliant
