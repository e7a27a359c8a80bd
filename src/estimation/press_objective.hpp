#pragma once

#include <algorithm>

#include "estimation/objective.hpp"
#include "estimation/press_scene.hpp"

namespace pliant {

/// theta of a pressed object: the first control modulus; then, of every law that the object has, the first term's
/// Poisson's ratio and exponent, and of each further term its exponent, how stiff it is against the first, mu_i / mu_1,
/// and its Poisson's ratio; at the end the other control moduli. One law may serve all control moduli, or each has its
/// own: then its numbers are mixed like ln E, by the weights of the body's `ModulusField` (stiffness ratios in the
/// logarithm, the others as they are).
struct PressTheta {
  int controls = 1, terms = 1;  ///< terms is 0 for the linear law
  int laws = 1;                 ///< 1 or as many as controls
  bool own_ratios = false;      ///< whether the terms' Poisson's ratios are estimated each, or as one
  int modulus(int k) const { return theta::modulus(k, controls, size()); }
  int poissons_ratio(int law = 0) const { return 1 + law * law_size(); }
  int exponent(int term, int law = 0) const { return poissons_ratio(law) + (term == 0 ? 1 : 3 * term - 1); }
  int stiffness_ratio(int term, int law = 0) const { return exponent(term, law) + 1; }  ///< of a term but the first
  int poissons_ratio_of(int term, int law) const { return term == 0 ? poissons_ratio(law) : exponent(term, law) + 2; }
  int law_size() const { return terms == 0 ? 1 : 3 * terms - 1; }
  int size() const { return 1 + laws * law_size() + controls - 1; }
  /// Numbers of a law that are estimated.
  int law_freedom() const { return law_size() - (own_ratios ? 0 : std::max(0, terms - 1)); }
  bool operator==(const PressTheta&) const = default;
  /// That of one element by itself: of its modulus and its law.
  PressTheta of_element() const { return {1, terms, 1, own_ratios}; }
};

/// The numbers of one element in theta: its modulus [Pa] and its law, as `PressTheta::of_element` orders them.
VectorX element_theta(const Body& body, const PressTheta& layout, const VectorX& theta, int element);

/// How much of a number in theta goes into one of an element's own.
struct ThetaShare {
  int own, at;   ///< which of `element_theta`, which of theta
  double share;  ///< d own / d theta; of ln E for the modulus
};
std::vector<ThetaShare> element_theta_shares(const Body& body, const PressTheta& layout, const VectorX& theta,
                                             const VectorX& own, int element);

/// The parameters of a law for presses: moduli "youngs_modulus" (or "youngs_modulus@1" ...), "poisson_ratio",
/// "exponent_1", "exponent_2", "stiffness_ratio_2", "poisson_ratio_2" (where terms have their own), ... at start
/// values; where every control has its own law, with the "@1" of its modulus.
ParameterSet press_parameters(const PressTheta& layout, const std::vector<std::string>& modulus_names,
                              double youngs_modulus);

/// The law of all elements for theta.
std::shared_ptr<const TabulatedLaw> press_law(const Body& body, const PressTheta& layout, const VectorX& theta);

/// dq / dtheta of one element's parameters q (rows as the law has them).
/// @param own  its numbers, as `element_theta` gives them
/// @return     columns ln E, then the law as in theta
MatrixX press_table_derivative(int terms, const VectorX& own);

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

  /// Goes on with another form of the law, from the equilibria where it is.
  /// @param scene  the same but for the body's modulus field
  void set_form(std::shared_ptr<const PressScene> scene, const PressTheta& layout, ParameterSet parameters);
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
