#pragma once

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
  /// To equilibrium at one depth, from where it was last or from the depth before. False: `failure` says why.
  bool solve(std::size_t depth);
  const std::string& failure() const { return equilibrium_.failure(); }
  /// One a depth; without nodes where none was found.
  const std::vector<Placement>& placements() const { return placements_; }
  void begin_from(const std::vector<Placement>& placements) { placements_ = placements; }
  /// Force of the probe on the object along its axis [N].
  double force(std::size_t depth) const;
  /// Derivative of that force by theta at a depth that was solved. False where the equilibrium is not stable.
  bool force_derivative(std::size_t depth, const PressedMaterial& material, const VectorX& theta, VectorX& by_theta);

 private:
  std::vector<double> depths_;
  Vector3 axis_;
  Equilibrium equilibrium_;
  std::vector<Placement> placements_;
};

/// Force-depth curve: half the squares of simulated less measured force over its standard deviation, one frame a depth.
/// Derivatives are those of the equilibrium, by one back-substitution a depth for any number of parameters.
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

  int indentation_;
  IndentedBody body_;
};

}  // namespace pliant
