#include "estimation/optimiser.hpp"

#include <LBFGSpp/BFGSMat.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <vector>

#include "base/error.hpp"
#include "estimation/bounded_step.hpp"

#ifdef PLIANT_WITH_NLOPT
#include <nlopt.hpp>
#endif

namespace pliant {

namespace {

enum class Derivatives { None, Adjoint, Tangents };

Derivatives needed_by(OptimiserKind kind) {
  switch (kind) {
    case OptimiserKind::LevenbergMarquardt:
      return Derivatives::Tangents;
    case OptimiserKind::NelderMead:
      return Derivatives::None;
    default:
      return Derivatives::Adjoint;
  }
}

/// What the optimisers share: bookkeeping of the best point and the end.
class Run {
 public:
  Run(CostFunction& objective, const OptimiserOptions& options,
      const std::function<bool(const Iteration&)>& on_iteration)
      : objective_(objective), options_(options), on_iteration_(on_iteration) {}

  CostEvaluation evaluate(const VectorX& p, Derivatives by) {
    CostEvaluation e = by == Derivatives::None      ? objective_.evaluate(p)
                       : by == Derivatives::Adjoint ? objective_.gradient(p)
                                                    : objective_.linearise(p);
    ++summary.evaluations;
    summary.steps += e.steps, summary.work += e.work;
    return e;
  }
  /// Costs alone, side by side where that can be.
  std::vector<CostEvaluation> evaluate(const std::vector<VectorX>& points) {
    std::vector<CostEvaluation> all = objective_.evaluate(points);
    for (const CostEvaluation& e : all) ++summary.evaluations, summary.steps += e.steps, summary.work += e.work;
    return all;
  }
  bool begin(const OptimiserState& state, Derivatives by) {
    summary.p = objective_.parameters().clamp(state.p);
    summary.iterations = state.iterations;
    summary.evaluation = evaluate(summary.p, by);
    summary.succeeded = summary.evaluation.succeeded;
    summary.start_cost = summary.evaluation.cost;
    if (!summary.succeeded) summary.reason = "the start cannot be simulated: " + summary.evaluation.failure;
    return summary.succeeded;
  }
  /// Reports an iteration; true where the run is to end. An end that was reached cannot be interrupted any more.
  bool report(double damping, bool accepted, VectorX memory, bool finished = false) {
    ++summary.iterations;
    const bool go_on =
        !on_iteration_ || on_iteration_({summary.iterations, summary.evaluation.cost, damping, accepted, summary.p,
                                         summary.evaluation.surface_rms(), std::move(memory)});
    if (finished) return true;
    if (!go_on) {
      summary.interrupted = true;
      return end(false, "interrupted");
    }
    return has_done_all();
  }
  bool has_done_all() {
    return summary.iterations >= options_.max_iterations && end(false, "reached the most iterations allowed");
  }
  bool end(bool converged, const char* reason) {
    summary.converged = converged;
    summary.reason = reason;
    return true;
  }
  const ParameterSet& parameters() const { return objective_.parameters(); }
  VectorX clamp(const VectorX& p) const { return parameters().clamp(p); }

  OptimiserSummary summary;

 private:
  CostFunction& objective_;
  const OptimiserOptions& options_;
  const std::function<bool(const Iteration&)>& on_iteration_;
};

/// A step of Levenberg and Marquardt, and what it promises.
struct DampedStep {
  double damping = 0.0;
  VectorX to;
  double moved = 0.0;      // by the number that moves most
  double predicted = 0.0;  // fall of the cost
  bool may_lower = true;   // false: known not to lower it
};

/// @param longest  that any number may move
DampedStep damped_step(const Run& run, const OptimiserOptions& options, double damping, double longest) {
  const VectorX &p = run.summary.p, &g = run.summary.evaluation.gradient;
  const MatrixX& H = run.summary.evaluation.gauss_newton;
  const double floor = 1e-9 * std::max(H.trace() / double(H.rows()), 1e-300);
  const auto step_with = [&](double by) {
    MatrixX damped = H;
    damped.diagonal() += by * H.diagonal().cwiseMax(floor);
    return step_within_bounds(run.parameters(), p, g, damped).step;
  };
  VectorX step = step_with(damping);
  if (options.damps_long_steps && step.cwiseAbs().maxCoeff() > longest) {
    constexpr double factor = 8.0;  // of damping, until the step is short enough
    double more = std::max(damping, 1e-8);
    for (; step.cwiseAbs().maxCoeff() > longest && more < 1e4; more *= factor) step = step_with(more * factor);
    double less = more / factor;
    for (int halving = 0; halving < 4; ++halving) {  // of the interval of its logarithm
      const double middle = std::sqrt(less * more);
      const VectorX longer = step_with(middle);
      const bool is_short_enough = longer.cwiseAbs().maxCoeff() <= longest;
      (is_short_enough ? more : less) = middle;
      if (is_short_enough) step = longer;
    }
  }
  DampedStep made;
  made.damping = damping;
  constexpr double tolerance = 1.01;  // half a step along a curve is not half as long: it is cut several times
  for (;; step *= longest / made.moved) {
    made.to = run.parameters().moved(p, step);
    made.moved = (made.to - p).cwiseAbs().maxCoeff();
    if (!(made.moved > tolerance * longest)) break;
  }
  made.predicted = -(g.dot(step) + 0.5 * step.dot(H * step));
  return made;
}

/// Rejections come in series. The step among several dampings whose cost is least; the last and shortest where none is
/// lower than at hand.
DampedStep best_of_several(Run& run, const OptimiserOptions& options, double damping, double raise, double longest) {
  std::vector<DampedStep> steps;
  std::vector<VectorX> ends;
  for (int i = 0; i < options.trials_after_rejection; ++i, damping = std::min(damping * raise, 1e8)) {
    steps.push_back(damped_step(run, options, damping, longest));
    ends.push_back(steps.back().to);
  }
  const std::vector<CostEvaluation> costs = run.evaluate(ends);
  double least = run.summary.evaluation.cost;
  std::size_t best = steps.size() - 1;
  steps[best].may_lower = false;
  for (std::size_t i = 0; i < costs.size(); ++i)
    if (costs[i].succeeded && costs[i].cost < least) least = costs[i].cost, best = i, steps[i].may_lower = true;
  return steps[best];
}

/// How far a step may move any number: as far as `max_step` at first, and always where that may not grow.
class TrustRegion {
 public:
  TrustRegion(const OptimiserOptions& options, double radius)
      : options_(options), radius_(radius > 0.0 ? radius : options.max_step) {}
  double radius() const { return radius_; }

  /// @param quality  what a step has gained over what it promised; not above zero: it was rejected
  void learn(double quality, double moved) {
    constexpr double at_border = 0.8, growth = 2.0;
    const double most = options_.growth_of_max_step;
    if (most <= 1.0) return;
    if (quality > 0.75 && moved > at_border * radius_)
      radius_ = std::min(growth * radius_, most * options_.max_step);
    else if (quality < 0.25)
      radius_ = std::min(radius_, moved) / growth;
  }

 private:
  const OptimiserOptions& options_;
  double radius_;
};

/// Memory: the damping, whether the last step was rejected, and the radius of the trust region.
void levenberg_marquardt(Run& run, const OptimiserOptions& options, const VectorX& memory) {
  constexpr double raise = 5.0, most = 1e8, undamped = 1e-10, least_refused = 1e-4;  // damping
  constexpr double hope = 3.0;                                                       // of what is promised
  constexpr int iterations_to_hope = 2;
  OptimiserSummary& s = run.summary;
  double lambda = memory.size() > 0 ? memory[0] : 1e-2;
  bool was_rejected = memory.size() > 1 && memory[1] > 0.0;
  TrustRegion trusted(options, memory.size() > 2 ? memory[2] : 0.0);
  for (bool done = false; !done;) {
    if (s.iterations >= iterations_to_hope && std::isfinite(options.cost_to_reach) &&
        s.evaluation.cost - hope * damped_step(run, options, undamped, infinite).predicted > options.cost_to_reach) {
      s.is_out_of_reach = true;
      run.end(false, "the cost that would be of use is out of reach");
      return;
    }
    if (damped_step(run, options, undamped, trusted.radius()).predicted < options.promise_tolerance) {
      run.end(true, "the minimum is within a fraction of its standard deviation");
      if (s.iterations == 0)  // a run is seen to be one
        run.report(lambda, true, Vector3(lambda, 0.0, trusted.radius()), true);
      return;
    }
    const bool looks_ahead = was_rejected && options.trials_after_rejection > 1;
    const DampedStep step = looks_ahead ? best_of_several(run, options, lambda, raise, trusted.radius())
                                        : damped_step(run, options, lambda, trusted.radius());
    lambda = step.damping;
    if (step.moved == 0.0) {
      run.end(true, "the step is zero");
      return;
    }
    CostEvaluation e;
    if (step.may_lower) e = run.evaluate(step.to, Derivatives::Tangents);
    const double gain = s.evaluation.cost - e.cost;
    const bool accepted = e.succeeded && gain > 0.0;
    const double quality = !accepted ? 0.0 : step.predicted > 0.0 ? gain / step.predicted : 0.0;
    trusted.learn(quality, step.moved);
    if (accepted) {
      // As Nielsen (1999) has it; the longer step that was just refused would be refused again.
      const double change = quality < 0.25 ? 3.0 : std::max(1.0 / raise, 1.0 - std::pow(2.0 * quality - 1.0, 3));
      lambda = std::clamp(lambda * (was_rejected ? std::max(change, 1.0) : change), 1e-8, most);
      const bool small = step.moved < options.step_tolerance || gain < options.cost_tolerance * s.evaluation.cost;
      s.p = step.to;
      s.evaluation = std::move(e);
      if (small) done = run.end(true, "the cost no longer falls");
    } else {
      // Where a step promises or moves next to nothing, the point is as good as the cost's smoothness allows.
      if (step.moved < options.step_tolerance || step.predicted < options.cost_tolerance * s.evaluation.cost)
        done = run.end(true, "no step lowers the cost");
      lambda = std::min(std::max(lambda, least_refused) * raise, most);
    }
    was_rejected = !accepted;
    done = run.report(lambda, accepted, Vector3(lambda, was_rejected ? 1.0 : 0.0, trusted.radius()), done);
  }
}

void rprop(Run& run, const OptimiserOptions& options, const VectorX& memory) {
  OptimiserSummary& s = run.summary;
  const Eigen::Index n = s.p.size();
  VectorX p = s.p, gradient = s.evaluation.gradient, last = VectorX::Zero(n), length = VectorX::Constant(n, 0.1);
  if (memory.size() > 0) {
    p = memory.head(n), last = memory.segment(n, n), length = memory.tail(n);
    if (p != s.p) gradient = run.evaluate(p, Derivatives::Adjoint).gradient;
  }
  for (;;) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const double sign = gradient[i] * last[i];
      if (sign > 0.0) length[i] = std::min(length[i] * 1.2, options.max_step);
      if (sign < 0.0) length[i] *= 0.5, gradient[i] = 0.0;
      p[i] -= std::copysign(length[i], gradient[i]) * (gradient[i] != 0.0);
    }
    last = gradient;
    p = run.clamp(p);
    CostEvaluation e = run.evaluate(p, Derivatives::Adjoint);
    const bool better = e.succeeded && e.cost < s.evaluation.cost;
    if (e.succeeded) {
      gradient = e.gradient;
    } else {  // back to the best point with shorter steps
      p = s.p, gradient = s.evaluation.gradient, length *= 0.25;
    }
    if (better) s.p = p, s.evaluation = std::move(e);
    const bool finished = length.maxCoeff() < options.step_tolerance && run.end(true, "steps became short");
    VectorX state(3 * n);
    state << p, last, length;
    if (run.report(length.maxCoeff(), better, std::move(state), finished)) return;
  }
}

void gradient_descent(Run& run, const OptimiserOptions& options, const VectorX& memory) {
  OptimiserSummary& s = run.summary;
  double length = memory.size() > 0 ? memory[0] : 0.1;
  for (;;) {
    const VectorX direction = -s.evaluation.gradient / std::max(s.evaluation.gradient.cwiseAbs().maxCoeff(), 1e-300);
    const VectorX trial = run.clamp(s.p + length * direction);
    CostEvaluation e = run.evaluate(trial, Derivatives::Adjoint);
    const bool better = e.succeeded && e.cost < s.evaluation.cost;
    if (better) s.p = trial, s.evaluation = std::move(e);
    length = better ? std::min(1.5 * length, options.max_step) : 0.4 * length;
    const bool finished = length < options.step_tolerance && run.end(true, "steps became short");
    if (run.report(length, better, VectorX::Constant(1, length), finished)) return;
  }
}

/// Limited-memory BFGS (Liu and Nocedal 1989) with bounds by projection: an iteration is one evaluation, a step that
/// does not lower the cost enough (Armijo's rule) is tried again shorter. Numbers at a bound that are pushed outwards
/// stay.
class LbfgsRun {
 public:
  LbfgsRun(Run& run, const OptimiserOptions& options, const VectorX& memory)
      : run_(run), options_(options), n_(run.summary.p.size()) {
    if (memory.size() < 2) return;
    share_ = memory[0], length_ = memory[1];
    for (Eigen::Index at = 2; at < memory.size(); at += 2 * n_)
      changes_.push_back({memory.segment(at, n_), memory.segment(at + n_, n_)});
  }

  void minimise() {
    OptimiserSummary& s = run_.summary;
    for (bool done = false; !done;) {
      const VectorX trial = run_.clamp(s.p + share_ * full_step());
      const double moved = (trial - s.p).cwiseAbs().maxCoeff();
      if (moved == 0.0) {
        run_.end(true, "the step is zero");
        return;
      }
      const double predicted = -s.evaluation.gradient.dot(trial - s.p);
      CostEvaluation e = run_.evaluate(trial, Derivatives::Adjoint);
      const double gain = s.evaluation.cost - e.cost;
      const bool accepted = e.succeeded && gain > 1e-4 * std::max(predicted, 0.0);
      // A first step of arbitrary length that gains little says nothing: only those of a curvature that is known do.
      const bool knows_curvature = !changes_.empty();
      if (accepted) {
        const bool small = moved < options_.step_tolerance || gain < options_.cost_tolerance * s.evaluation.cost;
        learn(trial - s.p, e.gradient - s.evaluation.gradient);
        s.p = trial, s.evaluation = std::move(e);
        if (small && knows_curvature) done = run_.end(true, "the cost no longer falls");
      } else {
        share_ *= e.succeeded ? shorter(predicted, gain) : 0.25;
        if (moved < options_.step_tolerance) {
          if (!knows_curvature) done = run_.end(true, "no step lowers the cost");
          changes_.clear(), share_ = 1.0;  // it may be the matrix that leads nowhere
        }
      }
      done = run_.report(moved, accepted, memory(), done);
    }
  }

 private:
  struct Change {
    VectorX p, gradient;
  };
  static constexpr std::size_t most_changes = 8;

  /// The gradient without the numbers that lie at a bound and are pushed outwards.
  VectorX free_gradient() const {
    const OptimiserSummary& s = run_.summary;
    VectorX free = s.evaluation.gradient;
    const VectorX pushed = run_.clamp(s.p - 1e-6 * free.cwiseSign());
    for (Eigen::Index i = 0; i < n_; ++i)
      if (pushed[i] == s.p[i]) free[i] = 0.0;
    return free;
  }

  /// The step of the limited-memory matrix, no number of it longer than allowed; along the steepest descent where the
  /// matrix knows nothing or leads uphill.
  VectorX full_step() const {
    const VectorX free = free_gradient();
    if (!changes_.empty()) {
      LBFGSpp::BFGSMat<double> matrix;
      matrix.reset(int(n_), int(most_changes));
      for (const Change& change : changes_) matrix.add_correction(change.p, change.gradient);
      VectorX step;
      matrix.apply_Hv(free, -1.0, step);
      step = (free.array() == 0.0).select(0.0, step);
      const double longest = step.cwiseAbs().maxCoeff();
      if (step.dot(free) < 0.0) return std::min(1.0, options_.max_step / longest) * step;
    }
    return -length_ / std::max(free.cwiseAbs().maxCoeff(), 1e-300) * free;
  }

  /// By how much a step was too long: the minimum of the parabola through both costs and the slope.
  static double shorter(double predicted, double gain) {
    const double minimum = 0.5 * predicted / std::max(predicted - gain, 1e-300);
    return std::clamp(minimum, 0.1, 0.5);
  }

  void learn(const VectorX& p, const VectorX& gradient) {
    share_ = 1.0;
    length_ = std::min(2.0 * p.cwiseAbs().maxCoeff(), options_.max_step);
    if (p.dot(gradient) <= 1e-10 * p.norm() * gradient.norm()) return;  // the matrix stays positive
    changes_.push_back({p, gradient});
    if (changes_.size() > most_changes) changes_.erase(changes_.begin());
  }

  VectorX memory() const {
    VectorX all(2 + 2 * n_ * Eigen::Index(changes_.size()));
    all[0] = share_, all[1] = length_;
    Eigen::Index at = 2;
    for (const Change& change : changes_) {
      all.segment(at, n_) = change.p;
      all.segment(at + n_, n_) = change.gradient;
      at += 2 * n_;
    }
    return all;
  }

  Run& run_;
  const OptimiserOptions& options_;
  Eigen::Index n_;
  double share_ = 1.0;           // of the full step that is tried next
  double length_ = 0.1;          // of a full step along the steepest descent
  std::vector<Change> changes_;  // of accepted steps, the oldest first
};

#ifdef PLIANT_WITH_NLOPT

/// An iteration is one evaluation. NLopt keeps its simplex to itself; but its path follows from the start and the
/// costs it was told, so these are the memory: going on tells them again.
class NelderMeadRun {
 public:
  NelderMeadRun(Run& run, const VectorX& memory) : run_(run), n_(run.summary.p.size()) {
    if (memory.size() > n_) {
      start_ = memory.head(n_);
      costs_.assign(memory.data() + n_, memory.data() + memory.size());
    } else {  // NLopt asks for the start's cost first
      start_ = run.summary.p;
      costs_.push_back(run.summary.evaluation.cost);
    }
  }

  void minimise(const OptimiserOptions& options) {
    nlopt::opt simplex(nlopt::LN_NELDERMEAD, unsigned(n_));
    simplex.set_min_objective(&NelderMeadRun::cost_at, this);
    simplex.set_initial_step(0.5 * options.max_step);
    simplex.set_xtol_abs(options.step_tolerance);
    std::vector<double> x(start_.data(), start_.data() + n_);
    double least = 0.0;
    try {
      simplex.optimize(x, least);
      run_.end(true, "the simplex became small");
    } catch (const nlopt::forced_stop&) {  // the run has said why
      if (thrown_) std::rethrow_exception(thrown_);
    } catch (const nlopt::roundoff_limited&) {
      run_.end(true, "the simplex is as small as rounding allows");
    }
  }

 private:
  static double cost_at(const std::vector<double>& x, std::vector<double>&, void* self) {
    return static_cast<NelderMeadRun*>(self)->cost(Eigen::Map<const VectorX>(x.data(), Eigen::Index(x.size())));
  }

  double cost(const VectorX& p) {
    if (asked_ == costs_.size()) {
      bool is_over = true;
      try {  // NLopt would turn an exception into one of its own
        is_over = evaluate(run_.clamp(p));
      } catch (...) {
        thrown_ = std::current_exception();
      }
      if (is_over) throw nlopt::forced_stop();
    }
    return costs_[asked_++];
  }

  bool evaluate(const VectorX& trial) {
    OptimiserSummary& s = run_.summary;
    const double distance = (trial - s.p).cwiseAbs().maxCoeff();
    CostEvaluation e = run_.evaluate(trial, Derivatives::None);
    costs_.push_back(e.succeeded ? e.cost : std::numeric_limits<double>::max());
    const bool better = e.succeeded && e.cost < s.evaluation.cost;
    if (better) s.p = trial, s.evaluation = std::move(e);
    VectorX memory(n_ + Eigen::Index(costs_.size()));
    memory << start_, Eigen::Map<const VectorX>(costs_.data(), Eigen::Index(costs_.size()));
    return run_.report(distance, better, std::move(memory));
  }

  Run& run_;
  Eigen::Index n_;
  VectorX start_;
  std::vector<double> costs_;  // of all points that NLopt asked for, the start first
  std::size_t asked_ = 0;
  std::exception_ptr thrown_;
};

void nelder_mead(Run& run, const OptimiserOptions& options, const VectorX& memory) {
  NelderMeadRun(run, memory).minimise(options);
}

#else

void nelder_mead(Run& run, const OptimiserOptions&, const VectorX&) {
  run.summary.succeeded = false;
  run.end(false, "this program was built without Nelder and Mead's method: build it with -DPLIANT_WITH_NLOPT=ON");
}

#endif

void descend(Run& run, const OptimiserOptions& options, const VectorX& memory) {
  switch (options.kind) {
    case OptimiserKind::LevenbergMarquardt:
      return levenberg_marquardt(run, options, memory);
    case OptimiserKind::Rprop:
      return rprop(run, options, memory);
    case OptimiserKind::GradientDescent:
      return gradient_descent(run, options, memory);
    case OptimiserKind::Lbfgs:
      return LbfgsRun(run, options, memory).minimise();
    case OptimiserKind::NelderMead:
      return nelder_mead(run, options, memory);
  }
}

}  // namespace

OptimiserSummary minimise(CostFunction& objective, const OptimiserState& state, const OptimiserOptions& options,
                          const std::function<bool(const Iteration&)>& on_iteration) {
  Run run(objective, options, on_iteration);
  if (!run.begin(state, needed_by(options.kind))) return run.summary;
  if (run.summary.p.size() == 0) {
    run.end(true, "nothing is estimated");
    return run.summary;
  }
  if (run.has_done_all()) return run.summary;
  try {
    descend(run, options, state.memory);
  } catch (const Interrupted&) {  // in the midst of a trial: the best point stands
    run.summary.interrupted = true;
    run.end(false, "interrupted");
  }
  return run.summary;
}

OptimiserSummary minimise(CostFunction& objective, const VectorX& p, const OptimiserOptions& options,
                          const std::function<bool(const Iteration&)>& on_iteration) {
  return minimise(objective, OptimiserState{0, p, {}}, options, on_iteration);
}

OptimiserSummary minimise_staggered(Objective& objective, const OptimiserState& state, const OptimiserOptions& options,
                                    const std::function<bool(const Iteration&)>& on_iteration) {
  constexpr int iterations_of_a_turn = 3;
  OptimiserSummary all;
  all.p = state.p;
  bool first = true;
  for (int done = state.iterations; done < options.max_iterations || first; first = false) {
    if (!objective.hold_shapes(all.p)) {
      all.reason = "no stress-free reference shape sags into the scan";
      return all;
    }
    OptimiserOptions turn = options;
    turn.max_iterations = std::min(done + iterations_of_a_turn, std::max(options.max_iterations, done + 1));
    OptimiserSummary s = minimise(objective, OptimiserState{done, all.p, {}}, turn, on_iteration);
    const double moved = (s.p - all.p).cwiseAbs().maxCoeff();
    s.start_cost = first ? s.start_cost : all.start_cost;
    s.evaluations += all.evaluations, s.steps += all.steps, s.work += all.work;
    const bool stands = s.iterations == done;
    done = s.iterations;
    all = std::move(s);
    if (!all.succeeded || all.interrupted) return all;
    all.converged = moved < options.step_tolerance;
    all.reason = all.converged ? "shape and parameters stay from turn to turn" : "too many iterations";
    if (all.converged || stands) break;
  }
  return all;
}

}  // namespace pliant
