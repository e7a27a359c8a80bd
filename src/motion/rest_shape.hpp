#pragma once

#include <memory>
#include <string>
#include <vector>

#include "elasticity/material.hpp"
#include "motion/body_forces.hpp"
#include "motion/reference_shape.hpp"

namespace pliant {

/// How a scan errs: a smooth displacement field about it. Beforehand it is a Gaussian process whose covariance falls
/// off with the square of the distance over `length`, as wide in every direction, and that is zero where the object is
/// held; its values at a few points, whitened, are the unknowns.
struct ShapeField {
  std::vector<Vector3> points;                    ///< in the scan [m]; none: the scan is exact
  double standard_deviation = 0.0, length = 0.0;  ///< [m], > 0
};

/// The field's displacement at each node for a unit unknown, n x points [m]: u = basis zeta, zeta independent standard
/// normal numbers. Held nodes do not move.
/// Throws std::invalid_argument where lengths are not positive.
MatrixX shape_basis(const Body& body, const ShapeField& field, const std::vector<int>& held);

/// Where a body stands in its scan, and where its nodes are stress-free, as functions of theta: both are the scan with
/// its correction; or, for a scan of an object that sags, the latter is the shape whose elasticity holds the former in
/// equilibrium (Wang 2015, eq. 7), and depends on all of its material and load too. With the derivatives of both.
class RestShape {
 public:
  /// @param body    as scanned, of tetrahedra
  /// @param held    nodes that stay where the scan has them
  /// @param sags    whether the scan was taken under gravity and these weights
  /// @param basis   see `shape_basis`; no columns: the scan is exact
  /// @param blocks  of the correction, one a column of the basis, and of the load
  /// @param material  of the body
  RestShape(std::shared_ptr<const Body> body, const std::vector<int>& held, bool sags,
            const std::vector<PointMass>& weights, MatrixX basis, const MotionBlocks& blocks, const Material& material);

  /// Finds them for theta, from those found last; at once where nothing that they depend on has changed. Empty, or
  /// why there are none.
  [[nodiscard]] std::string find(const VectorX& theta);
  /// Looks for them from those that another of the same body found last.
  void begin_from(const RestShape& other) { last_found_ = other.last_found_; }
  const Points& scan() const { return scan_; }  ///< n x 3 [m]
  /// The body, stress-free where it was found to be.
  const std::shared_ptr<const Body>& body() const { return free_; }

  /// Makes ready for the derivatives below, at what was found last. False where a matrix cannot be factorised.
  [[nodiscard]] bool prepare_derivatives();
  /// Changes of where the nodes were in the scan and where they are stress-free, for a change of theta.
  Points scan_tangent(const VectorX& d_theta) const;
  Points reference_tangent(const VectorX& d_theta, const Points& d_scan);
  /// theta_bar += the cotangent for those of the two.
  void adjoint(const Points& scan_bar, const Points& reference_bar, VectorX& theta_bar);

 private:
  std::shared_ptr<const Body> body_, free_;
  std::shared_ptr<const Body> last_found_;  // null: none yet
  std::vector<int> held_;
  bool sags_;
  MatrixX basis_;
  MotionBlocks blocks_;
  std::unique_ptr<ReferenceShapeSolver> solver_;   // where it sags
  std::unique_ptr<Elasticity> elasticity_;         // likewise
  std::vector<std::unique_ptr<ForceTerm>> terms_;  // what acts on the scan but elasticity
  std::vector<ParameterHandle> depends_on_;        // of theta
  VectorX theta_;                                  // of what was found
  bool has_derivatives_ = false;                   // of that
  Points scan_;
};

}  // namespace pliant
