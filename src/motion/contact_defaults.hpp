#pragma once

#include <optional>

#include "motion/rigid_contact.hpp"

namespace pliant {

// All constants of contacts stand in this header's source: whatever fits a recording and whatever predicts one meets
// the object alike.

/// Penalty of contact that suits an object of this size and weight: its weight on its projected area presses it in by
/// 1e-4 of its size, and contact sets in over 1e-3 of it: the smallest that steps of the default length resolve. Softer
/// contact lets the object hover and rebound more than a rigid floor does.
/// @param mass     of the object [kg]
/// @param gravity  [m/s^2]
Penalty default_contact(const Body& body, double mass, double gravity);
/// Its stiffness alone [Pa/m].
/// @param weight  of the object [N]
/// @param area    of its surface [m^2]
/// @param size    of the object [m]
double default_contact_stiffness(double weight, double area, double size);

/// Speed below which friction fades to nothing [m/s]: that of a fall by a ten-thousandth of the object's size.
double default_friction_speed(const Body& body, double gravity);

enum class ProbeKind {
  BondedDisc,  ///< sticks to the surface that it covers; neither slides nor tilts
  Punch,       ///< a flat end that slides
  Ball,        ///< slides
  Capsule,     ///< a rod with round ends that lies on the surface; slides
  Shape,       ///< any rigid body, where it is; slides
};

/// A probe that touches the object at rest.
struct ProbeOptions {
  ProbeKind kind = ProbeKind::BondedDisc;
  Vector3 centre = Vector3::Zero();  ///< where it touches the surface [m]
  double radius = 0.0;               ///< [m], > 0
  /// Unit, into the object; nothing: against the surface's normal there.
  std::optional<Vector3> axis;
  /// Of a capsule, from the centre of one end to that of the other [m].
  Vector3 rod = Vector3::Zero();
  /// Of a shape; `centre` then is the point about which it turns, `radius` that of its finest parts.
  std::shared_ptr<const RigidShape> shape = nullptr;
};

/// The probe's axis [-], unit, into the object.
Vector3 probe_axis(const Body& body, const ProbeOptions& probe);

/// The contact of a probe with a body of tetrahedra.
/// @param youngs_modulus  about which the contact is stiff [Pa]: the object's mean
/// Throws InputError where the probe is bonded and covers nothing of the object, std::invalid_argument for hexahedra.
RigidContact probe_contact(const Body& body, const ProbeOptions& probe, double youngs_modulus);

/// The contact of a body that slides on a rigid body inside or under it. Only what faces it can touch it,
/// and what touches it at rest is not pressed there.
/// @param youngs_modulus  about which the contact is stiff [Pa]: the object's mean
/// Throws InputError where nothing of the object faces the body.
RigidContact inner_contact(const Body& body, std::shared_ptr<const RigidShape> shape, double youngs_modulus);

/// Stiffness [Pa/m] of a disc's bond on elements of some edge [m]. Faces that a disc covers in part would follow it as
/// a whole were it much stiffer, as if it were wider by about half an edge, or held what is held; softer by much, the
/// disc would sink in. At ten times the stiffness of a layer both are small, of linear elements: see `probe_contact`.
double bond_stiffness(double youngs_modulus, double edge);

/// Mean edge of a body's elements [m], as if they were regular.
double mean_edge(const Body& body);

}  // namespace pliant
