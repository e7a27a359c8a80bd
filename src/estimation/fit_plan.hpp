#pragma once

#include <optional>
#include <string>

#include "estimation/fit.hpp"

namespace pliant {

/// What the plan of a fit depends on, beside what was done: facts about the recordings, and the choices.
struct PlanFacts {
  FitOptions options;
  PassLimits limits;
  ParameterSet parameters;                 ///< where the fit begins, with the choices
  std::vector<ParameterHandle> moduli;     ///< of the object
  ParameterHandle density, gravity;        ///< of the first recording
  double size = 0.0;                       ///< of the object [m]
  VectorX relative_moduli;                 ///< of scan and starts, the first one's being one
  std::vector<ParameterHandle> frictions;  ///< coefficients that nobody knows: they are scanned along
  std::vector<std::string> told_at_rest;   ///< parameters that show before anything moves: poses of sensors, planes
  bool is_scanned = true;                  ///< Young's modulus is looked for
  double softest = 0.0;                    ///< Young's modulus that is tried [Pa]; 0: the stress under its own weight
  bool swings = false;                     ///< some object is let go
  Spacing coarse;                          ///< of the grid on which starts are followed
  bool coarse_is_as_fine = false;          ///< its elements are those of the full grid
  std::vector<Spacing> repetitions;        ///< on finer grids, after the first estimate
  bool repeats_by_need = false;            ///< each only where a look at the resolution asks for it
  bool looks_at_scan_errors = false;       ///< some scan errs, and estimates are made off it where that shows
  std::vector<Alternative> alternatives;   ///< models that are tried at the last estimate
};

/// The stages of a fit of motions and equilibria: where sensors stand, by an object that still is as it was scanned;
/// how it moves at first; the swing that was seen, or a scan over decades of Young's modulus; the best values followed
/// on the coarse grid, wide band, horizon growing as the early frames match; the best of them on the full grid, first
/// in the wide band; a test of which corrections the residuals ask for, and the estimate with them; looks at the errors
/// of the scan, and estimates off it where they show; repetitions on finer grids; a few steps under each of some
/// alternative models; where these show that the mesh matters, repetitions on finer ones within the budget.
class FitPlan {
 public:
  explicit FitPlan(PlanFacts facts) : facts_(std::move(facts)) {}

  /// What is next, chains side by side; none: all is done.
  /// @param state  its records alone are read, and where it begins
  std::vector<StageChain> next(const PassState& state) const;
  /// One look at what was reached where a fit is interrupted before its estimate: the last stage from the best so far.
  Stage last_look(const PassState& state) const;

  /// Where the estimate begins: all its moduli at the first start.
  VectorX start_theta(const std::vector<StageRecord>& done) const;
  /// Of a start's stage over all frames: the start that was followed to its end, into whose valley it has come.
  /// @param theta, cost  where it stands
  std::optional<int> joined_on_the_way(const Stage& stage, const VectorX& theta, double cost,
                                       const std::vector<StageRecord>& done) const;
  /// The starts that were followed.
  std::vector<FitStart> starts(const std::vector<StageRecord>& done) const;
  /// The parameters that are estimated at last, with the corrections that were found to be needed.
  ParameterSet estimated(const std::vector<StageRecord>& done) const;
  /// How the model of the estimate differs from one on the scan.
  ModelChange surface(const std::vector<StageRecord>& done) const;
  /// The first estimate, before any repetition, and the repetitions that succeeded; null where there is none.
  const StageRecord* estimate(const std::vector<StageRecord>& done) const;
  std::vector<const StageRecord*> repetitions(const std::vector<StageRecord>& done) const;
  /// The one on the finest mesh, of the first estimate and its repetitions; null where there is none.
  const StageRecord* result(const std::vector<StageRecord>& done) const;
  /// How finely a record's stage was simulated.
  Spacing spacing_of(const StageRecord& record) const;
  /// Of a repetition, in units of the first estimate's: a warm start needs few iterations.
  double work(const Spacing& spacing) const;

  const PlanFacts& facts() const { return facts_; }
  /// theta with all moduli of the object, relative to each other as the starts have them.
  VectorX with_modulus(VectorX theta, double youngs_modulus, const std::vector<StageRecord>& done) const;
  /// theta with the pulls that hold a released object as they are expected beforehand.
  VectorX without_pulls(VectorX theta) const;

 private:
  using Records = std::vector<StageRecord>;

  Stage pose() const;
  StageChain motion(int first, const VectorX& from) const;
  Stage swing(const VectorX& from) const;
  Stage scan(int number, const VectorX& from) const;
  /// One start on the coarse grid.
  StageChain start(int index, const Records& done) const;
  Stage pulls(const VectorX& from, const Spacing& grid, int number) const;
  StageChain fine(const Records& done, const std::optional<PassState::Beginning>& begin) const;
  Stage test(const StageRecord& estimate) const;
  StageChain corrected(const Records& done, const std::optional<PassState::Beginning>& begin) const;
  StageChain off_scan(const Records& done) const;
  StageChain finer(const Records& done) const;
  std::vector<StageChain> alternatives(const Records& done) const;
  /// A look at whether the next repetition is needed; none where they are not by need, or one has failed.
  std::vector<StageChain> resolution(const Records& done) const;

  /// Whether a parameter is of a pose that is told at rest.
  bool is_pose_at_rest(const Parameter& p) const;
  VectorX with_poses_at_rest(VectorX theta, const Records& done) const;
  /// With a tenth of where they began for dampings that came to next to nothing on the coarse mesh: steps of a
  /// logarithm are too short to find back from there.
  VectorX without_vanished_dampings(VectorX theta) const;
  /// Where the fit begins, with the poses that are told at rest.
  VectorX beginning(const Records& done) const;
  /// Where the fit is before any start is followed.
  VectorX before_starts(const Records& done) const;
  /// Where starts begin that scan or swing showed.
  std::vector<VectorX> found_starts(const Records& done) const;
  int scan_count() const;
  VectorX with_friction(VectorX theta, int scan) const;
  /// How many starts are followed as far as is known: more than there are moduli where the best of them is not good.
  int start_count(const Records& done) const;
  /// Why a start is not followed any further: it leads nowhere, or where another leads. Empty: it is followed.
  std::string why_given_up(int index, const Records& done) const;
  /// Another start that leads to the same place over the first frames and is followed in its stead.
  std::optional<int> joined(int index, const Records& done) const;
  bool is_in_valley(const VectorX& theta, double cost, const StageRecord& of) const;
  std::vector<StageChain> starts_left(const Records& done) const;
  /// A start beyond those of the scan or the swing: the modulus log-uniform about those; what shapes the law, dampings,
  /// gravity, and how obstacles stand, are hard and rub, drawn from their priors where they are estimated. The same for
  /// the same number.
  VectorX drawn_start(int index, const Records& done) const;
  /// A start over the first frames; null where it is not there yet.
  const StageRecord* first_of_start(int index, const Records& done) const;
  /// The end of a start's chain; null where it is not reached.
  const StageRecord* end_of_start(int index, const Records& done) const;
  /// The start that fits best.
  std::pair<VectorX, int> best_start(const Records& done) const;
  VectorX relative_moduli(const Records& done) const;
  /// Of estimated parameters, without poses that are told at rest.
  std::vector<std::string> names(const std::function<bool(const Parameter&)>& matches) const;
  std::vector<std::string> needed_corrections(const Records& done) const;
  /// The estimate in the narrow band, before any corrections.
  const StageRecord* narrow(const Records& done) const;
  std::vector<std::string> free_at_last(const Records& done) const;
  int iterations_on_full_grid(const Records& done) const;

  PlanFacts facts_;
};

/// On the coarse grid, in the wide band: what is left is noise and the mesh.
inline constexpr double good_misfit = 2.0;

/// Whether it is one of Poisson's ratios and exponents: what shapes a law, where moduli scale it.
bool shapes_law(const Parameter& p);

/// The record of a stage; null where it is not done.
const StageRecord* find_record(const std::vector<StageRecord>& done, const StageId& id);

/// The last estimate of a state on the full grid or a finer one; null where there is none.
const StageRecord* estimate_of(const PassState& state);
/// A fit that looks again from the estimate of another one: what came before the full grid stands, and the last stage
/// on the full grid is done anew. The state has an estimate.
PassState begun_from(const PassState& state);

/// Iterations that are counted on in the stages after it.
int counted_iterations(const StageRecord& record);

/// Young's modulus [Pa] of a trial, and in which of the scans.
struct ScannedStart {
  int scan = 0;
  double modulus = 0.0;
  bool operator==(const ScannedStart&) const = default;
};

/// Starts to follow, at most so many: every one is a valley of its scan before it is merely low, since neighbours lead
/// to the same place; valleys far above the lowest are left out.
/// @param scans  of each the trials: modulus [Pa], ascending, and cost
std::vector<ScannedStart> best_of_scans(const std::vector<std::vector<std::pair<double, double>>>& scans, int most);

}  // namespace pliant
