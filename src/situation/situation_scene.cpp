#include "situation/situation_scene.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>

#include "base/error.hpp"
#include "geometry/primitives.hpp"
#include "geometry/surface_distance.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/fixed_regions.hpp"
#include "motion/patch_forces.hpp"
#include "motion/rain.hpp"
#include "motion/rigid_contact.hpp"
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

KeyedMotion keyed_motion(const Vector3& centre, const std::vector<KeyFrames<6>::Key>& keys) {
  return keys.empty() ? KeyedMotion() : KeyedMotion(centre, KeyFrames<6>(keys));
}

ObstacleShape obstacle_shape(const RigidObstacle& obstacle) {
  const auto in_box = [](std::shared_ptr<const RigidShape> rigid, const Box& box) {
    return ObstacleShape{std::move(rigid), 0.5 * (box.min + box.max), box};
  };
  if (const auto* ball = std::get_if<ShapeBall>(&obstacle.shape))
    return in_box(rigid_ball(ball->centre, ball->radius), grown({ball->centre, ball->centre}, ball->radius));
  if (const auto* rod = std::get_if<ShapeCapsule>(&obstacle.shape))
    return in_box(rigid_capsule(rod->from, rod->to, rod->radius),
                  grown({rod->from.cwiseMin(rod->to), rod->from.cwiseMax(rod->to)}, rod->radius));
  if (const auto* box = std::get_if<ShapeBox>(&obstacle.shape)) {
    const Vector3 half = 0.5 * (box->max - box->min);
    return in_box(rigid_box(box->min + half, half, 0.05 * half.minCoeff()), {box->min, box->max});
  }
  if (const auto* plane = std::get_if<ShapePlane>(&obstacle.shape))
    return {rigid_half_space(plane->point, plane->normal), plane->point, {}};
  const TriangleMesh& mesh = std::get<ShapeMesh>(obstacle.shape).mesh;
  const Box box = bounding_box(mesh);
  const double size = box.extent().maxCoeff();
  return in_box(rigid_grid(signed_distance(mesh, size / 64.0, 0.5 * size)), box);
}

std::vector<SeenObstacle> seen_obstacles(const Situation& situation) {
  std::vector<SeenObstacle> seen;
  for (const RigidObstacle& obstacle : situation.obstacles) {
    const ObstacleShape shape = obstacle_shape(obstacle);
    SeenObstacle& one = seen.emplace_back();
    one.motion = keyed_motion(shape.middle, obstacle.motion);
    if (const auto* mesh = std::get_if<ShapeMesh>(&obstacle.shape)) {
      one.mesh = mesh->mesh;
    } else if (!std::holds_alternative<ShapePlane>(obstacle.shape)) {
      const double spacing = shape.box.extent().maxCoeff() / 40.0;
      one.mesh = make_level_surface([&](const Vector3& p) { return shape.rigid->sample(p).distance; },
                                    grown(shape.box, 2.0 * spacing), spacing);
    }
  }
  return seen;
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
  if (!situation.keeps_held) scene.fixed.clear();
  if (situation.planes) scene.planes = *situation.planes;
  if (!situation.gravity.empty()) scene.world.gravity = situation.gravity.front().value;
  scene.initial = {};
  scene.initial.linear_velocity = situation.linear_velocity;
  scene.initial.angular_velocity = situation.angular_velocity;
  const bool is_held = !scene.fixed.empty();
  const bool begins_elsewhere =
      !(situation.pose == RigidMotion()) || !situation.linear_velocity.isZero() || !situation.angular_velocity.isZero();
  if (is_held && begins_elsewhere)
    throw InputError({{situation.file},
                      "a table [initial] for an object that is held",
                      "an object that starts where it is held, at rest",
                      "write `held = false` to let it go, or lead its region by [[led]]"});
  for (const AppliedForce& force : situation.forces) check_place(situation, scene, "force", force.at, force.radius);
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
  if (simulation.starts_settled && !is_held)
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
  const double modulus = model.youngs_modulus * (1.0 - model.poissons_ratio) /
                         ((1.0 + model.poissons_ratio) * (1.0 - 2.0 * model.poissons_ratio));
  const double edge = std::cbrt(made.body->volume() / std::max(1, made.body->element_count()));
  for (const LedRegion& led : situation.led) {
    const std::vector<int> nodes = held_nodes(*made.body, held_regions({{led.region, std::nullopt}}, surface));
    if (nodes.empty())
      throw InputError({{situation.file},
                        "a [[led]] region that contains no part of the object",
                        "a region that contains a part of the object at rest",
                        "look at the model's surface.ply for its coordinates"});
    Vector3 middle = Vector3::Zero();
    double volume = 0.0;
    Points nodal = Points::Zero(made.body->node_count(), 3);
    made.body->add_mass_product(1.0, Points::Ones(made.body->node_count(), 3), nodal);
    for (const int node : nodes) {
      middle += made.body->scanned_positions().row(node).transpose() / double(nodes.size());
      volume += std::max(0.0, nodal(node, 0));
    }
    // As stiff as the penalty that holds regions of a grid.
    LedSpringsOptions options;
    options.stiffness = 40.0 * modulus * volume / (edge * edge);
    options.from = led.from, options.until = led.until;
    options.from_rest = !(led.from > 0.0);
    options.motion = keyed_motion(middle, led.motion);
    further.push_back([nodes, options](const auto& body) -> std::unique_ptr<ForceTerm> {
      return std::make_unique<LedSprings>(*body, node_patch(*body, nodes), options);
    });
  }
  for (const RigidObstacle& obstacle : situation.obstacles) {
    const ObstacleShape shape = obstacle_shape(obstacle);
    further.push_back([shape, obstacle, penalty = simulation.contact,
                       speed = simulation.friction_speed](const auto& body) -> std::unique_ptr<ForceTerm> {
      auto contact =
          std::make_unique<RigidContact>(RigidContact::sliding(*body, surface_samples(*body), shape.rigid, penalty));
      if (obstacle.friction > 0.0) contact->set_friction(obstacle.friction, speed);
      contact->lead(keyed_motion(shape.middle, obstacle.motion));
      return contact;
    });
  }
  return made;
}

}  // namespace pliant
