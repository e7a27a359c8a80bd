#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "synthesis/synthesis.hpp"

namespace pliant {

/// A situation to simulate and to record: the format "scene/1" of docs/scene.md. SI units.
struct Scene {
  std::string name;
  TriangleMesh surface;  ///< free of load, in the world, where the object is at the start [m]
  double scan_noise = 0.0;
  std::optional<double> mass, density;  ///< exactly one of them

  double youngs_modulus = 0.0, poisson_ratio = 0.0;
  double mass_damping = 0.0;       ///< Rayleigh [1/s]
  double stiffness_damping = 0.0;  ///< Rayleigh [s]

  Vector3 gravity = Vector3::Zero();
  std::vector<SceneryPlane> planes;
  std::vector<FixedRegion> fixed;
  Initial initial;

  double frame_rate = 0.0;
  int frames = 0, start_frame = 0;

  double cell_size = 0.0;  ///< [m]
  int substeps = 4;        ///< time steps a frame
  double newmark_theta = 0.5;
  double contact_stiffness = 0.0;  ///< [Pa/m]; 0: the simulation's choice
  double contact_smoothing = 0.0;  ///< [m]; 0: the simulation's choice

  std::vector<SyntheticCamera> cameras;
  std::uint64_t seed = 1;
  bool write_trajectory = false;

  /// Mass over the surface's volume where the density was not given [kg/m^3].
  double true_density() const;
};

/// Reads a scene strictly. Throws InputError with every problem found, with file, line and column.
Scene read_scene(const std::filesystem::path& path);

/// Vertices of the scene's surface in each frame (n x 3, `scene.frames` of them; those up to start_frame at rest).
using Simulate = std::function<std::vector<Points>(const Scene&)>;

/// Simulates a scene and makes a recording of it with the truth.
Synthesis synthesise(const Scene& scene, const Simulate& simulate);

}  // namespace pliant
