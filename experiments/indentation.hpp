#pragma once

#include <vector>

#include "estimation/press_objective.hpp"

namespace pliant {

/// A ball that is pushed into an object, and the force that was measured.
struct Indentation {
  Vector3 touch;               ///< on the undeformed surface [m]
  Vector3 normal;              ///< out of the object, unit
  double radius = 0.0;         ///< of the ball [m]
  std::vector<double> depths;  ///< along the normal, growing [m]
  std::vector<double> forces;  ///< along the normal [N], as many
  double noise = 0.0;          ///< deviation of a force [N], > 0
};

/// Balls on one body, each by itself: equilibria with the ball led by position.
class Indenter {
 public:
  /// @param modulus  [Pa] about which contacts are stiff
  Indenter(std::shared_ptr<const Body> body, const std::vector<int>& held, const Indentation& indentation,
           std::shared_ptr<const MaterialLaw> law, double modulus);

  void set_law(std::shared_ptr<const MaterialLaw> law) { equilibrium_.set_law(std::move(law)); }
  /// To equilibrium at one depth, from where it was last or from the depth before. False: `failure` says why.
  bool solve(std::size_t depth);
  const std::string& failure() const { return equilibrium_.failure(); }
  /// Along the normal, on the ball [N].
  double force(std::size_t depth) const;
  /// d force / d theta at the last solved depth.
  bool derivatives(std::size_t depth, const LawLayout& layout, const VectorX& theta, VectorX& by_theta);

 private:
  std::shared_ptr<const Body> body_;
  Indentation indentation_;
  Equilibrium equilibrium_;
  std::vector<Placement> placements_;
};

/// Forces of a ball at its depths: half the squares of simulated less measured force over its standard deviation.
class IndentationTrial : public Trial {
 public:
  /// @param reference  parameters whose modulus says how stiff the contact is
  /// @param number     what its frame calls it
  IndentationTrial(const Indentation& indentation, const std::vector<int>& held,
                   std::shared_ptr<PressedMaterial> material, const VectorX& reference, int number);

  [[nodiscard]] CostEvaluation run(const VectorX& theta, const MatrixX& directions) override;
  [[nodiscard]] CostEvaluation gradient(const VectorX& theta, VectorX& theta_bar) override;
  /// At each depth of the last run [N].
  const std::vector<double>& forces() const { return forces_; }

 private:
  Indentation indentation_;
  std::shared_ptr<PressedMaterial> material_;
  int number_;
  Indenter indenter_;
  std::vector<double> forces_;
};

/// Trials of indentations of one body.
/// @param reference  parameters whose modulus says how stiff contacts are
std::vector<std::unique_ptr<Trial>> indentation_trials(const std::shared_ptr<const Body>& body,
                                                       const std::vector<int>& held,
                                                       const std::vector<Indentation>& indentations,
                                                       const LawLayout& layout, const VectorX& reference);

}  // namespace pliant
