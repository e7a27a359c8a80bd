#pragma once

#include <optional>

#include "motion/rigid_contact.hpp"

namespace pliant {

enum class ProbeKind {
  GluedDisc,  ///< sticks to the surface that it covers; neither slides nor tilts
  Punch,      ///< a flat end that slides
  Ball,       ///< slides
};

/// A probe that touches the object at rest.
struct ProbeOptions {
  ProbeKind kind = ProbeKind::GluedDisc;
  Vector3 centre = Vector3::Zero();  ///< where it touches the surface [m]
  double radius = 0.0;               ///< [m], > 0
  /// Unit, into the object; nothing: against the surface's normal there.
  std::optional<Vector3> axis;
};

/// The probe's axis [-], unit, into the object.
Vector3 probe_axis(const Body& body, const ProbeOptions& probe);

/// The contact of a probe with a body of tetrahedra. All constants of probes' contacts stand in its source: whatever
/// fits a press and whatever predicts one meets the object alike.
/// @param youngs_modulus  about which the contact is stiff [Pa]: the object's mean
/// Throws InputError where the probe is glued and covers nothing of the object, std::invalid_argument for hexahedra.
RigidContact probe_contact(const Body& body, const ProbeOptions& probe, double youngs_modulus);

/// Stiffness [Pa/m] of a disc's glue on elements of some edge [m]. Faces that a disc covers in part would follow it as
/// a whole were it much stiffer, as if it were wider by about half an edge, or held what is held; softer by much, the
/// disc would sink in. At ten times the stiffness of a layer of elements both are small.
double glued_stiffness(double youngs_modulus, double edge);

/// Mean edge of a body's tetrahedra [m], as if they were regular.
double mean_edge(const Body& body);

}  // namespace pliant
