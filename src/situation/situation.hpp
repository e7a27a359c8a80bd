#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "geometry/key_frames.hpp"
#include "geometry/triangle_mesh.hpp"
#include "motion/contact_defaults.hpp"
#include "motion/rain.hpp"
#include "scene/scene.hpp"

// What happens to a model: a situation other than that of its recording (docs/formats.md, `situation/1`). SI units, the
// model's world.

namespace pliant {

/// A hand that takes the object at a point and leads it there on a spring.
struct Hand {
  Vector3 at = Vector3::Zero();               ///< on the surface at rest [m]
  double radius = 0.0;                        ///< of the patch [m]
  double stiffness = 0.0;                     ///< [N/m]; 0: ten times the weight over the size of the object
  double from = -infinite, until = infinite;  ///< [s]
  std::vector<KeyFrames<6>::Key> motion;      ///< shift [m] and rotation vector [rad] since it took hold
  std::vector<KeyFrames<3>::Key> path;        ///< where it is [m], in the place of a motion
};

/// A probe that is led from equilibrium to equilibrium.
struct ProbeFacts {
  ProbeKind kind = ProbeKind::BondedDisc;
  Vector3 at = Vector3::Zero();   ///< where it touches the surface at rest [m]
  double radius = 0.0;            ///< [m]
  std::optional<Vector3> axis;    ///< unit, into the object; nothing: against the surface's normal there
  Vector3 rod = Vector3::Zero();  ///< of a capsule, from the centre of one end to that of the other [m]
  TriangleMesh mesh;              ///< of a shape, where it is at rest
  enum class Led { Displacement, Depth, Force, Push } led = Led::Displacement;
  /// Displacement [m], depth along the axis [m], force [N], force along the axis [N], each with a rotation vector [rad]
  /// behind it; of depth and push the first number counts.
  std::vector<KeyFrames<6>::Key> path;
};

/// Copies of the object beside it, each on its own.
struct ObjectCopy {
  Vector3 shift = Vector3::Zero();  ///< of everything that is seen [m]
  double delay = 0.0;               ///< [s] by which its wind and rain are others
};

struct Situation {
  std::filesystem::path file;                ///< that it was read from, for complaints
  double duration = 5.0;                     ///< [s]
  double frame_rate = 30.0;                  ///< [Hz]
  bool keeps_held = true;                    ///< what the recording held or led is held
  std::optional<bool> settles;               ///< starts from equilibrium; nothing: where something is held
  std::optional<std::vector<Plane>> planes;  ///< in the place of the model's
  std::vector<KeyFrames<3>::Key> gravity;    ///< [m/s^2] over time; empty: the model's
  RigidMotion pose;                          ///< of the object at the start, about its middle
  Vector3 linear_velocity = Vector3::Zero(), angular_velocity = Vector3::Zero();  ///< there [m/s], [rad/s]
  std::optional<WindFacts> wind;
  std::vector<RainOptions> rains;
  std::vector<AppliedForce> forces;
  std::vector<Hand> hands;
  std::vector<LedRegion> led;
  std::optional<std::vector<RigidObstacle>> obstacles;  ///< in the place of the model's that stand still
  std::vector<ProbeFacts> probes;                       ///< of presses alone: what moves has obstacles and hands
  std::vector<ObjectCopy> copies;
};

/// Reads a situation, strictly. Throws InputError with every problem found, with file, line and column.
Situation read_situation(const std::filesystem::path& path);

}  // namespace pliant
