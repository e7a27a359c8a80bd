#pragma once

#include <optional>
#include <vector>

#include "estimation/law_derivatives.hpp"
#include "estimation/press_trial.hpp"
#include "estimation/static_tests.hpp"

namespace pliant {

/// One probe on a body, led by position along its axis to one depth after the other.
class IndentedBody {
 public:
  /// @param modulus  [Pa] about which the contact is stiff
  IndentedBody(const PressScene& scene, const ObservedIndentation& test, std::shared_ptr<const MaterialLaw> law,
               double modulus);

  void set_law(std::shared_ptr<const MaterialLaw> law) { equilibrium_.set_law(std::move(law)); }
  /// To equilibrium at one depth, from a guess, from where it was last or from the depth before. False: `failure` says
  /// why.
  bool solve(std::size_t depth, const std::optional<Placement>& guess = std::nullopt);
  const std::string& failure() const { return equilibrium_.failure(); }
  /// One a depth; without nodes where none was found.
  const std::vector<Placement>& placements() const { return placements_; }
  void begin_from(const std::vector<Placement>& placements) { placements_ = placements; }
  /// Force of the probe on the object along its axis [N].
  double force(std::size_t depth) const;
  /// Derivative of that force by theta at a depth that was solved, by the adjoint. False where the equilibrium is not
  /// stable.
  bool force_derivative(std::size_t depth, const PressedMaterial& material, const VectorX& theta, VectorX& by_theta);
  /// The same by each of the law's numbers, with how the nodes and then the rigid bodies change by it [m].
  bool force_derivatives(std::size_t depth, const PressedMaterial& material, const VectorX& theta,
                         const LawNumbers& numbers, VectorX& by_numbers, std::vector<Points>& changes);

 private:
  /// Change of the force for a change of the nodes, probe kept [N/m], one row a node.
  Points force_by_nodes(std::size_t depth) const;

  std::vector<double> depths_;
  Vector3 axis_;
  Equilibrium equilibrium_;
  std::vector<Placement> placements_;
};

/// An error that all depths of a curve have in common, as where the probe first touched is not exactly known: a length
/// of normal prior, by which forces change along the slope of the simulated curve. Fitted to each simulation anew, it
/// needs no place among the parameters.
class DepthOffset {
 public:
  /// @param std  [m] of the prior about zero; 0: depths are exact
  DepthOffset(const ForceCurve& curve, double std);

  bool is_unknown() const { return std_ > 0.0; }
  /// Finds the offset with which simulated forces come nearest to the measured ones.
  /// @param forces  [N] at the curve's depths
  void fit(const VectorX& forces);
  double value() const { return value_; }  ///< [m] that the probe is deeper than the curve says; 0 where exact
  const VectorX& slopes() const { return slopes_; }  ///< [N/m] of the simulated curve
  double prior_std() const { return std_; }
  /// Changes of the forces with the offset kept, by those at the curve's depths, both one row a depth: slopes change
  /// too.
  MatrixX with_offset(const MatrixX& changes) const;
  /// Change of the offset for such changes, one row.
  VectorX change(const MatrixX& changes) const;
  /// What a cotangent of forces with the offset is of those at the curve's depths.
  VectorX transposed(const VectorX& bar) const;

 private:
  const ForceCurve& curve_;
  double std_, value_ = 0.0;
  MatrixX slope_;  // of the forces at the curve's depths
  VectorX slopes_;
};

/// Force-depth curve: half the squares of simulated less measured force over its standard deviation, one frame a depth.
/// Derivatives are those of the equilibrium: a back-substitution a parameter, or one for all by the adjoint. Runs set
/// out as those of presses do. Where depths have an offset, costs are those with the best one, whose square over its
/// prior belongs to the last frame.
class IndentationTrial : public EquilibriumTrial {
 public:
  /// @param reference  parameters whose modulus says how stiff the contact is
  /// @param number     what its frames call it (`FrameFit::recording`)
  IndentationTrial(std::shared_ptr<const PressScene> scene, int indentation, std::shared_ptr<PressedMaterial> material,
                   const VectorX& reference, int number = 0);

  [[nodiscard]] CostEvaluation run(const VectorX& theta, const MatrixX& directions) override;
  [[nodiscard]] CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override;
  [[nodiscard]] double expected_work() const override;
  [[nodiscard]] std::vector<Placement> placements() const override { return body_.placements(); }
  void begin_from(const std::vector<Placement>& placements) override { body_.begin_from(placements); }

 private:
  const ObservedIndentation& test() const;
  void add_prior(const VectorX& offset_change, FrameFit& fit) const;

  int indentation_;
  IndentedBody body_;
  std::vector<LinearisedEquilibrium> linearised_;  // one a depth
  DepthOffset offset_;
};

}  // namespace pliant
