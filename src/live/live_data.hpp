#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/material.hpp"
#include "elasticity/material_law.hpp"
#include "geometry/triangle_mesh.hpp"
#include "motion/simulation.hpp"
#include "scene/scene.hpp"

namespace pliant {

/// Parameters of an object drawn from what a fit knows of them.
struct LiveSample {
  VectorX theta;                           ///< of `live_blocks`
  std::shared_ptr<const MaterialLaw> law;  ///< null: the moduli of theta
};

/// A press of the recording.
struct LiveTest {
  Vector3 at = Vector3::Zero();     ///< where the disc touches the surface at rest [m]
  double radius = 0.0;              ///< of the disc, which sticks [m]
  Vector3 force = Vector3::Zero();  ///< of the disc on the object [N]
};

/// Everything that moves or presses a fitted object, as one block of bytes: what a page needs that runs the simulation
/// itself.
struct LiveData {
  std::variant<HexGrid, TetMesh> mesh;
  std::vector<double> relative_moduli;  ///< one an element [-]
  VectorX relative_deviations;          ///< of Young's modulus, one an element [-]; empty: not known
  Material material;                    ///< of the moduli of `theta`, or a law that depends on no parameters
  bool is_pressed = false;              ///< equilibria, not motion
  std::vector<int> held;                ///< nodes of an object that is pressed
  std::vector<LiveTest> tests;          ///< of an object that is pressed
  TriangleMesh surface;                 ///< at rest [m]
  std::vector<FixedRegion> fixed;
  std::vector<Weight> weights;
  int planes = 0;
  VectorX theta;  ///< of `live_blocks`
  /// Of the simulation: what is not listed here has its default.
  double max_dt = 0.0, newmark_theta = 0.51, contact_weight = 0.6, rotation_prediction = 0.5;
  Penalty contact;
  double friction_speed = 0.0;
  Vector3 up = Vector3::UnitY();
  std::vector<LiveSample> samples;  ///< of the posterior
};

/// Blocks of the parameters of an object that a page moves: those of its motion, and a wind.
MotionLayout live_blocks(int planes);

/// The bytes, little-endian, and back. Throws std::runtime_error where the bytes are none, are cut short or are of
/// another version.
std::string encode(const LiveData& data);
LiveData decode(std::string_view bytes);

}  // namespace pliant
