#pragma once

#include "estimation/objective.hpp"
#include "estimation/press_trial.hpp"
#include "estimation/verdict.hpp"

namespace pliant {

/// Trials of the curves and grips to fit of a scene.
/// @param recording  what their frames call it (`FrameFit::recording`)
std::vector<std::unique_ptr<Trial>> static_test_trials(const std::shared_ptr<const PressScene>& scene,
                                                       const std::shared_ptr<PressedMaterial>& material,
                                                       const ParameterSet& parameters, int recording);

/// An object under static tests, those of its presses that take part, by their numbers, and its curves and grips to
/// fit.
struct TestedSpecimen {
  std::shared_ptr<const PressScene> scene;
  std::vector<int> presses;
};

/// How well each kind of measurement of the static tests to fit is met; nothing where the evaluation failed. A press'
/// residuals count over its own greatest displacement, those of grips over the greatest of their kind.
/// @param evaluation    of a `PressObjective` of the specimens
/// @param marker_noise  of a coordinate of presses' markers [m]; 0: what neighbouring markers scatter
std::vector<Agreement> agreements_of(const std::vector<TestedSpecimen>& specimens, const CostEvaluation& evaluation,
                                     double marker_noise = 0.0);

/// The objective of presses, and of the curves and grips to fit, of one object or several: one trial each, presses
/// first, all of one material, whose form can change. Frames have the number of their specimen
/// (`FrameFit::recording`).
class PressObjective {
 public:
  /// Equilibria of all trials that have any.
  using Placements = std::vector<std::vector<Placement>>;
  /// @param begin  of another objective of the same presses, curves and grips, that equilibria set out from; or none
  PressObjective(const std::vector<TestedSpecimen>& specimens, const LawLayout& layout, ParameterSet parameters,
                 const PressTrialOptions& options, const Placements& begin = {});
  /// Of one specimen.
  PressObjective(const std::shared_ptr<const PressScene>& scene, const std::vector<int>& presses,
                 const LawLayout& layout, ParameterSet parameters, const PressTrialOptions& options)
      : PressObjective({{scene, presses}}, layout, std::move(parameters), options) {}

  Objective& cost() { return objective_; }
  [[nodiscard]] CostEvaluation evaluate(const VectorX& p) { return objective_.evaluate(p); }
  [[nodiscard]] CostEvaluation linearise(const VectorX& p) { return objective_.linearise(p); }

  /// Goes on with another form of the law, from the equilibria where it is.
  /// @param body  that of the first specimen, but for its modulus field
  void set_form(std::shared_ptr<const Body> body, const LawLayout& layout, ParameterSet parameters);
  void set_options(const PressTrialOptions& options);
  /// Of the last evaluation.
  Placements placements() const;
  /// All residuals of the presses' points at the last evaluation [m], three a point.
  std::vector<double> residuals() const;
  /// The noise that these residuals show (`robust_noise`).
  MarkerNoise own_noise(double least) const;
  /// Geometric mean of the deviations that residuals are weighed by [m]; 0 where there are no presses.
  double typical_deviation() const;
  /// Sum of the squares of the residuals, each by the typical deviation over its own [m^2]: n/2 times its logarithm is
  /// what the likelihood with the best scale of these deviations has, less what depends on n alone.
  double weighed_squares() const;

 private:
  std::vector<std::shared_ptr<PressedMaterial>> materials_;  // of each specimen
  std::vector<PressTrial*> trials_;                          // the objective's
  std::vector<EquilibriumTrial*> at_rest_;                   // these, and those of curves and grips
  std::vector<CurveTrial*> curves_;                          // likewise
  Objective objective_;
};

}  // namespace pliant
