#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "estimation/fit.hpp"

namespace pliant {

/// One way through the stages of a `FitPlan`, as data: of which recordings, with which choices, from where.
struct Pass {
  std::vector<RecordedCapture> recordings;
  FitOptions options;  ///< with a number of control points, and without tracking
  PassState begin;
  PassLimits limits = {};
  std::string name;   ///< stands before those of its stages: "round 2: "
  std::string stage;  ///< stands for those of its stages but repetitions: "2 control points"; empty: their own
  double done_from = 0.0, done_to = 1.0;  ///< how much of the whole is done before and after it
  bool is_saved = true;
};

/// Makes the plan of a fit, pass by pass, from what came out of those before.
class PassPlanner {
 public:
  virtual ~PassPlanner() = default;
  /// The next pass; nothing: all is done, or was interrupted.
  virtual std::optional<Pass> next() = 0;
  /// What came out of the pass that was handed out last, and where its stages stand. True: that is kept in what `write`
  /// says, or of no more use.
  virtual bool take(FitOutcome outcome, PassState reached) = 0;
  virtual bool is_done() const = 0;
  /// Where the planner stands, but for the pass under way.
  virtual void write(FitState& state) const = 0;
  /// What came out of all passes; called once, at the end.
  virtual FitOutcome outcome() = 0;
};

/// Carries out a planner's passes one after the other, and saves and tells what is done.
FitOutcome carry_out(PassPlanner& planner, const FitMonitor& monitor);

/// The one pass of recordings whose number of control points is given.
class OnePass : public PassPlanner {
 public:
  OnePass(std::vector<RecordedCapture> recordings, const FitOptions& options, PassState begin);
  std::optional<Pass> next() override;
  bool take(FitOutcome outcome, PassState reached) override;
  bool is_done() const override { return outcome_.has_value(); }
  void write(FitState&) const override {}
  FitOutcome outcome() override { return std::move(*outcome_); }

 private:
  Pass pass_;
  std::optional<FitOutcome> outcome_;
};

/// The planner of a fit of motions and equilibria without tracking: with the number of control points that the options
/// give, or a choice of it (`FieldChoice`).
/// @param processes  as in `FitMonitor`
std::unique_ptr<PassPlanner> planner_of_points(std::vector<RecordedCapture> recordings, const FitOptions& options,
                                               FitState resume, std::shared_ptr<ProcessGroup> processes = nullptr);

}  // namespace pliant
