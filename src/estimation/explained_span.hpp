#pragma once

#include "estimation/fit_pass.hpp"

namespace pliant {

/// Plans a fit of motions that meet obstacles. Small errors of a model grow with every impact, and what comes after may
/// not be explained by any parameters: an estimate from all frames is then a compromise that fits none. The whole
/// recordings are fitted first; where residuals stay far above the noise, the estimate is made anew of the first part
/// of each recording, on a finer mesh, and the part grows as long as it is explained.
class ExplainedSpan : public PassPlanner {
 public:
  /// @param resume  the state of an interrupted fit goes on with the part that was under way
  ExplainedSpan(std::vector<RecordedCapture> recordings, const FitOptions& options, FitState resume);

  /// Whether a fit is one that this plans: it has a motion that meets obstacles, and the options leave the part open.
  static bool suits(const std::vector<RecordedCapture>& recordings, const FitOptions& options);

  std::optional<Pass> next() override;
  bool take(FitOutcome outcome, PassState reached) override;
  bool is_done() const override { return outcome_.has_value(); }
  void write(FitState& state) const override { state.span = search_; }
  FitOutcome outcome() override { return std::move(*outcome_); }

 private:
  bool is_decided() const;
  void say(FitOutcome& outcome) const;

  std::vector<RecordedCapture> recordings_;
  FitOptions options_;
  FitState::SpanSearch search_;
  PassState left_;        // by an interruption
  bool is_left_ = false;  // until the pass that was interrupted goes on
  bool is_last_ = false;  // the pass that was handed out last
  std::vector<FitEvent> history_;
  std::vector<FitStart> starts_;  // of the whole recordings
  long long forward_steps_ = 0;
  std::optional<FitOutcome> outcome_;
};

}  // namespace pliant
