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
struct SyntheticScene {
  std::string name;
  Scene scene;  ///< surface stress-free, where the object is at the start; exactly one of mass and density
  std::vector<double> plane_half_sizes;  ///< [m] of each plane: half the edge of the square that cameras see; 0: none
  double scan_noise = 0.0;               ///< [m] deviation of the vertices of rest.ply along their normals

  double youngs_modulus = 0.0;      ///< [Pa], outside of all regions; where there are no control points
  std::vector<double> part_moduli;  ///< [Pa] of each region or control point
  double poissons_ratio = 0.0;
  double mass_damping = 0.0;       ///< Rayleigh [1/s]
  double stiffness_damping = 0.0;  ///< [s]
  bool is_corotated = false;       ///< the elements' mean strain is linear in the rotated frame, not neo-Hookean
  bool is_rayleigh = false;        ///< stiffness damping is Rayleigh's, not Kelvin and Voigt's

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
  /// Of `named_moduli`, or the one of all [Pa].
  std::vector<double> youngs_moduli() const;
};

/// Reads a scene strictly. Throws InputError with every problem found, with file, line and column.
SyntheticScene read_synthetic_scene(const std::filesystem::path& path);

/// Vertices of the scene's surface in each frame, n x 3 [m]; frames up to the start show the object as it is held.
using Simulate = std::function<std::vector<Points>(const SyntheticScene&)>;

/// Simulates a scene and makes a recording of it with the truth.
Synthesis synthesise(const SyntheticScene& scene, const Simulate& simulate);

}  // namespace pliant
