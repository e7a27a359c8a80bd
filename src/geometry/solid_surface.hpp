#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// A surface made fit for a solid as far as that is unambiguous.
struct SolidSurface {
  TriangleMesh mesh;
  std::vector<std::string> remarks;  ///< what was mended or left out, and of what parts it is, for people
};

/// Mends a surface that shall enclose a solid, and nothing of one that does:
///
/// - Corners at open edges are joined that coincide, or lie closer than a tolerance: the least of a few, from the
///   rounding of single precision to 1e-4 of the surface's diagonal, that closes the surface and joins no two ends of
///   an edge.
/// - Triangles that are an edge or a point then, or are there twice, are left out, if that leaves fewer faults.
/// - Triangles are turned where neighbours face opposite sides, and whole shells that face inwards. A shell within
///   another that faces the other way is a cavity and stays.
/// - Crumbs are left out: parts of less than a hundredth of the greatest part's volume, open ones of its area. So are
///   copies of another part.
///
/// Vertices keep their number and order, so that their indices stay valid. One that is in no triangle, and was not
/// joined to one that is, is moved onto the first that is in one, where it widens no box. What cannot be mended stays
/// as it is, for `examine` to tell.
SolidSurface mend(TriangleMesh mesh);

/// `read_mesh`, and of `mend` the mesh. Throws InputError where the file cannot be read as a mesh.
TriangleMesh read_surface(const std::filesystem::path& path);

}  // namespace pliant
