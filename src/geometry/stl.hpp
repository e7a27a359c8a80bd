#pragma once

#include <filesystem>

#include "base/error.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Reads text or binary STL. Corners with exactly the same coordinates become one vertex, in order of appearance.
/// Throws InputError where the file is cut short, malformed, or holds a number that is not finite.
TriangleMesh read_stl(const std::filesystem::path& path);

}  // namespace pliant
