#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Reads a triangle mesh from PLY (text, binary of both byte orders), OBJ or STL (text, binary), by its ending.
/// Vertices keep the file's order (STL has none: equal corners are joined). Polygons are split into triangles.
/// Throws InputError where the file cannot be read as a mesh.
TriangleMesh read_mesh(const std::filesystem::path& path);

/// Writes binary PLY, OBJ or STL, by the path's ending; whole or not at all.
void write_mesh(const std::filesystem::path& path, const TriangleMesh& mesh);

/// What is known about a mesh's fitness as the surface of a solid.
struct MeshReport {
  int components = 0;
  int boundary_edges = 0, non_manifold_edges = 0, misoriented_edges = 0;
  int degenerate_triangles = 0, non_finite_vertices = 0, unused_vertices = 0;
  double volume = 0.0;  ///< [m^3]
  Box box;
  bool has_shared_volume = false;  ///< closed parts cut one another, or lie in one another and face the same way
  bool is_closed_solid = false;
  std::vector<std::string> complaints;  ///< each names what is wrong and where (vertex or triangle, position)
  std::string cure;                     ///< what to do where it is no closed solid
};

MeshReport examine(const TriangleMesh& mesh);

}  // namespace pliant
