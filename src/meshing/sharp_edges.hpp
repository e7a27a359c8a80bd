#pragma once

#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Where elements of a size have to keep an edge of a scan: lines of vertices from corner to corner, or closed ones,
/// whose first vertex is their last. A line ends where others meet it or where it turns by more than the angle. An edge
/// is sharp where the normals of its faces differ by more than the angle, with three exceptions. Edges at which the
/// surface folds back onto itself (150 degrees) are faults of a scan, edges that end in the middle of the surface
/// separate nothing, and patches with less area than a quarter of the size's square need no edges of their own.
/// @param surface    closed; edges of two triangles each
/// @param angle_deg  (0, 180]
/// @param cell_size  [m]
std::vector<std::vector<int>> sharp_lines(const TriangleMesh& surface, double angle_deg, double cell_size);

}  // namespace pliant
