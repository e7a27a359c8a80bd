#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <vector>

#include "estimation/fit.hpp"

namespace pliant {

/// The loop that carries out every plan of a fit: asks it for stages, runs them, keeps their records in the state,
/// tells and saves what is done, and stops where it is interrupted. Internal to `fit`.
class StageLoop {
 public:
  virtual ~StageLoop() = default;

 protected:
  StageLoop(const FitOptions& options, const FitMonitor& monitor, PassState state)
      : options_(options), monitor_(monitor), state_(std::move(state)) {}

  /// The stages that are next, chains side by side (by several processes one after the other); none: all is done.
  virtual std::vector<StageChain> next() = 0;
  /// Runs one stage. Chains side by side run on several threads.
  /// @param is_cut  set where it was interrupted; the record has what it reached
  virtual StageRecord run_stage(const Stage& stage, bool& is_cut) = 0;
  /// Where the whole fit stands.
  virtual FitState whole_state() const { return {state_, {}, {}, {}}; }

  /// Until there are no more stages, or it is interrupted.
  void execute();
  bool is_interrupted() const { return monitor_.is_interrupted(); }
  /// Tells and keeps it; from any thread.
  void emit(FitEvent event);
  /// Keeps where the optimiser of a stage stands; of one stage at a time.
  void keep_under_way(const Stage& stage, OptimiserState optimiser);
  /// Where the optimiser of a stage stood when it was interrupted; null: it begins.
  const StageUnderWay* under_way(const StageId& id) const {
    return state_.under_way && state_.under_way->id == id && !interrupted_ ? &*state_.under_way : nullptr;
  }

  FitOptions options_;
  FitMonitor monitor_;
  PassState state_;
  FitOutcome outcome_;
  std::vector<StageRecord> partial_;  // of stages that were interrupted
  std::atomic<bool> interrupted_ = false;
  mutable std::mutex mutex_;  // of all above that stages write, and of the monitor

 private:
  void run_chain(const StageChain& chain);
  void keep(StageRecord record);
  void save();
};

}  // namespace pliant
