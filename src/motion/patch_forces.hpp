#pragma once

#include <functional>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "geometry/key_frames.hpp"
#include "motion/body_forces.hpp"

namespace pliant {

/// Points of the object on which a hand or a load acts, and the share of each: they sum to one.
struct Patch {
  std::vector<Vector3> rest;  ///< [m], where the body's nodes are at rest
  std::vector<double> share;
};

/// The surface within a radius [m] of a point, by area with a smooth edge; the nearest sample alone where the radius
/// holds none.
Patch surface_patch(const Body& body, const Vector3& centre, double radius);

/// What of the body lies in a region at rest, as points of equal springs: of hexahedra points throughout their part
/// inside, by its volume; of tetrahedra, which follow the shape, the nodes.
struct RegionPatch {
  Patch patch;
  double volume = 0.0;  ///< [m^3]; 0: nothing of the body lies there, and there are no points
};
RegionPatch region_patch(const Body& body, const std::function<bool(const Vector3&)>& contains);

struct LedSpringsOptions {
  double stiffness = 0.0;                     ///< of all springs together [N/m], > 0
  std::vector<ParameterHandle> moduli = {};   ///< where there are any, the stiffness is times their geometric mean [Pa]
  KeyedMotion motion;                         ///< of what grips
  double from = -infinite, until = infinite;  ///< when it takes hold and lets go [s]
  /// Where springs are without force: where the points are as it takes hold, carried along with the motion from then
  /// on; or, `from_rest`, where they rest, moved by the whole motion.
  bool from_rest = false;
  /// What takes hold pulls the points' middle to the motion's shift, a place [m] then, from wherever they are.
  bool reaches = false;
};

/// A hand, a finger or a led clamp: springs from points of the object to where a rigid motion over time leads them,
///   f(z) = -k sum_i s_i (z_i - target_i).
/// Stiff springs lead a region of the object; soft ones are a hand that gives.
class LedSprings : public ForceTerm {
 public:
  /// Throws std::invalid_argument for no points, or a stiffness that is not positive.
  LedSprings(const Body& body, const Patch& patch, LedSpringsOptions options);

  const Embedding& points() const { return points_; }
  bool holds() const { return holds_; }
  /// On the object, for node positions in the step at hand [N].
  Vector3 force(const Points& z) const;
  /// Of a grip that reaches for a place: another place [m].
  void move_to(const Vector3& place);
  /// Where it would have the points' middle in the step at hand, and where that is for node positions [m].
  Vector3 place() const;
  Vector3 middle(const Points& z) const;

  Lag lag() const override { return Lag::Rotation; }
  At at() const override { return At::End; }
  void set_parameters(const VectorX& theta) override;
  void begin_step(const StepContext& step) override;
  void linearise(const Points&) override {}
  void add_force(const Points& z, Points& force) override;
  void add_matrix(double scale, BlockMatrix& matrix) override;
  std::optional<double> potential(const Points& x) override;
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

 private:
  void take_hold(const Points& positions, double time);
  double stiffness(int point) const { return stiffness_ * share_[std::size_t(point)]; }
  Vector3 way(int point, const Points& z) const { return points_.position(point, z) - target_[std::size_t(point)]; }

  LedSpringsOptions options_;
  double stiffness_ = 0.0;      // for the parameters at hand [N/m]
  std::vector<double> moduli_;  // the same [Pa]
  Embedding points_;
  std::vector<double> share_;
  std::shared_ptr<const std::vector<int>> blocks_;
  std::vector<Vector3> rest_, anchor_, target_;  // anchors: where points were when it took hold [m]
  double took_hold_ = infinite;                  // [s]; infinite: it did not yet
  bool holds_ = false;
};

/// A force that a user applies to a patch of the object: strength times f(t), shared among the patch's points.
class PatchLoad : public DeadLoad {
 public:
  /// @param strength  1, a factor [-] in the parameter vector; may not exist: one
  PatchLoad(const Body& body, const Patch& patch, KeyFrames<3> force, const ParameterHandle& strength = {});

  void set_parameters(const VectorX& theta) override { factor_ = strength_.exists() ? theta[strength_] : 1.0; }
  void begin_step(const StepContext& step) override { now_ = force_over_time_.at(step.time + 0.5 * step.dt); }
  void add_force(const Points&, Points& force) override { spread(factor_ * now_, force); }
  void add_force_tangent(const Points& z, const Points& d_lag, const Points& d_z, const VectorX& d_theta,
                         Points& force) override;
  void add_force_adjoint(const Points& z, const Points& w, Points& lag_bar, Points& z_bar, VectorX& theta_bar) override;

 private:
  void spread(const Vector3& force, Points& out) const;

  Embedding points_;
  std::vector<double> share_;
  KeyFrames<3> force_over_time_;
  ParameterHandle strength_;
  Vector3 now_ = Vector3::Zero();  // [N]
  double factor_ = 1.0;
};

}  // namespace pliant
