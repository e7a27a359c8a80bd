#pragma once

#include <vector>

#include "elasticity/body.hpp"

namespace pliant {

/// Points of an object's surface with areas, as finely spread as a contact asks for.
struct ContactSamples {
  std::vector<Vector3> rest;         ///< rest positions [m]
  std::vector<double> area;          ///< area of each [m^2]
  std::vector<Vector3> normal = {};  ///< outwards, unit; of samples of discs empty
};

/// The samples of the surface that a body of any kind comes with: about one a surface triangle or cell.
ContactSamples surface_samples(const Body& body);

/// Samples of a surface whose triangles are cut into equal ones with sides of a spacing [m] at most.
ContactSamples mesh_samples(const TriangleMesh& surface, double spacing);

/// The boundary of a body of tetrahedra, every face cut into n^2 equal triangles, one sample each.
/// Throws std::invalid_argument for hexahedra.
ContactSamples boundary_samples(const Body& body, int cuts);

/// Samples of a body of tetrahedra that a flat disc on the undeformed surface covers: within `radius` [m] of `centre`,
/// where the surface faces the same way as there. Cut so that a disc of any size covers some hundreds.
/// Throws std::invalid_argument for hexahedra.
ContactSamples disc_samples(const Body& body, const Vector3& centre, double radius);

}  // namespace pliant
