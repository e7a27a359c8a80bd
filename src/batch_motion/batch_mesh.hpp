#pragma once

#include "batch_motion/mesh_data.hpp"
#include "elasticity/body.hpp"

namespace pliant::batch_motion {

enum class SweepOrder {
  Natural,  ///< the nodes' own
  Colours,  ///< by colours of nodes that do not meet, so that rows of a colour may be found side by side
};

/// What members of a body share.
/// @param relative_moduli  of elements [-]
/// @param held             nodes that stay where they are
/// @param with_samples     whether the surface can meet a plane
/// Throws std::invalid_argument for quadratic tetrahedra, a modulus that is not positive, and nodes that are not there.
MeshData make_mesh_data(const Body& body, std::vector<double> relative_moduli, const std::vector<int>& held,
                        bool with_samples, SweepOrder order);

/// Stiffness of each class of hexahedra for E = 1 Pa, and its derivative by Poisson's ratio, as `MemberStiffness<8>`
/// has them. Empty for tetrahedra.
struct ClassStiffness {
  std::vector<double> value, change;
};
ClassStiffness class_stiffness(const Body& body, double poissons_ratio);

}  // namespace pliant::batch_motion
