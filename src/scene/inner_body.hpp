#pragma once

#include <ostream>

#include "scene/scene.hpp"
#include "scene/toml_table.hpp"

// Rigid bodies inside or under an object: the blocks [[inner]] of all formats that hold a scene.

namespace pliant {

/// Block [[inner]]: `surface`, a closed mesh, and `contact`. Complains about an open one.
InnerBody read_inner(TomlTable& block, const NamedFiles& files);

/// Makes the object's surface the boundary of its solid: an inner body that lies within what the scan encloses is cut
/// out of it, so that a scan of the skin alone becomes the layer over the skull. Where the object has room for the body
/// already (a cavity, or the floor under it) nothing is cut. Complains about bodies that reach through the object's
/// surface, that are nowhere near it, and about a volume mesh without room for them.
void cut_out_inner_bodies(TomlContext& context, Scene& scene);

/// An object's surface without the bodies that were cut out of it: what was scanned.
TriangleMesh scanned_surface(TriangleMesh surface, const std::vector<InnerBody>& inner);

/// Blocks [[inner]]; the files that they name, `inner_0.ply`, ..., are written by `write_inner_files`.
void write_inner_blocks(std::ostream& out, const Scene& scene);
void write_inner_files(const std::filesystem::path& folder, const Scene& scene);

}  // namespace pliant
