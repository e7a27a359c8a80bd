#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "model/model.hpp"
#include "simulation/model_simulation.hpp"
#include "situation/situation.hpp"

namespace pliant {

/// Obstacles of a model's scene in a situation: the situation's own where it has any, else those of the recording that
/// stand still.
std::vector<RigidObstacle> obstacles_in(const Scene& scene, const Situation& situation);

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
