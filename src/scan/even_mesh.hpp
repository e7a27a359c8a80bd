#pragma once

#include <functional>
#include <optional>

#include "capture/capture.hpp"
#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// The part of a mesh of several closed ones that encloses most; vertices that it does not use are left out.
[[nodiscard]] TriangleMesh largest_part(const TriangleMesh& mesh);

/// A closed mesh of the largest part in which `raw` is negative, evened out over one lattice spacing.
/// @param raw      of the order of the distance near the surface [m], negative inside
/// @param box      around the inside [m]
/// @param spacing  of the lattice, about the length of the mesh's edges [m]
/// @param plane    the mesh ends sharply on it; nothing: on none
/// @return         no triangles where nothing is inside
/// Throws std::invalid_argument where the inside reaches the box.
[[nodiscard]] TriangleMesh even_mesh(const std::function<double(const Vector3&)>& raw, const Box& box, double spacing,
                                     const std::optional<Plane>& plane = {});

}  // namespace pliant
