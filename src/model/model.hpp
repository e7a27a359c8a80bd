#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "elasticity/material.hpp"
#include "model/vtu.hpp"
#include "scene/scene.hpp"

namespace pliant {

/// The volume mesh of a model, with its material.
struct ModelVolume {
  Points nodes;  ///< [m], n x 3, reference shape
  VtuCell kind = VtuCell::Hexahedron;
  std::vector<int> connectivity;           ///< points of each cell, in this program's order (see to_vtk_order)
  std::vector<double> youngs_modulus;      ///< [Pa], one a cell
  std::vector<double> youngs_modulus_std;  ///< one standard deviation [Pa], one a cell; empty: not known
  std::vector<double> poissons_ratio;      ///< one a cell
  std::vector<double> fill;                ///< part of the cell that the object fills, one a cell
};

/// A material of its own in the place of Young's modulus and Poisson's ratio, as a table (`material.csv`). What its
/// columns mean depends on the law: see docs/model.md.
struct ModelLaw {
  std::string name;                       ///< "ogden", "neo_hookean", "linear" or "sampled"
  std::vector<std::string> columns;       ///< the first is "element"
  std::vector<std::vector<double>> rows;  ///< as many numbers each
  std::string own_law = {};               ///< of a sampled law: that of each element, whose table the rows are
  /// Of a sampled law (`samples.csv`), as many numbers each as `sample_columns`.
  std::vector<std::vector<double>> samples = {};
  bool operator==(const ModelLaw&) const = default;
};

inline const std::vector<std::string> sample_columns = {"element",   "width",     "xx",        "yy",        "zz",
                                                        "xy",        "xz",        "yz",        "weight_xx", "weight_yy",
                                                        "weight_zz", "weight_xy", "weight_xz", "weight_yz"};

/// A fitted object, ready to be simulated. SI units, the capture's world frame.
struct Model {
  std::string name;
  /// Situation of the recording: the surface stress-free, mass and density both known, frames equally spaced; no
  /// frames: static.
  Scene scene;

  Material material;               ///< of the elements' mean strain, unless `law` is given
  double youngs_modulus = 0.0;     ///< [Pa] > 0; with fields: the volume-weighted mean
  double poissons_ratio = 0.0;     ///< (-1, 0.5)
  double mass_damping = 0.0;       ///< [1/s] >= 0
  double stiffness_damping = 0.0;  ///< [s] >= 0

  double cell_size = 0.0;                 ///< of the hexahedral grid [m] > 0
  Vector3 grid_origin = Vector3::Zero();  ///< lattice point (0, 0, 0) [m]
  int substeps = 1;                       ///< time steps a frame, >= 1
  double newmark_theta = 0.5;             ///< weight of a time step's end [0.5, 1]
  double contact_stiffness = 0.0;         ///< pressure by penetration [Pa/m] >= 0
  double contact_smoothing = 0.0;         ///< length over which contact sets in [m] >= 0

  std::optional<ModelLaw> law;  ///< at every quadrature point of tetrahedra; nothing: that of `material`
  ModelVolume volume;           ///< may be empty: then no `model.vtu` is written
};

/// Writes `model.toml` (with comments and units), `surface.ply` and `model.vtu` into a folder.
/// Throws std::invalid_argument where a field does not have one value a cell, InputError where a file cannot be
/// written.
void save_model(const std::filesystem::path& folder, const Model& model);

/// Reads a model by the path of its `model.toml`, strictly. Throws InputError with every problem found, with file, line
/// and column: unknown keys (and the nearest known one), missing files, numbers that are not finite or out of range,
/// a volume mesh without its fields.
Model load_model(const std::filesystem::path& path);

}  // namespace pliant
