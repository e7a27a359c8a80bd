#pragma once

#include "estimation/objective.hpp"
#include "estimation/press_scene.hpp"

namespace pliant {

/// theta of a pressed object: the first control modulus and Poisson's ratio where every theta has them, then the first
/// term's exponent, of each further term its exponent and how stiff it is against the first, mu_i / mu_1, and at the
/// end the other control moduli. All terms share Poisson's ratio.
struct PressTheta {
  int controls = 1, terms = 1;  ///< terms is 0 for the linear law
  int modulus(int k) const { return theta::modulus(k, controls, size()); }
  static int poissons_ratio() { return theta::poissons_ratio; }
  static int exponent(int term) { return 2 + (term == 0 ? 0 : 2 * term - 1); }
  static int ratio(int term) { return exponent(term) + 1; }  ///< of a term but the first
  int shapes() const { return terms == 0 ? 0 : 2 * terms - 1; }
  int size() const { return 2 + shapes() + controls - 1; }
};

/// The parameters of a law for presses: moduli "youngs_modulus" (or "youngs_modulus@1" ...), "poisson_ratio",
/// "exponent@1", "exponent@2", "stiffness_ratio@2", ... at start values.
ParameterSet press_parameters(const Body& body, const std::vector<std::string>& modulus_names, int terms,
                              double youngs_modulus);

/// The law of all elements for theta.
std::shared_ptr<const TabulatedLaw> press_law(const Body& body, const PressTheta& layout, const VectorX& theta);

/// dq / dtheta of one element's parameters q (rows as the law has them), for its own modulus E [Pa] in the place of the
/// control moduli: columns ln E, nu, then the law's shape as in theta.
MatrixX press_table_derivative(const PressTheta& layout, const VectorX& theta, double E);

struct PressObjectiveOptions {
  double noise = 0.0;          ///< deviation of a coordinate [m], > 0
  double outlier_scale = 0.0;  ///< residuals beyond this many deviations count less (pseudo-Huber), > 0
};

/// Cost of presses: over points' coordinates, half the square of where the simulation has them less where they were
/// seen over the noise, robust beyond `outlier_scale`; and the priors. Each press is one "frame" of the evaluation.
/// Derivatives are those of the equilibria, by the exact Hessian at each: a back-substitution a parameter and press.
/// Presses are solved side by side, each from its last equilibrium.
class PressObjective : public CostFunction {
 public:
  /// @param presses  numbers of those that take part
  PressObjective(std::shared_ptr<const PressScene> scene, std::vector<int> presses, const PressTheta& layout,
                 ParameterSet parameters, const PressObjectiveOptions& options);

  const ParameterSet& parameters() const override { return parameters_; }
  [[nodiscard]] CostEvaluation evaluate(const VectorX& p) override { return run(p, false); }
  [[nodiscard]] CostEvaluation linearise(const VectorX& p) override { return run(p, true); }
  [[nodiscard]] CostEvaluation gradient(const VectorX& p) override { return run(p, true); }

  void set_options(const PressObjectiveOptions& options) { options_ = options; }
  /// All residuals of the last evaluation [m], three a point; for the noise.
  std::vector<double> residuals() const;

 private:
  CostEvaluation run(const VectorX& p, bool with_derivatives);
  void add_press(std::size_t i, const MatrixX& by_p, bool with_derivatives, FrameFit& fit, std::string& failure);

  std::shared_ptr<const PressScene> scene_;
  std::vector<int> presses_;
  PressTheta layout_;
  ParameterSet parameters_;
  PressObjectiveOptions options_;
  std::vector<PressedBody> bodies_;
  std::vector<Points> residuals_;
  VectorX theta_;
};

}  // namespace pliant
