#pragma once

#include "geometry/signed_distance.hpp"

namespace pliant {

/// Signed distance of a closed, outward oriented mesh, by OpenVDB. Parts of it that face inwards are cavities.
/// @param spacing  of the distance grid [m]
/// @param margin   how far outside the mesh's box the grid reaches [m]; distances are cut off a little beyond it,
///                 inside and outside, which keeps the work in a band around the surface
/// Throws InputError where the mesh encloses no grid point.
SignedDistance signed_distance(const TriangleMesh& mesh, double spacing, double margin);

}  // namespace pliant
