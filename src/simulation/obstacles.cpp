#include "simulation/obstacles.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "meshing/mesh_distance.hpp"
#include "motion/patch_forces.hpp"
#include "scene/obstacle.hpp"
#include "scene/region.hpp"
#include "simulation/inner_bodies.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant {

namespace {

/// As stiff as the penalty that holds regions of a grid, and as the body is.
LedSpringsOptions clamp(const Body& body, const TriangleMesh& surface, double volume, const LedRegion& led,
                        const VectorX& theta, const SimulationOptions& simulation) {
  constexpr double penalty = 40.0;
  const MotionBlocks& blocks = simulation.blocks;
  const double nu = theta[blocks.poissons_ratio], p_wave = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
  const double edge = std::cbrt(body.volume() / std::max(1, body.element_count()));
  LedSpringsOptions options;
  options.stiffness = penalty * p_wave * volume / (edge * edge);
  if (simulation.material.of_mean_strain())
    options.moduli = blocks.youngs_moduli;
  else
    options.stiffness *= theta[blocks.youngs_moduli.front()];
  options.from = led.from, options.until = led.until;
  options.from_rest = !(led.from > simulation.times.front());
  options.motion = motion_of(led, surface);
  return options;
}

void add_led_region(const LedRegion& led, const Scene& scene, const Body& body, const VectorX& theta,
                    SimulationOptions& simulation) {
  const auto [patch, volume] = region_patch(body, is_in_region(*scene.object.surface, led.region));
  if (patch.rest.empty())
    throw InputError({{},
                      "a [[led]] region that contains no part of the object",
                      "a region that contains a part of the object at rest",
                      "look at the object's surface for its coordinates"});
  const LedSpringsOptions options = clamp(body, *scene.object.surface, volume, led, theta, simulation);
  simulation.further_forces.push_back([patch = patch, options](const auto& of) -> std::unique_ptr<ForceTerm> {
    return std::make_unique<LedSprings>(*of, patch, options);
  });
}

/// Points of the object's surface that touch an obstacle: those of its elements or, where the obstacle is thinner than
/// these, as many as it takes to meet it.
ContactSamples obstacle_samples(const Scene& scene, const Body& body, const RigidObstacle& obstacle) {
  const double thickness = box_of(obstacle).extent().minCoeff();
  const bool is_thin = !std::holds_alternative<ShapePlane>(obstacle.shape) && thickness < 2.0 * mean_edge(body);
  return is_thin ? mesh_samples(*scene.object.surface, 0.25 * thickness) : surface_samples(body);
}

void add_obstacle(const RigidObstacle& obstacle, const ContactSamples& samples, const ContactBlock& block,
                  SimulationOptions& simulation) {
  simulation.further_forces.push_back([shape = rigid_shape(obstacle), motion = motion_of(obstacle), block, samples,
                                       friction = obstacle.friction, penalty = simulation.contact,
                                       speed = simulation.friction_speed](const auto& of) {
    auto contact = std::make_unique<RigidContact>(RigidContact::sliding(*of, samples, shape, penalty, block));
    if (speed > 0.0) contact->set_friction(friction, speed);
    contact->lead(motion);
    return std::unique_ptr<ForceTerm>(std::move(contact));
  });
}

}  // namespace

std::shared_ptr<const RigidShape> rigid_shape(const RigidObstacle& obstacle) {
  constexpr double edge = 0.05;  // radius of a box' edges, over its least half edge
  if (const auto* ball = std::get_if<ShapeBall>(&obstacle.shape)) return rigid_ball(ball->centre, ball->radius);
  if (const auto* rod = std::get_if<ShapeCapsule>(&obstacle.shape))
    return rigid_capsule(rod->from, rod->to, rod->radius);
  if (const auto* box = std::get_if<ShapeBox>(&obstacle.shape)) {
    const Vector3 half = 0.5 * (box->max - box->min);
    return rigid_box(box->min + half, half, edge * half.minCoeff());
  }
  if (const auto* plane = std::get_if<ShapePlane>(&obstacle.shape))
    return rigid_half_space(plane->point, plane->normal);
  const double size = box_of(obstacle).extent().maxCoeff();
  return rigid_grid(signed_distance(std::get<ShapeMesh>(obstacle.shape).mesh, size / 64.0, 0.5 * size));
}

void add_obstacles(const Scene& scene, const Body& body, const VectorX& theta, SimulationOptions& simulation) {
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    add_obstacle(scene.obstacles[i], obstacle_samples(scene, body, scene.obstacles[i]), simulation.blocks.obstacles[i],
                 simulation);
  for (const LedRegion& led : scene.led) add_led_region(led, scene, body, theta, simulation);
  for (const auto& shape : sliding_bodies(scene))
    simulation.further_forces.push_back(
        [shape, modulus = theta[simulation.blocks.youngs_moduli.front()]](const auto& of) {
          return std::unique_ptr<ForceTerm>(std::make_unique<RigidContact>(inner_contact(*of, shape, modulus)));
        });
}

}  // namespace pliant
