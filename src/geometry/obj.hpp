#pragma once

#include <filesystem>
#include <string>

#include "base/error.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Reads the vertices and faces of a Wavefront OBJ file; polygons are triangulated, groups and materials ignored.
/// Throws InputError with the line where a vertex is not finite or a face names a vertex that is not there.
TriangleMesh read_obj(const std::filesystem::path& path);

/// Throws InputError unless 0 <= index < vertex_count; `owner` names who holds the index ("face 12").
void require_vertex(double index, std::size_t vertex_count, const std::string& owner, const Place& place);

}  // namespace pliant
