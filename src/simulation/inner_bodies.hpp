#pragma once

#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "motion/fixed_regions.hpp"
#include "motion/rigid_contact.hpp"
#include "scene/scene.hpp"

namespace pliant {

bool has_sliding_bodies(const Scene& scene);

/// Rigid bodies on which a scene's object slides, as smooth distances.
std::vector<std::shared_ptr<const RigidShape>> sliding_bodies(const Scene& scene);

/// Their contacts with a body.
/// @param youngs_modulus  about which they are stiff [Pa]: the object's mean
std::vector<RigidContact> inner_contacts(const Body& body,
                                         const std::vector<std::shared_ptr<const RigidShape>>& sliding,
                                         double youngs_modulus);

/// Held regions of a scene, and those that rigid bodies hold to which the object is glued: what lies on them, within a
/// small part of an element.
/// Throws InputError where no node lies on such a body.
std::vector<Hold> holds_of(const Body& body, const Scene& scene);

/// Nodes that stay where they are: in held regions, and on rigid bodies that the object is glued to.
/// Throws InputError where no node lies on such a body.
std::vector<int> held_nodes(const Body& body, const Scene& scene);

}  // namespace pliant
