#pragma once

#include "estimation/press_trial.hpp"
#include "estimation/static_tests.hpp"

namespace pliant {

/// A body between grips: some nodes are held, others are moved.
class GrippedBody {
 public:
  GrippedBody(const PressScene& scene, const ObservedGrip& test, const std::shared_ptr<const MaterialLaw>& law);

  void set_law(std::shared_ptr<const MaterialLaw> law) { equilibrium_.set_law(std::move(law)); }
  /// To equilibrium, from where it was last or else from rest by steps of the displacement. False: `failure` says why.
  bool solve();
  /// The same, from a guess at first.
  bool solve_from(const Placement& guess);
  const std::string& failure() const { return equilibrium_.failure(); }
  /// Without nodes where none was found.
  const Placement& placement() const { return placement_; }
  void begin_from(const Placement& placement) { placement_ = placement; }
  /// Force of the grip on the object along the test's direction [N], at the last equilibrium.
  double force() const;
  /// Simulated places of the test's markers [m], one row each.
  Points markers() const { return markers_.positions(placement_.nodes); }
  const Embedding& embedding() const { return markers_; }

  /// Ready for the calls below. False where the equilibrium is not stable.
  [[nodiscard]] bool prepare_derivatives();
  /// Change of the nodes for a change of the forces on them: see `Equilibrium::response`.
  [[nodiscard]] Points response(const Points& forces);
  /// The same of several changes together, which costs less than one by one, with those of inner bodies below.
  [[nodiscard]] std::vector<Points> responses(std::vector<Points> forces);
  /// Change of the measured force for a change of the nodes that are free [N/m], one row a node.
  const Points& force_by_nodes() const { return force_by_nodes_; }
  /// The measured force's direction at the nodes that are moved, zero elsewhere.
  const Points& direction() const { return direction_; }
  /// At the last equilibrium.
  const LawElasticity& elasticity() const { return equilibrium_.elasticity(); }

 private:
  bool lead(double part);
  /// Where the grip takes all nodes, to first order [m].
  Points linear_way();
  /// The elastic energy's Hessian where derivatives were prepared [N/m], times a change of the nodes.
  Points stiffness_times(const Points& change) const;
  Points internal_forces() const;

  std::shared_ptr<const Body> body_;
  const ObservedGrip test_;
  Equilibrium equilibrium_;
  Embedding markers_;
  Points dead_load_, direction_, force_by_nodes_;
  Placement placement_;
};

/// Measurement between grips: half the squares of the grip's simulated less measured force, and of the markers' places
/// in the directions in which they were measured, over their standard deviations. Derivatives are those of the
/// equilibrium: a back-substitution a parameter, or one for all by the adjoint. Runs set out as those of presses do.
class GripTrial : public EquilibriumTrial {
 public:
  /// @param number  what its frame calls it (`FrameFit::recording`)
  GripTrial(std::shared_ptr<const PressScene> scene, int grip, std::shared_ptr<PressedMaterial> material,
            const VectorX& reference, int number = 0);

  [[nodiscard]] CostEvaluation run(const VectorX& theta, const MatrixX& directions) override;
  [[nodiscard]] CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override;
  [[nodiscard]] std::vector<Placement> placements() const override { return {body_.placement()}; }
  void begin_from(const std::vector<Placement>& placements) override { body_.begin_from(placements.front()); }

 private:
  const ObservedGrip& test() const;
  /// The equilibrium and its cost. `off` are the markers' errors over their standard deviation, `pull` the force's.
  bool compare(const VectorX& theta, CostEvaluation& result, Points& off, double& pull);

  int grip_;
  GrippedBody body_;
  LinearisedEquilibrium linearised_;
};

}  // namespace pliant
