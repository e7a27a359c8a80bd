#pragma once

#include <functional>

#include "mesh/tet_mesh.hpp"

namespace pliant {

/// How far from flat a tetrahedron is: 6 sqrt(2) V / l^3 with the root mean square l of its edges; 1 for a regular one,
/// 0 for a flat one, below that for an inverted one.
double tet_shape_quality(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

/// A mesh of linear elements with flat ones mended: their nodes are moved to where the worst element about them is
/// best, inside the object freely, on its surface and where it is held by up to a twelfth of an edge. Flat elements
/// have next to no volume, and yet the highest frequencies: they make other programs need tiny steps and many
/// iterations.
/// @param is_held  whether what stands at a place [m] is held; nodes that are stay so, and others do not become so
/// No element is worse afterwards than the worst of those about its nodes was. The same input gives the same mesh.
/// Throws std::invalid_argument where the mesh is quadratic.
TetMesh with_flat_elements_mended(const TetMesh& mesh, const std::function<bool(const Vector3& place)>& is_held);

}  // namespace pliant
