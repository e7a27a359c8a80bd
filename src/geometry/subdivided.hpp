#pragma once

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// Mean length of the triangles' edges [m], those that two of them share twice.
double mean_edge(const TriangleMesh& mesh);

/// A mesh whose triangles are cut in four until their edges are no longer than `spacing` [m] on average, or there would
/// be more than `most` vertices. The given vertices come first.
TriangleMesh subdivided(TriangleMesh mesh, double spacing, int most);

}  // namespace pliant
