#pragma once

#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Moves of a surface's vertices by which each of the faces about a vertex goes outwards by one [-], nearly: by least
/// squares over their areas, of all such moves the shortest. Zero where no face is.
std::vector<Vector3> offset_directions(const TriangleMesh& surface);

}  // namespace pliant
