#pragma once

#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "motion/rigid_shape.hpp"

namespace pliant {

/// Points of an object's surface with areas, as finely spread as a contact asks for.
struct ContactSamples {
  std::vector<Vector3> rest;  ///< [m]
  std::vector<double> area;   ///< [m^2]
};

/// The boundary of a body of tetrahedra, every face cut into n^2 equal triangles, one sample each.
/// Throws std::invalid_argument for hexahedra.
ContactSamples boundary_samples(const Body& body, int cuts);

/// Those that a flat disc on the undeformed surface covers: within `radius` [m] of `centre`, where the surface faces
/// the same way as there. Cut so that a disc of any size covers some hundreds.
ContactSamples disc_samples(const Body& body, const Vector3& centre, double radius);

/// A rigid body that moves without turning, and what it does to an object: a potential of each sample's place x
/// relative to the rigid body's translation u [m]:
///   glued:    k a |x - X - u|^2 / 2: samples neither slide nor lift off (stiff springs), so that a disc stays flat
///   sliding:  a psi(d(x - u)): a pressure that grows from 0 at distance s by k a metre of depth, smoothly over 2 s,
///             along the gradient of the signed distance: no friction.
class RigidContact {
 public:
  /// @param stiffness  k [Pa/m]
  static RigidContact glued(const Body& body, const ContactSamples& samples, double stiffness);
  /// @param smoothing  s [m], > 0
  static RigidContact sliding(const Body& body, const ContactSamples& samples, std::shared_ptr<const RigidShape> shape,
                              double stiffness, double smoothing);

  const Embedding& points() const { return points_; }
  bool is_glued() const { return !shape_; }
  /// Of the samples' areas [m^2].
  double area() const;

  /// Energy [J] of one sample at y = x - u, its gradient and its Hessian by y (or that without its negative part).
  struct Potential {
    double energy = 0.0;
    Vector3 gradient = Vector3::Zero();
    Matrix3 hessian = Matrix3::Zero();
  };
  [[nodiscard]] Potential potential(int sample, const Vector3& y, bool positive) const;
  /// Force of the rigid body on the object [N], for node positions and its translation.
  [[nodiscard]] Vector3 force(const Points& nodes, const Vector3& translation) const;

 private:
  RigidContact(const Body& body, const ContactSamples& samples);
  Embedding points_;
  std::vector<Vector3> rest_;
  std::vector<double> area_;
  std::shared_ptr<const RigidShape> shape_;
  double stiffness_ = 0.0, smoothing_ = 0.0;
};

}  // namespace pliant
