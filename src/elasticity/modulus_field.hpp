#pragma once

#include <functional>

#include "elasticity/body.hpp"

namespace pliant {

/// Where the control moduli of a field stand; empty for regions.
struct ControlledField {
  ModulusField field;
  std::vector<Vector3> points;  ///< rest positions [m], one a control
};

/// `count` control points evenly spread along an axis through the body, from end to end; weights are linear in between.
/// @param axis  unit; count >= 1
ControlledField linear_field(const Body& body, const Vector3& axis, int count);

/// Weights that are harmonic on the body's mesh: 1 at their own control point's node, 0 at the others', and Laplace's
/// equation (by linear elements' stiffness for tetrahedra, the graph's for hexahedra) in between.
/// Throws InputError where two points share their nearest node.
ControlledField harmonic_field(const Body& body, const std::vector<Vector3>& points);

/// Weights by inverse square distance (Shepard 1968) from the elements' centres.
ControlledField inverse_distance_field(const Body& body, const std::vector<Vector3>& points);

/// Weights that are given at points of the object, over all of it: harmonic in between, and near the points what they
/// say (each row of weights divided by its sum).
/// @param points   [m] at rest
/// @param weights  points x controls, >= 0, none of a row's sums 0
ControlledField extended_field(const Body& body, const std::vector<Vector3>& points, const MatrixX& weights);

/// One modulus a region and, first, one for what is in none. An element on a border mixes by how many of its sample
/// points lie on either side; where regions overlap, the later one wins.
ControlledField region_field(const Body& body, const std::vector<std::function<bool(const Vector3&)>>& regions);

/// Points spread over the body so that each next one is farthest from all before, beginning at the one farthest from
/// the centre of mass.
std::vector<Vector3> farthest_points(const Body& body, int count);

/// Mean of an element's nodes at rest [m].
Vector3 element_centre(const Body& body, int element);

}  // namespace pliant
