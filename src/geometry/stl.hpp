#pragma once

#include <filesystem>

#include "base/error.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Reads text (of one solid or several, in capitals too) or binary STL (whose heading may begin with "solid"). Corners
/// with exactly the same coordinates become one vertex, in order of appearance. Behind the facets that a binary heading
/// promises may stand something else; where it promises none, they are counted.
/// Throws InputError where the file is cut short, malformed, or holds a number that is not finite.
TriangleMesh read_stl(const std::filesystem::path& path);

}  // namespace pliant
