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
