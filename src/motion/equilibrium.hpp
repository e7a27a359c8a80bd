#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "elasticity/law_elasticity.hpp"
#include "motion/newton.hpp"
#include "motion/rigid_contact.hpp"
#include "solvers/linear_solver.hpp"

namespace pliant {

/// Control of a rigid body: by force or by displacement.
struct ProbeControl {
  enum class Kind {
    Force,     ///< its translation is unknown: where the object balances `force`
    Position,  ///< it is at `translation`
  };
  Kind kind = Kind::Force;
  Vector3 force = Vector3::Zero();        ///< [N], of the rigid body on the object
  Vector3 translation = Vector3::Zero();  ///< [m]; under force control along an axis: of the line
  /// Unit: under force control the body keeps to a line along it, as a linear guide does. Nothing: unconstrained.
  std::optional<Vector3> axis;
};

/// Where the object's nodes and the rigid bodies are.
struct Placement {
  Points nodes;         ///< n x 3 [m]
  Points translations;  ///< one row a rigid body [m]
};

struct EquilibriumOptions {
  double tolerance = 1e-9;  ///< of the forces that are left, relative to those that meet, (0, 1)
  int max_iterations = 60;  ///< of Newton's method, a step of the load; >= 1
  int max_halvings = 8;     ///< of the load's steps, where Newton's method does not follow
  /// Keep the last factorisation while conjugate gradients with it solve Newton's system in a few iterations: for many
  /// equilibria that follow each other closely.
  bool reuse_factor = false;
};

/// The object at rest under dead loads and rigid bodies: the minimum of
///   W(x) - f . x + sum over rigid bodies (potential of the contact - F . u)
/// over nodes x and the translations u of bodies under force control (`Statics`). Loads that Newton's method does not
/// follow at once are applied in steps (`LoadContinuation`: incremental loading, Bickel 2009, section 3.4), each to
/// full convergence. One instance for one thread.
class Equilibrium {
 public:
  /// @param held  nodes that stay where a placement has them; there must be enough to hold the object
  Equilibrium(std::shared_ptr<const Body> body, std::shared_ptr<const MaterialLaw> law, std::vector<int> held,
              std::vector<RigidContact> contacts, const EquilibriumOptions& options = {});
  ~Equilibrium();
  Equilibrium(Equilibrium&&) noexcept;

  const Body& body() const;
  int contact_count() const;
  const RigidContact& contact(int i) const;
  void set_law(std::shared_ptr<const MaterialLaw> law);
  /// Forces on nodes [N], n x 3: the weight, for one. None at the beginning.
  void set_dead_load(Points forces);
  void set_control(int contact, const ProbeControl& control);
  /// Turns a rigid body, see `RigidContact::turn`.
  void turn(int contact, const Matrix3& rotation, const Vector3& centre);

  /// Nodes stress-free and rigid bodies where they are led to.
  Placement rest() const;
  /// From one placement to the equilibrium under the controls; a near placement takes fewer iterations. Not converged:
  /// the placement is the best that was reached.
  SolveSummary solve(Placement& placement);
  const std::string& failure() const;  ///< of the last solve, in words

  /// Elastic energy, that of contacts, and of all with the loads' potential [J], at the last placement.
  struct Energies {
    double elastic = 0.0, contact = 0.0, total = 0.0;
  };
  const Energies& energies() const;
  /// Force of a rigid body on the object [N].
  Vector3 contact_force(int contact, const Placement& placement) const;
  LawElasticity& elasticity();
  /// The same where the last `solve` that converged or `prepare_derivatives` has evaluated it, with tangents.
  const LawElasticity& elasticity() const;

  /// Factorises the exact Hessian at an equilibrium, for the two calls below. False where it is not positive definite:
  /// the equilibrium is not stable, or nothing holds the object.
  [[nodiscard]] bool prepare_derivatives(const Placement& placement);
  /// Change of the placement for a change of the forces on nodes and rigid bodies, (n + contacts) x 3 [N]: H^-1 f, with
  /// zeros for what is held. It is its own adjoint.
  const Points& response(const Points& forces);
  /// The same of several changes together, which costs less than one by one. In: of the forces; out: of the placement.
  void respond(std::span<Points> changes);

 private:
  class Solver;
  std::unique_ptr<Solver> solver_;
};

}  // namespace pliant
