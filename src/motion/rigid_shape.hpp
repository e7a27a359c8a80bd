#pragma once

#include <memory>

#include "geometry/camera.hpp"
#include "geometry/signed_distance.hpp"

namespace pliant {

/// A rigid body as a signed distance [m], negative inside: a probe, a table, a skull under the skin.
class RigidShape {
 public:
  struct Sample {
    double distance;
    Vector3 gradient;  ///< unit where the surface is smooth
    Matrix3 hessian;   ///< [1/m]
  };
  virtual ~RigidShape() = default;
  [[nodiscard]] virtual Sample sample(const Vector3& point) const = 0;
};

/// All that lies behind a plane. @param normal  points out of the body
std::shared_ptr<const RigidShape> rigid_half_space(const Vector3& point, const Vector3& normal);
std::shared_ptr<const RigidShape> rigid_ball(const Vector3& centre, double radius);
/// A rod with round ends, from one point to another.
std::shared_ptr<const RigidShape> rigid_capsule(const Vector3& from, const Vector3& to, double radius);
/// A flat-ended cylinder without another end.
/// @param tip   middle of its flat end
/// @param axis  along which it points, out of that end
/// @param edge  radius by which the rim is rounded, in (0, radius]
std::shared_ptr<const RigidShape> rigid_punch(const Vector3& tip, const Vector3& axis, double radius, double edge);
/// Any closed mesh as its signed distance on a grid, or its outside (`hollow`: an object that lies in a mould).
/// Gradient and curvature are those of the interpolated distance: the gradient jumps a little from cell to cell.
std::shared_ptr<const RigidShape> rigid_grid(SignedDistance distance, bool hollow = false);
/// The same by cubic splines, with a gradient and a curvature that change smoothly: an equilibrium with much of the
/// surface on the body is found to the last digit, and its derivatives are exact.
std::shared_ptr<const RigidShape> rigid_smooth_grid(SignedDistance distance);
/// A box about a point, with edges rounded.
/// @param half    of its edges [m], > 0
/// @param edge    radius by which edges and corners are rounded [m], in (0, least half edge]
std::shared_ptr<const RigidShape> rigid_box(const Vector3& centre, const Vector3& half, double edge);
/// A shape after a rigid motion.
std::shared_ptr<const RigidShape> rigid_moved(std::shared_ptr<const RigidShape> shape, const RigidMotion& motion);

}  // namespace pliant
