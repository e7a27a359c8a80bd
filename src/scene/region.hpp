#pragma once

#include <functional>

#include "scene/scene.hpp"

namespace pliant {

/// How often a closed surface encloses a point: 1 inside a solid, 0 outside and in its cavities (Van Oosterom and
/// Strackee 1983: the solid angle of a triangle).
double winding_number(const TriangleMesh& surface, const Vector3& point);

/// Whether a point [m] at rest lies in a region or on its border. A list of vertices contains no point of space: false.
bool contains(const Region& region, const Vector3& point);

/// Whether a vertex of the object's surface lies in the region (by index for a list of vertices).
bool contains_vertex(const Region& region, const TriangleMesh& surface, int vertex);

/// Whether any point of the solid lies in the region: a vertex of the surface, or a point inside it.
bool touches_solid(const Region& region, const TriangleMesh& surface);

/// Whether a point [m] at rest lies in a region; named vertices hold the object around them, as far as the next ones.
std::function<bool(const Vector3&)> is_in_region(const TriangleMesh& surface, const Region& region);

}  // namespace pliant
