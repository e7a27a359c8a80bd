#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "geometry/key_frames.hpp"
#include "motion/contact_samples.hpp"
#include "motion/penalty.hpp"
#include "motion/rigid_shape.hpp"
#include "parameters/motion_blocks.hpp"

namespace pliant {

/// Contact of an object's surface with a rigid body: forces at samples of the surface, by where each is relative to the
/// rigid body, y = x - u, u the body's translation [m]:
///   bonded:   -k a (y - X): samples neither slide nor lift off (stiff springs), so that a disc stays flat
///   sliding:  a p(d(y)) n(y): the penalty's pressure p (`Penalty`; Weiss 2020, eq. 18, of one plane) along the
///   gradient
///             n of the signed distance d, with Coulomb friction where its coefficient mu is not zero:
///             -mu a p T w / sqrt(|T w|^2 + s^2), w the sample's way since the step's start, T = I - n n^T, and s the
///             way at the friction's regularisation speed.
/// The rigid body is any shape at a translation that is given (fixed or led) or unknown (a row below the nodes'), or a
/// plane out of the parameter vector (estimated).
///
/// The force during a step follows from the time derivative (Weiss 2020, eq. 19), taken further than the paper does: it
/// is made affine about the predicted positions, with its slope in the step's matrix, so that a fast impact is stopped
/// in the step in which it happens and stiff contact stays stable. The affine form's matrix leaves out what the shape's
/// curvature takes away; friction goes with the predicted pressure and way (lagged), so that the matrix stays symmetric
/// and positive. At rest nothing has slid: there is no friction.
class RigidContact : public ForceTerm {
 public:
  /// @param stiffness  k [Pa/m], > 0
  static RigidContact bonded(const Body& body, const ContactSamples& samples, double stiffness);
  /// Throws std::invalid_argument for a penalty without stiffness or smoothing.
  /// @param block  of the parameter vector, where friction and stiffness stand in it
  static RigidContact sliding(const Body& body, const ContactSamples& samples, std::shared_ptr<const RigidShape> shape,
                              const Penalty& penalty, const ContactBlock& block = {});
  /// A plane whose place, coefficient of friction and stiffness stand in the parameter vector.
  static RigidContact sliding(const Body& body, const ContactSamples& samples, const PlaneBlock& plane,
                              const Penalty& penalty);

  const Embedding& points() const { return points_; }
  bool is_bonded() const { return !shape_ && !plane_; }
  /// Area of all samples [m^2].
  double area() const;
  /// Samples on which the rigid body acts at the lag point.
  int active_count() const { return is_bonded() ? points_.point_count() : int(active_.size()); }

  /// Coulomb friction of a shape that no parameter block describes, and the regularisation of any.
  /// @param coefficient  mu [-], >= 0; where the parameter vector has one, it is that
  /// @param speed        below which friction fades to nothing [m/s], > 0
  void set_friction(double coefficient, double speed);
  /// The shape moves, and may turn, over time: in a step it is where it is when contact acts, and friction is with the
  /// way relative to it. Its translation stays zero. Throws std::invalid_argument for a bond or a plane of the
  /// parameter vector.
  void lead(KeyedMotion motion);
  /// The rigid body is turned about a point, which its translation then moves; bonded samples turn along. Throws
  /// std::invalid_argument for a plane of the parameter vector and for a shape that is led.
  void turn(const Matrix3& rotation, const Vector3& centre);
  /// What lies nearer at rest than pressure sets in touches there without pressure: elements cut corners of a curved
  /// body, and would be pressed by it in their stress-free shape. The gap of each sample counts from there.
  /// Throws std::invalid_argument for a bond or a plane of the parameter vector.
  void touch_at_rest();
  /// Where the rigid body is [m], unless its translation is unknown.
  void set_translation(const Vector3& translation) { translation_ = translation; }
  /// From now on the translation is unknown: this row of positions, forces and matrices.
  /// @param pattern  of the matrices to come, in which the row meets all nodes that a sample depends on
  void set_row(const Body& body, int row, const BlockPattern& pattern);

  Lag lag() const override { return Lag::Contact; }
  At at() const override { return At::Contact; }
  void set_parameters(const VectorX& theta) override;
  void begin_step(const StepContext& step) override;
  void linearise(const Points& lag) override;
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  void add_lag_matrix(const Points& z, double scale, BlockMatrix& matrix) override;
  std::optional<double> potential(const Points& x) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;
  bool sees_start() const override { return rubs(); }
  void add_start_tangent(const Points& z, const Points& d_start, const Points& d_start_velocity,
                         Points& force) override;
  void add_start_adjoint(const Points& z, const Points& w, Points& start_bar, Points& start_velocity_bar) override;

  /// Energy [J] of one sample at y = x - u, its gradient and its Hessian by y (or that without its negative part).
  struct Potential {
    double energy = 0.0;
    Vector3 gradient = Vector3::Zero();
    Matrix3 hessian = Matrix3::Zero();
  };
  [[nodiscard]] Potential potential(int sample, const Vector3& y, bool positive) const;
  /// Force of the rigid body on the object [N], without friction, for node positions and its translation.
  [[nodiscard]] Vector3 force(const Points& nodes, const Vector3& translation) const;

 private:
  /// A sample that is touched, about the lag point.
  struct Active {
    int point;
    Vector3 y, normal;
    double gap;                      // [m]
    double force, slope, curvature;  // a p(gap) and its derivatives by the gap
  };
  /// What curved shapes and friction add to that.
  struct Detail {
    Matrix3 bend = Matrix3::Zero();                          // of the distance: dn/dy
    Vector3 start = Vector3::Zero(), way = Vector3::Zero();  // y at the step's start, and T (y - start)
    double drag = 0.0, length = 1.0;                         // mu a p / length, length = sqrt(|way|^2 + s^2)
    Vector3 axis = Vector3::Zero();           // n / |n|: gradients of interpolated distances are no units
    double axis_way = 0.0, per_normal = 1.0;  // axis . (y - start), 1 / |n|
    /// Of the axis, for a change of n.
    Vector3 axis_change(const Vector3& d_normal) const { return per_normal * across(d_normal); }
    Vector3 across(const Vector3& v) const { return v - axis.dot(v) * axis; }  // T v
  };
  /// Of an active sample: z's offset from the lag point and from the start, tangential where it says so.
  struct Offsets {
    Vector3 q, slid;   // y_z - y, T (y_z - start)
    double c, normal;  // n . q, axis . (y_z - start)
  };
  RigidContact(const Body& body, const ContactSamples& samples);
  /// Whether there is a step in which friction acts, and whether it does with the coefficient at hand.
  bool may_rub() const;
  bool rubs() const { return friction_ > 0.0 && may_rub(); }
  /// Of the shape or plane, with the distance from which a sample's gap counts.
  RigidShape::Sample surface(int point, const Vector3& y) const;
  Vector3 relative(int point, const Points& positions) const;
  Vector3 relative_change(int point, const Points& changes) const;
  /// The transpose of `relative_change`.
  void scatter(int point, const Vector3& vector, Points& out) const;
  void scatter_block(int point, const Matrix3& block, BlockMatrix& matrix) const;
  Offsets offsets(const Active& c, const Detail& m, const Points& z) const;
  /// Adds an active sample.
  void touch(int point, const Vector3& y, double gap, const Vector3& normal);
  /// Adds what friction needs to a sample's details.
  void add_friction(const Active& c, Detail& m) const;
  /// Details of an active sample, with friction where there may be some.
  Detail detail(std::size_t i) const;
  template <class Visit>
  void for_bonded(Visit&& visit) const;

  Embedding points_;
  std::vector<Vector3> rest_, bond_;  // of samples [m]: at rest; where a turned bond would have them
  std::vector<double> area_;
  std::vector<double> overlap_;  // of samples [m]: less than nothing where they touch at rest; empty: none does
  std::shared_ptr<const std::vector<int>> blocks_;  // where each element's blocks go in the matrix
  std::shared_ptr<const RigidShape> shape_;
  std::optional<PlaneBlock> plane_;
  ContactBlock block_;
  Penalty penalty_;
  bool follows_stiffness_ = false;                                  // whether the penalty's stiffness is that of theta
  double friction_ = 0.0, friction_speed_ = 0.0, threshold_ = 0.0;  // threshold: s [m]
  Vector3 translation_ = Vector3::Zero(), plane_point_ = Vector3::Zero(), plane_normal_ = Vector3::UnitY();
  int row_ = -1, row_diagonal_ = -1;
  std::vector<int>
      links_;  // of each sample's nodes: blocks (node, row), then (row, node); -1 for those that weigh nothing
  const Points* start_ = nullptr;
  std::shared_ptr<const RigidShape> led_shape_;    // before its motion; null: it is not led
  std::shared_ptr<const RigidShape> first_shape_;  // before it was turned; null: it was not
  KeyedMotion motion_;
  RigidMotion carried_;  // by the motion within the step; friction is with the way beyond that
  std::vector<Active> active_;
  std::vector<Detail> details_;  // of the active samples; empty for a smooth plane
};

}  // namespace pliant
