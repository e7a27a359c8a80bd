#pragma once

#include <array>
#include <span>
#include <vector>

#include "elasticity/body.hpp"
#include "geometry/camera.hpp"
#include "geometry/triangle_mesh.hpp"
#include "mismatch/sensor_correction.hpp"

namespace pliant {

/// A point of the object's outline in a picture.
struct OutlinePoint {
  Vector2 pixel;   ///< where a lens that does not bend would show it
  Vector2 normal;  ///< unit, in the picture, away from the object
};

/// The outline of the object as a camera without depth saw it at one instant.
struct OutlineObservation {
  PinholeCamera camera;  ///< as it stood, with a lens that does not bend
  std::vector<OutlinePoint> points;
  double noise;    ///< standard deviation of a point across the outline, at the object [m], > 0
  double pixel;    ///< size of one at the object [m], > 0
  int sensor = 0;  ///< whose correction applies
};

/// The same with its camera where a correction puts it, and less the outline's error.
OutlineObservation corrected(OutlineObservation outline, const SensorCorrection& correction);

/// The place of the deformed surface's occluding contour that is nearest to a measured ray.
struct OutlineMatch {
  bool is_found = false;          ///< whether a contour whose normal agrees lies within reach
  double distance = 0.0;          ///< from it to the ray [m], positive where the ray passes outside
  Vector3 direction;              ///< d distance = direction . d contour, and the ray's is - direction
  std::array<int, 2> vertices;    ///< ends of the contour's edge, of the surface that `OutlineConstraints` follows
  std::array<double, 2> weights;  ///< of both
  Vector3 seen;                   ///< the ray's place next to the contour, in the camera's axes [m]
  Vector3 outwards;               ///< its change for a metre of the outline's error, in the camera's axes
};

/// Outlines against the occluding contour of the deformed surface: rays through the measured outline should graze it.
/// The contour is made of the surface's edges between a triangle that faces the camera and one that does not, as far as
/// they bound the projection: the pixel beyond is not covered. It is found anew for each shape, and with it which edge
/// is next to a ray. That changes no distance at first order, since the contour slides along the ray there: distances
/// are continuous, and their derivatives are those of the distance from the ray to the edge as it moves with the body.
/// Parts of the contour that no measured outline is near to cost nothing.
class OutlineConstraints {
 public:
  /// @param surface  of the object at rest, closed and outwards; it moves with the body
  /// @param spacing  [m] > 0; `subdivided` to that, so that flat sides can bend
  /// @param reach    [m] > 0; a contour farther than that from a ray is not near
  OutlineConstraints(const Body& body, const TriangleMesh& surface, double spacing, double reach);

  /// Matches each point of an outline against node positions (n x 3). Safe to call from several threads.
  /// Throws std::invalid_argument where the camera's lens bends.
  [[nodiscard]] std::vector<OutlineMatch> match(const OutlineObservation& seen, const Points& positions) const;

  /// Changes of the distances, one a column, for changes of the node positions (n x 3 each); 0 where nothing is near.
  [[nodiscard]] MatrixX tangents(const std::vector<OutlineMatch>& matches, std::span<const Points> d_positions) const;

  /// positions_bar (n x 3) += the cotangent for one of the distances.
  void add_adjoint(const std::vector<OutlineMatch>& matches, const VectorX& distance_bar, Points& positions_bar) const;

 private:
  /// An edge of the surface, and the triangles on both of its sides.
  struct Edge {
    std::array<int, 2> vertices, triangles;
  };
  /// A place of the outer contour in the picture.
  struct ContourPoint {
    Vector2 pixel, normal;
    int edge;
  };
  std::vector<ContourPoint> outer_contour(const PinholeCamera& camera, const std::vector<Vector3>& vertices) const;

  TriangleMesh surface_;
  Embedding embedding_;  // of the surface's vertices
  double reach_;
  std::vector<Edge> edges_;
};

}  // namespace pliant
