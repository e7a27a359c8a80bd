#pragma once

#include "estimation/problem.hpp"
#include "motion/reference_shape.hpp"

namespace pliant {

/// An object whose scan was taken as it sags, with the shape that it has free of load.
struct LoadFree {
  Discretisation scene;       ///< at rest under its load; the body's reference is the shape that was found
  ReferenceShape shape;       ///< of the body's nodes
  TriangleMesh surface;       ///< the scan free of load [m]
  Points sagged_again;        ///< nodes of that body at rest under the load [m]; they should be the scan's
  double re_sag_error = 0.0;  ///< greatest distance of the two [m]
  double sag = 0.0;           ///< greatest way of a node from free of load to the scan [m]
};

/// Finds it for a material, and lets it sag again.
/// @param capture     that names what holds the object; nothing of it moves here
/// @param resolution  of tetrahedra
/// @param theta       of the capture at rest: `default_parameters` of `at_rest`
/// Throws InputError where nothing holds the object, or the resolution is one of hexahedra.
LoadFree find_load_free(const Capture& capture, const Resolution& resolution, const VectorX& theta,
                        const ReferenceShapeOptions& options = {});

/// The capture without its motion: what hangs or stands still as it was scanned.
Capture at_rest(const Capture& capture);

}  // namespace pliant
