#include "estimation/optimiser.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace pliant {

namespace {

/// What the optimisers share: bookkeeping of the best point and the end.
class Run {
 public:
  Run(Objective& objective, const OptimiserOptions& options, const std::function<bool(const Iteration&)>& on_iteration)
      : objective_(objective), options_(options), on_iteration_(on_iteration) {}

  CostEvaluation evaluate(const VectorX& p, bool by_adjoint) {
    CostEvaluation e = by_adjoint ? objective_.gradient(p) : objective_.linearise(p);
    ++summary.evaluations;
    summary.steps += e.steps;
    return e;
  }
  bool begin(const VectorX& p, bool by_adjoint) {
    summary.p = objective_.parameters().clamp(p);
    summary.evaluation = evaluate(summary.p, by_adjoint);
    summary.succeeded = summary.evaluation.succeeded;
    summary.start_cost = summary.evaluation.cost;
    if (!summary.succeeded) summary.reason = "the start cannot be simulated: " + summary.evaluation.failure;
    return summary.succeeded;
  }
  /// Reports an iteration; true where the run is to end.
  bool report(double damping, bool accepted) {
    ++summary.iterations;
    if (on_iteration_ && !on_iteration_({summary.iterations, summary.evaluation.cost, damping, accepted, summary.p,
                                         summary.evaluation.surface_rms()})) {
      summary.interrupted = true;
      return end(false, "interrupted");
    }
    if (summary.iterations >= options_.max_iterations) return end(false, "reached the most iterations allowed");
    return false;
  }
  bool end(bool converged, const char* reason) {
    summary.converged = converged;
    summary.reason = reason;
    return true;
  }
  VectorX clamp(const VectorX& p) const { return objective_.parameters().clamp(p); }

  OptimiserSummary summary;

 private:
  Objective& objective_;
  const OptimiserOptions& options_;
  const std::function<bool(const Iteration&)>& on_iteration_;
};

void levenberg_marquardt(Run& run, const OptimiserOptions& options) {
  OptimiserSummary& s = run.summary;
  double lambda = 1e-2;
  for (bool done = false; !done;) {
    const MatrixX& H = s.evaluation.gauss_newton;
    const VectorX& g = s.evaluation.gradient;
    const double floor = 1e-9 * std::max(H.trace() / double(H.rows()), 1e-300);
    MatrixX damped = H;
    damped.diagonal() += lambda * H.diagonal().cwiseMax(floor);
    VectorX step = -damped.ldlt().solve(g);
    const double longest = step.cwiseAbs().maxCoeff();
    if (longest > options.max_step) step *= options.max_step / longest;
    const VectorX trial = run.clamp(s.p + step);
    const double moved = (trial - s.p).cwiseAbs().maxCoeff();
    if (moved == 0.0) {
      run.end(true, "the step is zero");
      return;
    }
    const double predicted = -(g.dot(trial - s.p) + 0.5 * (trial - s.p).dot(H * (trial - s.p)));
    CostEvaluation e = run.evaluate(trial, false);
    const double gain = s.evaluation.cost - e.cost;
    const bool accepted = e.succeeded && gain > 0.0;
    if (accepted) {
      const double quality = predicted > 0.0 ? gain / predicted : 0.0;
      lambda = std::clamp(quality > 0.75 ? lambda / 5.0 : quality < 0.25 ? lambda * 3.0 : lambda, 1e-8, 1e8);
      const bool small = moved < options.step_tolerance || gain < options.cost_tolerance * s.evaluation.cost;
      s.p = trial;
      s.evaluation = std::move(e);
      if (small) done = run.end(true, "the cost no longer falls");
    } else {
      // Where a step promises or moves next to nothing, the point is as good as the cost's smoothness allows.
      if (moved < options.step_tolerance || predicted < options.cost_tolerance * s.evaluation.cost) done = run.end(true, "no step lowers the cost");
      lambda = std::min(std::max(lambda, 1e-3) * 5.0, 1e8);
    }
    const bool finished = done;
    const std::string reason = s.reason;
    if (run.report(lambda, accepted) && finished && !s.interrupted) {
      s.converged = true;
      s.reason = reason;
    }
    done = done || s.interrupted || s.iterations >= options.max_iterations;
  }
}

void rprop(Run& run, const OptimiserOptions& options) {
  OptimiserSummary& s = run.summary;
  VectorX p = s.p, gradient = s.evaluation.gradient, last = VectorX::Zero(p.size());
  VectorX length = VectorX::Constant(p.size(), 0.1);
  for (;;) {
    for (Eigen::Index i = 0; i < p.size(); ++i) {
      const double sign = gradient[i] * last[i];
      if (sign > 0.0) length[i] = std::min(length[i] * 1.2, options.max_step);
      if (sign < 0.0) length[i] *= 0.5, gradient[i] = 0.0;
      p[i] -= std::copysign(length[i], gradient[i]) * (gradient[i] != 0.0);
    }
    last = gradient;
    p = run.clamp(p);
    CostEvaluation e = run.evaluate(p, true);
    const bool better = e.succeeded && e.cost < s.evaluation.cost;
    if (e.succeeded) {
      gradient = e.gradient;
    } else {  // back to the best point with shorter steps
      p = s.p, gradient = s.evaluation.gradient, length *= 0.25;
    }
    if (better) s.p = p, s.evaluation = std::move(e);
    if (run.report(length.maxCoeff(), better)) return;
    if (length.maxCoeff() < options.step_tolerance) {
      run.end(true, "steps became short");
      return;
    }
  }
}

void gradient_descent(Run& run, const OptimiserOptions& options) {
  OptimiserSummary& s = run.summary;
  double length = 0.1;
  for (;;) {
    const VectorX direction = -s.evaluation.gradient / std::max(s.evaluation.gradient.cwiseAbs().maxCoeff(), 1e-300);
    const VectorX trial = run.clamp(s.p + length * direction);
    CostEvaluation e = run.evaluate(trial, true);
    const bool better = e.succeeded && e.cost < s.evaluation.cost;
    if (better) s.p = trial, s.evaluation = std::move(e);
    length = better ? std::min(1.5 * length, options.max_step) : 0.4 * length;
    if (run.report(length, better)) return;
    if (length < options.step_tolerance) {
      run.end(true, "steps became short");
      return;
    }
  }
}

}  // namespace

OptimiserSummary minimise(Objective& objective, const VectorX& p, const OptimiserOptions& options,
                          const std::function<bool(const Iteration&)>& on_iteration) {
  Run run(objective, options, on_iteration);
  const bool by_adjoint = options.kind != OptimiserKind::LevenbergMarquardt;
  if (!run.begin(p, by_adjoint)) return run.summary;
  if (run.summary.p.size() == 0) {
    run.end(true, "nothing is estimated");
    return run.summary;
  }
  switch (options.kind) {
    case OptimiserKind::LevenbergMarquardt: levenberg_marquardt(run, options); break;
    case OptimiserKind::Rprop: rprop(run, options); break;
    case OptimiserKind::GradientDescent: gradient_descent(run, options); break;
  }
  return run.summary;
}

}  // namespace pliant
