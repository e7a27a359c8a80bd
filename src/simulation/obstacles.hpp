#pragma once

#include <memory>

#include "motion/rigid_shape.hpp"
#include "motion/simulation.hpp"
#include "scene/scene.hpp"

// What a scene's object meets and is led by beside planes: obstacles of any shape, rigid bodies inside it, led regions.

namespace pliant {

/// An obstacle as a signed distance, where its motion is zero; meshes on a grid of a 64th of their size.
std::shared_ptr<const RigidShape> rigid_shape(const RigidObstacle& obstacle);

/// Adds a scene's obstacles, led regions and inner bodies to a simulation, each of the first two as a force.
/// @param simulation  whose blocks have a coefficient of friction for each obstacle, with its planes' contact
/// @param theta       by those blocks: contact with inner bodies is as stiff as this Young's modulus has it
/// Throws InputError for a led region that contains no part of the object, and for an inner body that touches it
/// nowhere.
void add_obstacles(const Scene& scene, const Body& body, const VectorX& theta, SimulationOptions& simulation);

}  // namespace pliant
