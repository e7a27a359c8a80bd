#pragma once

#include "motion/contact_defaults.hpp"
#include "motion/equilibrium.hpp"

namespace pliant {

struct PressSessionOptions {
  std::vector<int> held;                 ///< nodes; as many as hold the object
  Points dead_load;                      ///< nodal forces [N]; empty: none
  std::vector<RigidContact> inner = {};  ///< rigid bodies that stay where they are: a skull, a table
  /// A millionth of the forces is left: far below what a picture or a force sensor shows.
  EquilibriumOptions equilibrium = {.tolerance = 1e-6, .reuse_factor = true};
};

/// An object and a probe, led interactively: each call goes on from the last equilibrium with the factorisation at
/// hand, so that small moves take two or three cheap iterations. For one thread.
class PressSession {
 public:
  /// Throws InputError where the probe touches nothing.
  PressSession(std::shared_ptr<const Body> body, std::shared_ptr<const MaterialLaw> law, const ProbeOptions& probe,
               const PressSessionOptions& options);

  /// To the equilibrium with the probe that far from where it touches [m], or where it exerts that force [N] (a
  /// sliding one along its axis alone). Not converged: the last equilibrium stays, and `failure` says why.
  SolveSummary move_to(const Vector3& displacement);
  SolveSummary push(const Vector3& force);

  const Points& nodes() const { return placement_.nodes; }  ///< n x 3 [m]
  Vector3 displacement() const { return placement_.translations.row(0).transpose(); }
  Vector3 force() const { return equilibrium_.contact_force(0, placement_); }  ///< of the probe on the object [N]
  const std::string& failure() const { return equilibrium_.failure(); }
  Equilibrium& equilibrium() { return equilibrium_; }

 private:
  SolveSummary solve(const ProbeControl& control);
  ProbeOptions probe_;
  Equilibrium equilibrium_;
  Placement placement_;
};

/// Points of a finer surface that follow a coarse mesh by moving least squares (Kaufmann et al. 2008): the deformation
/// about each is the affine one that fits the nodes nearby best, weighted by a smooth bump; so a surface stays smooth
/// across elements' borders, and affine deformations are followed exactly.
class SurfaceFollower {
 public:
  /// @param rest  points at rest [m]
  SurfaceFollower(const Body& body, const std::vector<Vector3>& rest);
  int point_count() const { return int(start_.size()) - 1; }
  /// m x 3 for node positions n x 3 [m].
  [[nodiscard]] Points positions(const Points& nodes) const;

 private:
  std::vector<int> start_, node_;
  std::vector<double> weight_;  // of each node in each point: they sum to one and reproduce affine maps
};

/// Gravity's nodal forces [N], n x 3.
Points weight_of(const Body& body, double density, const Vector3& gravity);

}  // namespace pliant
