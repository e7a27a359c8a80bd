#pragma once

#include <memory>
#include <span>

#include "elasticity/body.hpp"
#include "mismatch/displacement_extension.hpp"
#include "mismatch/sensor_correction.hpp"

namespace pliant {

/// A point that a sensor saw on the object, with its standard deviation.
struct SurfaceObservation {
  Vector3 position;  ///< [m], world
  double noise;      ///< [m], > 0
  int sensor = 0;    ///< whose correction applies
  Sight sight = {};  ///< how that sensor sees it
};

/// One observed point pulled back through the motion to the shape at rest.
struct PointMatch {
  int cell = -1;                  ///< of the band; -1: in no deformed cell
  double distance = 0.0;          ///< phi_0(x') [m], rest metric, negative inside
  double stretch = 1.0;           ///< |d phi / dx|: distance / stretch is the distance to the deformed surface
  Vector3 direction;              ///< d phi = direction . sum_a w_a dg_a
  std::array<double, 8> weights;  ///< w_a, of the cell's nodes
};

/// Sparse surface constraints (Weiss 2020, section 4.2): observed points are pulled back through the deformed cells of
/// the band and should lie on the surface at rest, where the signed distance vanishes.
class SurfaceConstraints {
 public:
  /// @param band       [m] how far points may lie from the surface and still be matched
  /// @param cell_size  [m] of the lattice that carries the motion into the band, > 0; a body of hexahedra uses its own
  SurfaceConstraints(std::shared_ptr<const Body> body, std::shared_ptr<const SignedDistance> distance, double band,
                     double cell_size = 0.0);

  const DisplacementExtension& extension() const { return extension_; }
  double band() const { return extension_.band(); }

  /// Matches points against node positions (n x 3). A point in several cells (self-intersection) takes the smallest
  /// |distance|. Cells are found by a bounding-volume tree over the deformed cells. Safe to call from several threads.
  [[nodiscard]] std::vector<PointMatch> match(std::span<const SurfaceObservation> points,
                                              const Points& positions) const;

  /// Changes of the distances, one a column, for changes of the node positions (n x 3 each); 0 for unmatched points.
  [[nodiscard]] MatrixX tangents(const std::vector<PointMatch>& matches, std::span<const Points> d_positions) const;

  /// Cotangent of the node positions (n x 3) for one of the distances.
  [[nodiscard]] Points adjoint(const std::vector<PointMatch>& matches, const VectorX& distance_bar) const;

 private:
  /// g = E u for the body's nodes, and its transpose.
  Points extended(const Points& u) const;
  Points extended_transpose(const Points& g) const;
  bool pull_back(int cell, const Points& lattice, const Vector3& point, Vector3& local, Matrix3& jacobian) const;

  std::shared_ptr<const Body> body_;
  std::shared_ptr<const SignedDistance> distance_;
  std::shared_ptr<const HexGrid> grid_;
  Embedding lattice_in_body_;  // of the grid's nodes; empty where they are the body's own
  DisplacementExtension extension_;
};

/// Half the robust square of a distance with an outlier scale c, Tukey's biweight: quadratic near zero, constant c^2/6
/// beyond c, twice continuously differentiable in between. Points outside the band cost that constant, so that they can
/// never lower the cost by leaving.
struct RobustLoss {
  double scale;                  ///< c [m]
  double value(double r) const;  ///< [m^2]
  double derivative(double r) const { return r * weight(r); }
  double weight(double r) const;  ///< derivative / r
  double outlier() const { return scale * scale / 6.0; }
};

}  // namespace pliant
