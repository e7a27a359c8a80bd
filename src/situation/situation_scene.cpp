#include "situation/situation_scene.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>

#include "base/error.hpp"
#include "geometry/surface_distance.hpp"
#include "motion/patch_forces.hpp"
#include "motion/rain.hpp"
#include "scene/obstacle.hpp"
#include "scene/region.hpp"
#include "simulation/key_changes.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant {

void check_place(const Situation& situation, const Scene& scene, const char* what, const Vector3& at, double radius) {
  const double distance = distances_to_surface(*scene.object.surface, std::span(&at, 1)).front();
  if (distance <= std::max(radius, 0.05 * object_size(scene))) return;
  throw InputError({{situation.file},
                    fmt::format("a {} at [{:.4g}, {:.4g}, {:.4g}], {:.3g} m from the object", what, at.x(), at.y(),
                                at.z(), distance),
                    "`at`: a point of the object's surface at rest, in metres",
                    "look at the model's surface.ply for its coordinates"});
}

std::vector<RigidObstacle> obstacles_in(const Scene& scene, const Situation& situation) {
  if (situation.obstacles) return *situation.obstacles;
  std::vector<RigidObstacle> obstacles = scene.obstacles;
  std::erase_if(obstacles, [](const RigidObstacle& obstacle) { return !obstacle.motion.empty(); });
  return obstacles;
}

SituationScene make_scene(const Model& model, const Situation& situation, int copy) {
  if (!situation.probes.empty())
    throw InputError({{situation.file},
                      "[[probe]] in a situation that is simulated in time",
                      "[[obstacle]] or [[hand]]: they have inertia to meet",
                      "`pliant press MODEL --path FILE` leads probes from equilibrium to equilibrium"});
  Scene scene = model.scene;
  const int frames = std::max(1, int(std::lround(situation.duration * situation.frame_rate)));
  scene.timing = evenly_timed(situation.frame_rate, frames + 1);
  if (!situation.keeps_held) scene.fixed.clear(), scene.led.clear();
  for (LedRegion& led : scene.led) led = {led.region};  // what led it in the recording holds it here
  if (situation.planes) scene.planes = *situation.planes;
  scene.obstacles = obstacles_in(scene, situation);
  if (!situation.gravity.empty()) scene.world.gravity = situation.gravity.front().value;
  scene.initial = {};
  scene.initial.linear_velocity = situation.linear_velocity;
  scene.initial.angular_velocity = situation.angular_velocity;
  const bool is_held = scene.is_held();  // beyond what the situation leads
  scene.led.insert(scene.led.end(), situation.led.begin(), situation.led.end());
  const bool begins_elsewhere =
      !(situation.pose == RigidMotion()) || !situation.linear_velocity.isZero() || !situation.angular_velocity.isZero();
  if (is_held && begins_elsewhere)
    throw InputError({{situation.file},
                      "a table [initial] for an object that is held",
                      "an object that starts where it is held, at rest",
                      "write `held = false` to let it go, or lead its region by [[led]]"});
  for (const AppliedForce& force : situation.forces) check_place(situation, scene, "force", force.at, force.radius);
  for (const LedRegion& led : situation.led)
    if (!touches_solid(led.region, *scene.object.surface))
      throw InputError({{situation.file},
                        "a [[led]] region that contains no part of the object",
                        "a region that contains a part of the object at rest",
                        "look at the model's surface.ply for its coordinates"});
  for (const Hand& hand : situation.hands) check_place(situation, scene, "hand", hand.at, hand.radius);

  const double delay = copy > 0 ? situation.copies[std::size_t(copy) - 1].delay : 0.0;
  scene.wind = situation.wind, scene.forces = situation.forces;
  if (scene.wind) scene.wind->delay = delay;
  SituationScene made;
  static_cast<ModelScene&>(made) = make_scene(model, scene, scene_distance(scene, Resolution{}.band), situation.file);
  SimulationOptions& simulation = made.simulation;
  const MotionBlocks& blocks = simulation.blocks;
  const Vector3 gravity = blocks.gravity.vector(made.theta);
  simulation.gravity_change = changes(situation.gravity, gravity);
  simulation.starts_settled = situation.settles.value_or(is_held);
  if (simulation.starts_settled && !scene.is_held())
    throw InputError(
        {{situation.file}, "`settle = true` for an object that nothing holds", "a held object", "leave it out"});
  if (!is_held) {
    const Vector3 middle = made.body->centre_of_mass();
    simulation.start_pose = {situation.pose.rotation,
                             middle + situation.pose.translation - situation.pose.rotation * middle};
  }

  auto& further = simulation.further_forces;
  const TriangleMesh surface = *scene.object.surface;
  for (std::size_t r = 0; r < situation.rains.size(); ++r) {
    RainOptions options = situation.rains[r];
    options.seed += 1000003u * std::uint64_t(copy);
    further.push_back([surface, options, handle = blocks.gravity, rains = made.rains,
                       r](const auto& body) -> std::unique_ptr<ForceTerm> {
      auto rain = std::make_unique<Rain>(*body, surface, options, handle);
      rains->resize(std::max(rains->size(), r + 1));
      (*rains)[r] = rain.get();
      return rain;
    });
  }
  const double weight = made.theta[blocks.density] * made.body->volume() * std::max(gravity.norm(), 1.0);
  for (const Hand& hand : situation.hands) {
    LedSpringsOptions options;
    options.stiffness = hand.stiffness > 0.0 ? hand.stiffness : 10.0 * weight / made.body->size();
    options.from = hand.from, options.until = hand.until;
    options.reaches = !hand.path.empty();
    if (options.reaches) {
      std::vector<KeyFrames<6>::Key> keys;
      for (const auto& key : hand.path) {
        keys.push_back({key.time, KeyFrames<6>::Value::Zero()});
        keys.back().value.head<3>() = key.value;
      }
      options.motion = keyed_motion(Vector3::Zero(), keys);
    } else {
      options.motion = keyed_motion(hand.at, hand.motion);
    }
    further.push_back([hand, options](const auto& body) -> std::unique_ptr<ForceTerm> {
      return std::make_unique<LedSprings>(*body, surface_patch(*body, hand.at, hand.radius), options);
    });
  }
  return made;
}

}  // namespace pliant
