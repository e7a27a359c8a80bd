#pragma once

#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "motion/rigid_contact.hpp"
#include "scene/scene.hpp"

namespace pliant {

bool has_sliding_bodies(const Scene& scene);

/// Rigid bodies on which a scene's object slides, as smooth distances.
std::vector<std::shared_ptr<const RigidShape>> sliding_bodies(const Scene& scene);

/// Their contacts with a body of tetrahedra.
/// @param youngs_modulus  about which they are stiff [Pa]: the object's mean
std::vector<RigidContact> inner_contacts(const Body& body,
                                         const std::vector<std::shared_ptr<const RigidShape>>& sliding,
                                         double youngs_modulus);

/// Nodes that stay where they are: in held regions, and on rigid bodies that the object is glued to.
/// Throws InputError where no node lies on such a body.
std::vector<int> held_nodes(const Body& body, const Scene& scene);

}  // namespace pliant
