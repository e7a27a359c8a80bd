#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "elasticity/body.hpp"
#include "model/model.hpp"
#include "simulation/small_motions.hpp"

namespace pliant {

/// A model as other programs take it: tetrahedra, each with a modulus for small strains, what is held, and gravity.
struct ExportModel {
  std::string name;
  std::shared_ptr<const Body> body;  ///< linear or quadratic tetrahedra, stress-free
  std::vector<double> moduli;        ///< Young's modulus [Pa], one an element
  double poissons_ratio = 0.0;       ///< of these elements; a smaller one than the model's where those would lock
  double density = 0.0;              ///< [kg/m^3]
  double mass_damping = 0.0, stiffness_damping = 0.0;  ///< Rayleigh's [1/s], [s]
  Vector3 gravity = Vector3::Zero();                   ///< [m/s^2]
  std::vector<int> held;                               ///< nodes, in order

  /// What moduli were multiplied by, so that the first frequency is the model's: other elements are stiffer or softer.
  double identified = 1.0;
  SmallMotions model, exported;    ///< on the model's own elements, and on these
  double stiffest = 0.0;           ///< [rad/s] highest frequency of these with lumped masses, linear elements alone
  std::vector<std::string> notes;  ///< what is left out or told otherwise
  std::string card;                ///< `card_of`, JSON; empty before `write_export`

  bool is_quadratic() const { return body->kind == ElementKind::QuadraticTetrahedron; }
  /// Of each node [kg]: its share of the elements' masses.
  std::vector<double> lumped_masses() const;
};

/// The model with the elements that a format takes. Moduli are identified anew: all are multiplied by one number, the
/// ratio of the squared first frequencies of the model's own elements and of the new ones, which is exact, since
/// squared frequencies are proportional to the modulus. Linear elements that the model does not have itself lock: flat
/// ones are mended (flat_elements.hpp), Poisson's ratio is lowered while that brings the further frequencies closer,
/// and meshes are laid ever finer until six frequencies agree within 2 %, or there would be more than 8,000 nodes. A
/// note says what is left.
/// @param kind   linear or quadratic tetrahedra
/// @param cells  along the object's longest axis, of a mesh laid anew (`model_body`); the model's own where left out
///               2 to 300
/// Throws InputError where the model cannot be simulated, no node of the new elements is held, or `cells` is beyond its
/// range.
ExportModel export_model(const Model& model, ElementKind kind, std::optional<double> cells = std::nullopt);

/// Elements by modulus: whole groups where there are no more different ones than `most`, else steps of the logarithm.
struct ModulusGroups {
  std::vector<double> moduli;  ///< [Pa] of each group
  std::vector<int> group;      ///< of each element
};
ModulusGroups grouped_moduli(const std::vector<double>& moduli, int most);

}  // namespace pliant
