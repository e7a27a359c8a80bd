#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/law_layout.hpp"
#include "elasticity/material.hpp"
#include "synthesis/synthesis.hpp"

namespace pliant {

/// What a part of the object is made of, beside its Young's modulus.
struct SyntheticNumbers {
  double poissons_ratio = 0.0;
  std::vector<double> exponents;         ///< of Ogden's law, one a term
  std::vector<double> stiffness_ratios;  ///< of each further term, mu_i / mu_1
  std::vector<double> poissons_ratios;   ///< of each term; empty: all have the same
};

/// What holds an object in a deformed pose until the start frame, and lets go then: a force on a patch of its surface,
/// or a grip that was led somewhere.
struct SyntheticPull {
  Vector3 at = Vector3::Zero();  ///< [m], on the stress-free surface
  double radius = 0.0;           ///< of the patch, or of the ball that is gripped [m]
  std::optional<Vector3> force;  ///< [N]; nothing: a grip
  RigidMotion to;                ///< of the grip, from rest; turns about `at`
};

/// A probe to press the object with, and how.
struct SyntheticPress {
  Vector3 at = Vector3::Zero();                  ///< where it touches the surface [m]
  double radius = 0.0;                           ///< [m]
  std::optional<Vector3> axis;                   ///< unit, into the object; nothing: against the surface's normal
  bool glued = true;                             ///< a disc that sticks; else a flat punch that slides
  enum class Led { Force, Push, Shift, Depth };  ///< by a vector, or by a number along the axis
  Led led = Led::Depth;
  Vector3 vector = Vector3::Zero();  ///< [N] or [m]
  double number = 0.0;               ///< [N] or [m]
  double force_noise = 0.0;          ///< [N]
  std::string role = "fit";
};

/// A force-depth curve to measure.
struct SyntheticIndentation {
  Indentation facts;           ///< without file; a zero direction: against the surface's normal
  std::vector<double> depths;  ///< [m], growing
  double force_noise = 0.0;    ///< [N], > 0
};

/// A situation to simulate and to record: the format "scene/1" of docs/scene.md. SI units.
struct SyntheticScene {
  std::string name;
  Scene scene;  ///< surface stress-free, where the object is at the start, also where the object is scanned as it sags;
                ///< exactly one of mass and density; no times: static tests alone
  std::vector<double> plane_half_sizes;  ///< [m] of each plane: half the edge of the square that cameras see; 0: none
  double scan_noise = 0.0;               ///< [m] deviation of the vertices of rest.ply along their normals

  double youngs_modulus = 0.0;      ///< [Pa], outside of all regions; where there are no control points
  std::vector<double> part_moduli;  ///< [Pa] of each region or control point
  double poissons_ratio = 0.0;
  double mass_damping = 0.0;       ///< Rayleigh [1/s]
  double stiffness_damping = 0.0;  ///< [s]
  /// Of all that moves, rests and is pressed, but for `law`.
  Material material;
  /// Form of a law of its own at every quadrature point, of tetrahedra; nothing: that of `material`.
  std::optional<LawForm> law;
  std::vector<SyntheticNumbers> law_numbers;  ///< of each law of the form

  ElementKind element = ElementKind::Hexahedron;
  double cell_size = 0.0;  ///< [m]
  int substeps = 4;        ///< time steps a frame
  double newmark_theta = 0.5;
  double contact_stiffness = 0.0;  ///< [Pa/m]; 0: the simulation's choice
  double contact_smoothing = 0.0;  ///< [m]; 0: the simulation's choice

  std::optional<SyntheticPull> pull;  ///< where the object is released and no known weight held it

  std::vector<SyntheticCamera> cameras;
  std::optional<SyntheticCloud> cloud;
  std::optional<SyntheticMarkers> markers;
  struct HungLoad {
    Weight weight;
    std::string role = "fit";
  };
  std::vector<HungLoad> loads;
  std::vector<SyntheticPress> presses;
  std::vector<SyntheticIndentation> indentations;
  std::uint64_t seed = 1;
  bool write_trajectory = false;

  /// Mass over the surface's volume where the density was not given [kg/m^3].
  double true_density() const;
  /// Of `named_moduli`, or the one of all [Pa].
  std::vector<double> youngs_moduli() const;
  bool sags() const { return scene.object.shape_is == ShapeIs::Static; }
  /// Form of the law whose equilibria presses are, and where its numbers stand: that of `law`, or the linear one.
  LawLayout law_layout() const;
  /// Its numbers by `law_layout()`.
  VectorX law_parameters(const LawLayout& layout) const;
};

/// Reads a scene strictly. Throws InputError with every problem found, with file, line and column.
SyntheticScene read_synthetic_scene(const std::filesystem::path& path);

/// What a simulated scene did.
struct SceneMotion {
  std::optional<TrueShape> scan;                           ///< the pose in which it was scanned; nothing: stress-free
  std::vector<TrueShape> frames;                           ///< up to the start they show the object as it is held
  std::vector<std::vector<TrueShape>> camera_frames = {};  ///< as `Synthesis::camera_frames`
  std::vector<TrueShape> loads;                            ///< at rest under each load
  struct Pressed {
    TrueShape shape;
    Vector3 force, shift, axis;  ///< of the probe on the object [N], its way [m], into the object [-]
  };
  std::vector<Pressed> presses;
  struct Indented {
    Vector3 axis;
    std::vector<double> forces;  ///< [N], one a depth
  };
  std::vector<Indented> indentations;
};
using Simulate = std::function<SceneMotion(const SyntheticScene&)>;

/// Simulates a scene and makes a recording of it with the truth.
/// Throws std::invalid_argument where the motion has another number of frames, loads or presses than the scene.
Synthesis synthesise(const SyntheticScene& scene, const Simulate& simulate);

}  // namespace pliant
