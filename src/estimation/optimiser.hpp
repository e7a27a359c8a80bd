#pragma once

#include <functional>
#include <limits>
#include <string>

#include "estimation/objective.hpp"

namespace pliant {

enum class OptimiserKind {
  LevenbergMarquardt,  ///< Gauss-Newton on the residuals, by tangents: the default
  Rprop,               ///< sign of the adjoint gradient (Riedmiller and Braun 1993), the choice of Weiss 2020
  GradientDescent,     ///< adjoint gradient with an adaptive step
  Lbfgs,               ///< limited-memory BFGS on the adjoint gradient (Liu and Nocedal 1989): for many parameters
  NelderMead,          ///< downhill simplex on the cost alone, by NLopt: the choice of Wang 2015
};

struct OptimiserOptions {
  OptimiserKind kind = OptimiserKind::LevenbergMarquardt;
  int max_iterations = 25;       ///< >= 1; of Nelder-Mead, which needs many more, each evaluation is one
  double step_tolerance = 1e-3;  ///< stop when no unconstrained number moves more than this, > 0
  double cost_tolerance = 2e-4;  ///< or the cost falls by less than this fraction, > 0; not Nelder-Mead's
  /// Or an undamped Gauss-Newton step promises the cost, a negative log likelihood, to fall by less than this, >= 0:
  /// the minimum is then sqrt(2 * this) standard deviations away. Levenberg-Marquardt's alone.
  double promise_tolerance = 0.0;
  /// Or, after two iterations, three times what an undamped Gauss-Newton step promises would leave the cost above this:
  /// it is out of reach, and nothing less is of use. Levenberg-Marquardt's alone.
  double cost_to_reach = std::numeric_limits<double>::infinity();
  /// Most that any unconstrained number moves in one iteration (a factor of two), > 0; Nelder-Mead's first simplex has
  /// edges of half of it.
  double max_step = 0.7;
  /// Up to so many times that it may become with steps that keep what they promise, while others shorten it: a trust
  /// region (Nocedal and Wright 2006, algorithm 4.1), >= 1; 1: it stays. Levenberg-Marquardt's alone.
  double growth_of_max_step = 1.0;
  /// How Levenberg-Marquardt keeps to that: by more damping in that step, so that combinations of numbers that the data
  /// hardly tell do not hold up what they do, or by a shorter step in the same direction.
  bool damps_long_steps = false;
  /// After a rejected step: how many dampings Levenberg-Marquardt tries side by side by their costs alone, each five
  /// times the one before, before it linearises at the best, >= 1. One: it linearises at each trial.
  int trials_after_rejection = 1;
};

/// Where a run stands between two iterations: going on from here takes the path that an undisturbed run takes.
struct OptimiserState {
  int iterations = 0;  ///< done
  VectorX p;           ///< the best point
  VectorX
      memory;  ///< the optimiser's own: damping, step lengths, the last trial and signs, changes, or all costs so far
};

/// One accepted or rejected iteration, as it happens.
struct Iteration {
  int number = 0;
  double cost = 0.0;
  double damping = 0.0;  ///< Levenberg-Marquardt's lambda; a step length for the others
  bool accepted = true;
  VectorX p;
  double surface_rms = 0.0;
  VectorX memory;  ///< with `number` and `p`, the state to go on from

  OptimiserState state() const { return {number, p, memory}; }
};

struct OptimiserSummary {
  VectorX p;
  CostEvaluation evaluation;  ///< at p; with derivatives where the optimiser had them
  double start_cost = 0.0;
  int iterations = 0, evaluations = 0;
  long long steps = 0;  ///< time steps simulated
  double work = 0.0;    ///< see `CostEvaluation::work`
  bool converged = false, interrupted = false, succeeded = false;
  bool is_out_of_reach = false;  ///< it ended for that reason (`OptimiserOptions::cost_to_reach`)
  std::string reason = "not run";
};

/// Minimises from p. A failed or non-finite evaluation is a step back, not an end; only a start that cannot be
/// evaluated fails, and Nelder-Mead in a program built without NLopt. Where an evaluation after the start's is
/// interrupted, the best point so far is the end. Throws Interrupted where the start's is.
/// @param on_iteration  called after each; false stops ("interrupted")
OptimiserSummary minimise(CostFunction& objective, const VectorX& p, const OptimiserOptions& options,
                          const std::function<bool(const Iteration&)>& on_iteration = {});

/// Goes on from where a run of the same objective, options and kind of optimiser stood.
OptimiserSummary minimise(CostFunction& objective, const OptimiserState& state, const OptimiserOptions& options,
                          const std::function<bool(const Iteration&)>& on_iteration = {});

/// A splitting after Wang 2015 (algorithm 1, which solves for the shape before each update of a simplex): the load-free
/// shape for p, then a few iterations towards the p that is
/// best for that shape, in turns until p stays. `max_iterations` are those of all turns together; their costs are
/// those of the shape of the turn and need not fall from one to the next.
OptimiserSummary minimise_staggered(Objective& objective, const OptimiserState& state, const OptimiserOptions& options,
                                    const std::function<bool(const Iteration&)>& on_iteration = {});

}  // namespace pliant
