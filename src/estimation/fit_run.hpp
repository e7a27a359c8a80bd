#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "estimation/alternative.hpp"
#include "estimation/fit_plan.hpp"
#include "estimation/recordings.hpp"
#include "estimation/stage_loop.hpp"

namespace pliant {

inline constexpr double work_of_a_minute = 4e7;  ///< see `CostEvaluation::work`: of a laptop's two cores

/// Carries out a `FitPlan` on recordings of motions and equilibria. Internal to `fit`.
class FitRun : StageLoop {
 public:
  /// Throws InputError where a recording cannot be fitted, with the reason.
  FitRun(std::vector<RecordedCapture> recorded, const FitOptions& options, const FitMonitor& monitor, PassState state,
         const PassLimits& limits);

  /// To the end of the plan, or until it is interrupted, and what came out.
  /// Throws InputError where no stiffness can be simulated.
  FitOutcome run();

 private:
  /// Where an interrupted fit stands that has no estimate yet: one simulation, without derivatives; not even that where
  /// it would take long.
  StageRecord last_look(const PassState& at);
  std::vector<StageChain> next() override;
  StageRecord run_stage(const Stage& stage, bool& is_cut) override;
  StageRecord minimise_stage(const Stage& stage, bool& is_cut);
  VectorX best_of(const Stage& stage);
  StageRecord find_pulls(const Stage& stage, bool& is_cut);
  StageRecord find_swing(const Stage& stage);
  StageRecord scan(const Stage& stage, bool& is_cut);
  StageRecord test_corrections(const Stage& stage);
  StageRecord look_at_scan_errors(const Stage& stage);
  StageRecord look_at_resolution(const Stage& stage);
  std::optional<VectorX> mesh_shift(const std::vector<StageRecord>& done, const VectorX& own) const;
  /// The least cost that is found where each modulus in turn is several times smaller or larger.
  VectorX with_tried_moduli(Objective& objective, VectorX p, double& work) const;
  StageRecord try_alternative(const Stage& stage, bool& is_cut);
  std::vector<ModelShift> shifts_of_given(const Stage& stage, const ParameterSet& estimated, double& work);

  /// One minimisation, told as iterations of the stage; from any thread.
  /// @param joined  out: of a start that was stopped in another one's valley, which
  OptimiserSummary optimise(Objective& objective, const Stage& stage, const OptimiserState& from,
                            std::optional<int>& joined);
  ParameterSet parameters_of(const Stage& stage, const VectorX& theta) const;
  /// Parameters that hold released objects in the pose in which a stage has them start; empty: those of the stage do.
  VectorX pose_of(const Stage& stage) const;
  Objective objective_of(const Stage& stage, const ParameterSet& parameters, const Grid& grid,
                         bool keeps_rows = false) const;
  const Grid& grid(const Spacing& spacing, const ModelChange& change = {});
  const Grid& grid(const Stage& stage) { return grid(stage.grid, stage.change); }
  /// Makes a stage's grid; one of an alternative or of a surface off the scan that cannot be made is told by the stage.
  void make_grid(const Stage& stage);
  /// Empty: it was made.
  std::string why_not_made(const Stage& stage) const;

  void tell(FitEvent event);

  PlanFacts facts(const PassLimits& limits);
  Spacing coarse_spacing() const;
  /// A Young's modulus that holds up every object that is held, and the softest one that is worth a trial [Pa]; 0:
  /// none is held.
  struct Carrying {
    double modulus = 0.0, softest = 0.0;
  };
  Carrying carrying(const VectorX& theta);
  std::optional<double> given_start(const std::string& name) const;
  double all_work() const;

  /// The state with what was interrupted among its records.
  PassState reached() const;

  void finish(const std::vector<StageRecord>& done);
  /// The choices, with what they left to the fit as it was decided.
  FitOptions used_options(const Grid& at) const;
  CostEvaluation evaluation_of(const StageRecord& record, const Stage& narrow, const ParameterSet& parameters);
  /// At an estimate, with derivatives by these parameters: what its optimiser found where the record has it, else anew.
  /// @param stage  of the same grid and band as the estimate's
  CostEvaluation linearised_at(const StageRecord& estimate, const Stage& stage, const ParameterSet& parameters);
  void say_doubts_of_time(const Stage& narrow, const ParameterSet& parameters);
  void say_corrections(const std::vector<StageRecord>& done);
  void say_scan_errors(const std::vector<StageRecord>& done, const StageRecord& estimate);
  const StageRecord& refined(const std::vector<StageRecord>& done, const StageRecord& first);
  std::vector<Alternative> alternatives() const;
  /// By how much the estimate would move under each alternative that could be tried.
  /// @param own  what is left of the way to the estimate's own minimum
  std::vector<ModelShift> shifts_in(const std::vector<StageRecord>& done, const VectorX& own) const;
  void say_untried(const std::vector<StageRecord>& done);
  VectorX floor(const ParameterSet& parameters, const VectorX& theta) const;
  void time_steps(const Stage& narrow, const ParameterSet& parameters);

  Recordings recordings_;
  std::shared_ptr<const ParameterLayout> layout_;
  std::vector<std::unique_ptr<Grid>> grids_;
  std::optional<std::size_t> grids_of_fit_;                // how many there were before the alternatives'
  std::vector<std::pair<StageId, std::string>> not_made_;  // why
  FitPlan plan_;
  std::vector<StageRecord> ended_before_;  // the chains that run side by side
  bool has_looked_last_ = false;           // at what an interrupted fit has reached
  std::atomic<bool> stages_are_over_ = false;
};

}  // namespace pliant
