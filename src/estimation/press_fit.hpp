#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimation/fit.hpp"
#include "estimation/law_zones.hpp"
#include "estimation/press_objective.hpp"
#include "estimation/sample_fit.hpp"

namespace pliant {

struct PressFitOptions {
  PressMaterial material = PressMaterial::Ogden;
  double cells = 12.0;                   ///< elements along the object's longest axis
  bool quadratic = false;                ///< elements; else linear
  int terms = 0;                         ///< of Ogden's law, 1..3; 0: as many as the presses support
  int zones = 0;                         ///< with a law of their own each, 1..12; 0: as many as they support
  int control_points = 0;                ///< of Young's modulus, where there are no zones; 0: as many as they support
  double modulus_variation = 1.5;        ///< prior deviation of ln E between points an object's length apart
  double noise = 0.0;                    ///< of a coordinate [m]; 0: what the residuals say
  int max_iterations = 25;               ///< of the optimiser, each stage
  std::optional<double> poissons_ratio;  ///< known; nothing: estimated
  BasisOptions basis;                    ///< of the sampled material
  std::string validate() const;
};

/// Those of a fit's choices that concern presses.
PressFitOptions press_options(const FitOptions& options);

/// One form of the law that was fitted.
struct TriedLaw {
  LawForm form;
  double cost = 0.0;      ///< infinite where it cannot be fitted
  double evidence = 0.0;  ///< for it against the best before: fall of half the BIC for terms, ln of the Bayes factor
                          ///< for zones and control points
  bool kept = false;
};

/// Where a fit of presses stands, to go on after an interruption.
struct PressFitState {
  struct Done {
    LawForm form;
    std::vector<ZoneCut> cuts;
    VectorX theta;
    double cost = 0.0, evidence = 0.0, noise = 0.0;
    bool kept = false;
  };
  std::vector<Done> done;            ///< forms that were tried, in order
  OptimiserState under_way;          ///< of the next; p is empty: not begun
  std::vector<ZoneCut> cuts;         ///< of its zones
  std::vector<PressSample> samples;  ///< of the sampled material: presses that are done, in order
};

struct PressFitEvent {
  /// "linear", "1 term", "2 terms", "2 terms apart", "3 zones", "a law a region", "8 control points", "press 3"
  std::string stage;
  int iteration = 0;                    ///< begins again where noise or cuts change; of cuts that are only tried too
  double cost = 0.0, marker_rms = 0.0;  ///< [-], [m]
  double youngs_modulus = 0.0;          ///< [Pa], the mean
};

struct PressFitMonitor {
  std::function<void(const PressFitEvent&)> on_event;
  std::function<void(const PressFitState&)> on_state;
  std::function<bool()> interrupted;
};

struct PressFitOutcome {
  std::shared_ptr<const PressScene> scene;
  std::shared_ptr<const MaterialLaw> law;
  LawLayout layout;
  ParameterSet parameters;  ///< with the reference at the estimate
  VectorX theta, std;       ///< std of each unconstrained number
  MatrixX covariance, correlation;
  CostEvaluation evaluation;
  double start_cost = 0.0, noise = 0.0;  ///< where this form of the law began, with that noise [-]; [m]
  std::vector<Vector3> control_points;
  std::vector<ZoneCut> cuts;  ///< of the zones, one after the other
  std::vector<TriedLaw> tried;
  std::vector<PressFitEvent> history;
  std::optional<SampledMaterial> sampled;  ///< with `samples`, one a press that was fitted
  std::vector<PressSample> samples;
  std::vector<PressPrediction> predictions;  ///< of all presses, tests too
  bool succeeded = false, converged = false, interrupted = false;
  std::string reason;
  std::vector<std::string> notes;
};

/// Estimates an object's material from presses with known force: Ogden's law of one term from the stiffness of a punch
/// on a half space, more terms, and Poisson's ratios of their own for them, as long as the Bayesian information
/// criterion falls; then zones of laws of their own, cut one after the other where that promises most, as long as the
/// evidence supports them (`log_bayes_factor`) and each takes three per cent off the squares of the residuals, or,
/// where a capture names regions, a law for each of them; and where no zone is kept, control points of Young's modulus
/// by their evidence. The noise is what the residuals say, robustly. For a sampled material the law of one term is what
/// each press's field is smooth about.
/// Throws InputError where the capture has no presses to fit or cannot be fitted.
PressFitOutcome fit_presses(const Capture& capture, const PressFitOptions& options, const PressFitMonitor& monitor = {},
                            PressFitState resume = {});

}  // namespace pliant
