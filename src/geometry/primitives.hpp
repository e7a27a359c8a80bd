#pragma once

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Closed, outward oriented surfaces around the origin, for generated scenes and tests. Every vertex lies on the ideal
/// surface, so volumes approach the ideal ones from below with the square of the facet size.
/// All throw std::invalid_argument where a length is not positive and finite or a count is too small.

/// Axis-aligned box with edge lengths `size` [m]; each edge is cut into about `edge / facet` equal parts, at least one.
/// Exact volume.
TriangleMesh make_box(const Vector3& size, double facet);

/// Icosahedron whose triangles are split in four `subdivisions` times (0..8) and pushed out to `radius` [m].
TriangleMesh make_sphere(double radius, int subdivisions);

/// Ring around the y axis: circle of `ring_radius` [m] swept by a circle of `tube_radius` [m] < ring_radius.
/// Ideal volume 2 pi^2 R r^2.
TriangleMesh make_torus(double ring_radius, double tube_radius, int ring_segments, int tube_segments);

}  // namespace pliant
