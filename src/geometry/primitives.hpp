#pragma once

#include <functional>

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Closed, outward oriented surfaces, for generated scenes and tests. But for the last they stand around the origin and
/// every vertex lies on the ideal surface, so volumes approach the ideal ones from below with the square of the facet
/// size.
/// All throw std::invalid_argument where a length is not positive and finite or a count is too small.

/// Axis-aligned box with edge lengths `size` [m]; each edge is cut into about `edge / facet` equal parts, at least one.
/// Exact volume.
TriangleMesh make_box(const Vector3& size, double facet);

/// Icosahedron whose triangles are split in four `subdivisions` times (0..8) and pushed out to `radius` [m].
TriangleMesh make_sphere(double radius, int subdivisions);

/// Ring around the y axis: circle of `ring_radius` [m] swept by a circle of `tube_radius` [m] < ring_radius.
/// Ideal volume 2 pi^2 R r^2.
TriangleMesh make_torus(double ring_radius, double tube_radius, int ring_segments, int tube_segments);

/// Where a continuous function is zero, negative inside: marching tetrahedra, six to each cube of a lattice (Doi and
/// Koide 1991), so closed and manifold whatever the function. Vertices are interpolated linearly along the tetrahedra's
/// edges, but stay a twentieth of an edge away from its ends, so that no triangle is flat.
/// @param box      around the surface [m]
/// @param spacing  of the lattice [m]
/// Throws std::invalid_argument also where the inside reaches the lattice's border.
TriangleMesh make_level_surface(const std::function<double(const Vector3&)>& function, const Box& box, double spacing);

}  // namespace pliant
