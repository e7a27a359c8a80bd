#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "model/model.hpp"
#include "simulation/model_simulation.hpp"
#include "situation/situation.hpp"

namespace pliant {

/// A rigid obstacle as a mesh that moves, for pictures and files.
struct SeenObstacle {
  TriangleMesh mesh;  ///< at its motion's zero; empty for planes
  KeyedMotion motion;
};
std::vector<SeenObstacle> seen_obstacles(const Situation& situation);

/// A rigid shape with the point about which it turns [m], and a box around it.
struct ObstacleShape {
  std::shared_ptr<const RigidShape> rigid;
  Vector3 middle;
  Box box;  ///< of no extent for planes
};
ObstacleShape obstacle_shape(const RigidObstacle& obstacle);
/// A rigid motion by its keys; none: it stands still.
KeyedMotion keyed_motion(const Vector3& centre, const std::vector<KeyFrames<6>::Key>& keys);

/// Throws InputError about a place that is further from the object's surface at rest than a radius and a twentieth of
/// its size.
/// @param what  that is to be there: "hand"
void check_place(const Situation& situation, const Scene& scene, const char* what, const Vector3& at, double radius);

/// A model in a situation, and what of it is to be seen.
struct SituationScene : ModelScene {
  /// The rains of the simulation that was made of this last, and lives.
  std::shared_ptr<std::vector<const Rain*>> rains = std::make_shared<std::vector<const Rain*>>();
};

/// A model in a situation, with the forces that belong to it.
/// @param copy  number of the object's copy: 0 is the object itself, k is `situation.copies[k - 1]`
/// Throws InputError where hands, forces or led regions are nowhere near the object, or a held object has a pose or a
/// velocity to start with.
SituationScene make_scene(const Model& model, const Situation& situation, int copy = 0);

}  // namespace pliant
