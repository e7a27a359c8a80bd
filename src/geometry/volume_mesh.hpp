#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "base/types.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Tetrahedra as a file gives them, made fit for a body: every element with a positive volume, every node used.
struct VolumeMesh {
  Points nodes;                               ///< n x 3 [m], in the order of the file
  std::vector<std::array<int, 4>> tets;       ///< corners, positively oriented
  std::vector<std::array<int, 6>> mid_nodes;  ///< of the edges 01 02 03 12 13 23; empty: linear elements

  int turned = 0;        ///< elements that the file has inside out
  int unused_nodes = 0;  ///< nodes of the file that belong to no tetrahedron, left out
  int passed_over = 0;   ///< points, lines and faces among the file's cells
  int pieces = 0;        ///< parts that share no node
};

/// Reads linear or quadratic tetrahedra by the path's ending: Gmsh's `.msh` (text; versions 1, 2 and 4.1), VTK's legacy
/// `.vtk` (text or binary) and `.vtu` (text or base64, either byte order; neither appended nor compressed).
/// @param unit  length [m] of the file's unit: 0.001 for millimetres
/// Throws InputError where the file is malformed (with line and column, or what was being read), holds other solid
/// cells or no tetrahedra, both linear and quadratic ones, a tetrahedron without volume, or used nodes at one place.
VolumeMesh read_volume_mesh(const std::filesystem::path& path, double unit = 1.0);

/// Faces of one element only, counter-clockwise from outside, with their corners in the order of the nodes.
TriangleMesh boundary_surface(const VolumeMesh& mesh);

}  // namespace pliant
