#pragma once

#include <map>
#include <optional>
#include <string>

#include "estimation/optimiser.hpp"
#include "estimation/problem.hpp"

namespace pliant {

/// How the stress-free reference configuration of an object scanned as it sags is coupled with its material.
enum class LoadFreeScheme {
  Monolithic,  ///< derivatives pass through the equilibrium: one minimisation sees the whole dependence
  Staggered,   ///< shape and parameters in turns, each as the other is (Wang 2015, algorithm 1)
};

/// What a fit compares the simulated motion with, where only points on the surface were seen.
enum class TrackingUse {
  Automatic,  ///< both, where point clouds or several cameras saw the object move; else none
  Off,        ///< the points, by surface constraints (Weiss 2020)
  Loop,       ///< the motion that the tracker found, in turns with it (Wang 2015, section 3)
  Both,       ///< each from a part of the frames; the one that predicts the others better is kept
};

/// What an object is taken to be made of.
enum class MaterialKind {
  Automatic,   ///< neo-Hookean where it moves or hangs, Ogden's law where it is pressed alone
  Linear,      ///< one E and nu for all strains
  NeoHookean,  ///< neo-Hookean by Young's modulus and Poisson's ratio
  Ogden,       ///< one smooth law of a few terms, its modulus a field: fitted to all that was seen at once
  Sampled,     ///< presses alone: the stiffness of each, interpolated in strain space (Bickel 2009)
};

/// In which elements and steps an object is simulated.
struct DiscretisationOptions {
  double cells = 12.0;        ///< elements along the object's longest axis, [4, 64]
  double coarse_cells = 8.0;  ///< of the grid that finds the neighbourhood, [4, 64]
  double steps = 1.0;         ///< time steps per default step, (0, 16]
  /// Left out: hexahedra, or quadratic tetrahedra where it follows from the fit where the object is stress-free.
  std::optional<ElementKind> element;
  double newmark_theta = 0.51;  ///< [0.5, 1)
  Integrator integrator = Integrator::Lagged;
  SolverKind solver = SolverKind::Automatic;
  double solver_tolerance = 1e-8;  ///< (0, 1)
  bool hold_strongly = false;      ///< eliminate nodes in held regions instead of Nitsche's method
};

/// How the minimum is looked for.
struct SearchOptions {
  int points_per_frame = 1000;  ///< >= 10: an even subset of the pixels; 0: all
  int scan_per_decade = 3;      ///< values of Young's modulus tried in each decade, >= 1
  int starts = 3;               ///< best ones of the scan that are followed, >= 1
  int most_starts = 7;          ///< with those that are drawn as long as the best one is not good, >= 1
  int max_iterations = 25;      ///< of each stage of the optimiser, >= 1
  double wide_band = 0.12;      ///< outlier scale of the coarse stages, times the object's size, (0, 0.5)
  double fine_band = 0.05;      ///< of the last stage, (0, 0.5)
  OptimiserKind optimiser = OptimiserKind::LevenbergMarquardt;
  LoadFreeScheme load_free = LoadFreeScheme::Monolithic;
  TrackingUse tracking = TrackingUse::Off;
  int tracking_rounds = 3;  ///< of tracking and estimation in turns, at most, 1..10
};

/// What is taken into the model, and how much of what was recorded is held against it.
struct HypothesisOptions {
  MaterialKind material = MaterialKind::Automatic;
  StiffnessDamping damping = StiffnessDamping::KelvinVoigt;  ///< how stiffness damping acts at large strain
  /// Of Ogden's law, 1..3; 0: one where the object moves, else as many as the presses support.
  int law_terms = 0;
  /// The law of an object that moves or hangs; none: corotated linear elasticity.
  std::optional<LawForm> law_of_motion() const;
  /// Of Young's modulus, where the capture names no regions; >= 1, 1: homogeneous; `automatic`: as many as the
  /// recordings support.
  /// `unsaid`: automatic where points of the surface of an object that is held and swings are fitted, and in a fit of
  /// points that is made beside the tracked motion's; else 1.
  int control_points = unsaid;
  static constexpr int automatic = 0, unsaid = -1;
  int controls() const { return control_points < 1 ? 1 : control_points; }  ///< where there is no choice to make
  /// Prior deviation of ln E between two points of the object as far apart as it is long, (0, 10]; control points only.
  double modulus_variation = 1.5;
  FieldOptions::Weights control_weights = FieldOptions::Weights::Linear;
  /// Of presses with known force: with a law of their own each, 1..12; 0: as many as the presses support.
  int law_zones = 0;
  double basis_tolerance = 0.02;  ///< of a sampled material's stress, > 0
  int basis_samples = 12;         ///< of a sampled material, an element, >= 1
  /// Part of each recording that is compared, from where it begins, (0, 1]; 0: all of it, or the part that the model
  /// explains where the object meets obstacles (`ExplainedSpan`).
  double span = 0.0;
  int pull_points = 4;     ///< that hold a released object until it is let go, at most, 1..50; see `pull_places`
  int scan_points = 0;     ///< about which the scan may err, 0..50; 0: its errors are not estimated
  double scan_std = 0.01;  ///< by how much, times the object's size, (0, 0.2]
  /// Whether a correction of sensors or of gravity's direction is estimated where the residuals ask for it.
  bool correct = true;
};

/// How it is found out how sure an estimate is.
struct JudgementOptions {
  /// Whether the estimate is tried under other models, and their part added to its deviations.
  bool alternatives = true;
  int refine = 1;  ///< resolutions at which the estimate is made, 1..3
  /// Minutes that the fit may take on two cores of a laptop, counted in steps, with repetitions on finer meshes, made
  /// as long as the mesh's part in the uncertainty of a modulus is more than half of the noise's; 0: none. Where
  /// `refine` is 1, alternatives are tried, and no tracking takes turns with the fit.
  double budget = 1.0;
  double marker_noise = 0.0;  ///< of a coordinate under presses [m]; 0: what the residuals say
};

/// Choices about a fit; none of them is needed. `validate` answers in words.
struct FitOptions : DiscretisationOptions, SearchOptions, HypothesisOptions, JudgementOptions {
  /// By parameter name: a start value (a number, or three), and whether it is estimated.
  struct Override {
    std::optional<VectorX> start;
    std::optional<bool> estimated;
    std::optional<double> prior_std;  ///< of the logarithm, logit or scaled vector
  };
  std::map<std::string, Override> parameters;

  /// What is wrong with the options; empty: nothing.
  std::string validate() const;
};

}  // namespace pliant
