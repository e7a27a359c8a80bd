#pragma once

#include "estimation/problem.hpp"
#include "motion/reference_shape.hpp"

namespace pliant {

/// An object whose scan was taken as it sags, with the shape that it has stress-free.
struct LoadFree {
  Discretisation scene;       ///< at rest under its load; the body's reference is the shape that was found
  ReferenceShape shape;       ///< of the body's nodes
  TriangleMesh surface;       ///< the scan stress-free [m]
  Points sagged_again;        ///< nodes of that body at rest under the load [m]; they should be the scan's
  double re_sag_error = 0.0;  ///< greatest distance of the two [m]
  double sag = 0.0;           ///< greatest way of a node from stress-free to the scan [m]
};

/// Finds it for a material, and lets it sag again.
/// @param capture     that names what holds the object; nothing of it moves here
/// @param resolution  of tetrahedra
/// @param blocks      of the capture at rest: `default_parameters` of `at_rest`
/// @param theta       by those blocks
/// Throws InputError where nothing holds the object, or the resolution is one of hexahedra.
LoadFree find_load_free(const Capture& capture, const Resolution& resolution, const CaptureBlocks& blocks,
                        const VectorX& theta, const ReferenceShapeOptions& options = {});

/// The Young's modulus [Pa] by which linear elasticity lets a held object sag by a part of its size under its own
/// weight, whichever way it lies: the largest of those for gravity along each axis. 0 where it has no weight.
/// @param theta  with the density, Poisson's ratio and gravity; its moduli stay in proportion
/// @param sag    [-] > 0, of the object's size
double modulus_of_sag(const std::shared_ptr<const Body>& body, const std::vector<Hold>& holds,
                      const MotionBlocks& blocks, VectorX theta, double sag);

/// A Young's modulus [Pa] that holds the scan of a sagging object up: the one by which linear elasticity lets it sag by
/// half its size, or, where that gives way, the first that does not as it is doubled again and again.
/// @param theta  with the density, Poisson's ratio and gravity; its moduli are scaled together
/// @param interrupted  may be empty; asked now and then
/// Throws InputError where none is found.
double carrying_modulus(const std::shared_ptr<const Body>& body, const SimulationOptions& scene, VectorX theta,
                        const std::function<bool()>& interrupted);

/// The capture without its motion: what hangs or stands still as it was scanned.
Capture at_rest(const Capture& capture);

}  // namespace pliant
