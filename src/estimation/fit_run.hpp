#pragma once

#include <cmath>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "estimation/fit.hpp"
#include "estimation/recordings.hpp"

namespace pliant {

/// What the parts of a fit share: its recordings, where it stands, and what it has found. Internal to `fit`.
struct FitRun {
  /// Throws InputError where a recording cannot be fitted, with the reason.
  FitRun(std::vector<RecordedCapture> recorded, const FitOptions& options, const FitMonitor& monitor, FitState state);

  /// Whether any object is let go and swings.
  bool swings() const { return recordings.any_released(); }
  /// The same parameters at another theta, none estimated.
  ParameterSet fixed_at(const VectorX& theta) const;
  /// With the pulls that hold a released object as they are expected beforehand.
  VectorX without_pulls(VectorX theta) const;
  /// Whether a parameter is a force that holds a released object until it is let go.
  static bool is_pull(const Parameter& p) { return p.role == Role::Initial && p.is_auxiliary; }
  static OptimiserState start_of(const ParameterSet& parameters) {
    return {0, parameters.to_unconstrained(parameters.reference()), {}};
  }

  bool interrupted() const { return monitor.interrupted && monitor.interrupted(); }
  /// Tells and keeps it; from any thread.
  void emit(FitEvent event);
  void save_state() {
    if (monitor.on_state) monitor.on_state(state);
  }

  /// One minimisation, told as iterations from `counter` on, which it moves on; from any thread.
  /// @param on_state  after each iteration; may be empty
  OptimiserSummary optimise(Objective& objective, const OptimiserState& from, StageKind kind, const std::string& stage,
                            int start, int iterations, int& counter, double done_from, double done_to,
                            const std::function<void(const OptimiserState&)>& on_state = {});

  /// On finer grids, after the first estimate.
  std::vector<Spacing> repetitions() const;
  /// Of a repetition, in units of the first estimate's: a warm start needs few iterations.
  double work(const Spacing& s) const { return 0.3 * s.steps / options.steps * std::pow(s.cells / options.cells, 3); }

  FitOptions options;
  FitMonitor monitor;
  FitState state;
  FitOutcome outcome;
  Recordings recordings;
  ParameterSet parameters;
  std::shared_ptr<const ParameterLayout> layout;  ///< of the parameters
  Grid coarse, fine;
  std::mutex mutex;  ///< of the outcome's history and steps, and of the monitor

 private:
  double all_work() const;
};

/// Where the stages on the full grid may begin, into the outcome's `starts`: how the object moves at first, a scan over
/// decades of Young's modulus or the swing that was seen, and the best values followed on the coarse grid. Goes on from
/// the state. Throws InputError where no stiffness can be simulated.
void find_starts(FitRun& run);

/// The fit of motions and equilibria: what `fit` does where there is more than presses.
FitOutcome fit_motions(std::vector<RecordedCapture> recordings, const FitOptions& options, const FitMonitor& monitor,
                       FitState resume);

/// For people.
std::string in_three_digits(double value);

}  // namespace pliant
