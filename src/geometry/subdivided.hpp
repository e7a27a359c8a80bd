#pragma once

#include "geometry/triangle_mesh.hpp"

namespace pliant {

/// A mesh whose triangles are cut in four until their edges are no longer than `spacing` [m] on average, or there would
/// be more than `most` vertices. The given vertices come first.
TriangleMesh subdivided(TriangleMesh mesh, double spacing, int most);

}  // namespace pliant
