#include "motion/newton.hpp"

#include <cmath>

namespace pliant {

SolveSummary Newton::solve(NewtonProblem& problem, Points& x) {
  SolveSummary summary;
  failure_.clear();
  const std::optional<double> start = problem.linearise(x);
  double energy = start.value_or(0.0);
  if (!std::isfinite(energy)) {
    failure_ = "the energy is not finite at the initial configuration";
    return summary;
  }
  residual_ = problem.residual();
  for (;; ++summary.iterations) {
    if (!std::isfinite(residual_.norm)) {
      failure_ = "the forces are not finite";
      return summary;
    }
    summary.residual = residual_.scale > 0.0 ? residual_.norm / residual_.scale : 0.0;
    if (summary.residual <= options_.tolerance || residual_.norm <= problem.residual_rounding()) {
      summary.converged = true;
      return summary;
    }
    if (summary.iterations == options_.max_iterations) {
      failure_ = "no equilibrium within " + std::to_string(options_.max_iterations) + " iterations";
      return summary;
    }
    failure_ = problem.find_step(step_);
    if (!failure_.empty()) return summary;
    if (!step_.allFinite()) {
      failure_ = "the stiffness is nearly singular";
      return summary;
    }
    if (start) {
      const bool moved = descend(problem, x, energy, residual_.norm);
      if (moved) continue;
      if (!failure_.empty()) return summary;
      (void)problem.linearise(x);
      residual_ = problem.residual();
      summary.converged = summary.residual < 1e3 * options_.tolerance;  // as far as rounding lets it
      if (!summary.converged) failure_ = "no step lowers the energy";
      return summary;
    }
    // Newton's next step after so small a one would be below rounding, which may leave more force than the tolerance:
    // stiff bodies under small loads.
    if (step_.cwiseAbs().maxCoeff() < 1e-11 * problem.size()) {
      x += step_;
      summary.converged = true;
      return summary;
    }
    if (!contract(problem, x)) {
      failure_ = "no step leads closer to the equilibrium";
      return summary;
    }
  }
}

bool Newton::descend(NewtonProblem& problem, Points& x, double& energy, double last_norm) {
  const double slope = problem.slope(step_);
  if (!std::isfinite(slope) || slope >= 0.0) {
    failure_ = "the stiffness is nearly singular";
    return false;
  }
  // What rounding leaves of the energy says nothing about steps that are smaller.
  const double rounding = 1e-13 * (problem.energy_scale() + std::abs(energy));
  double share = problem.prepare_move(x, step_);
  for (int halving = 0; halving < 40; ++halving, share *= 0.5) {
    problem.move(x, step_, share, trial_);
    const double trial_energy = *problem.linearise(trial_);
    if (!std::isfinite(trial_energy)) continue;
    const bool falls = trial_energy <= energy + 1e-4 * share * slope;
    if (!falls && -share * slope >= 1e3 * rounding) continue;
    const NewtonProblem::Residual there = problem.residual();
    if (!falls && there.norm >= last_norm) continue;
    x.swap(trial_);
    energy = trial_energy;
    residual_ = there;
    return true;
  }
  return false;
}

bool Newton::contract(NewtonProblem& problem, Points& x) {
  const double length = step_.norm();
  double share = problem.prepare_move(x, step_);
  for (int halving = 0; halving <= 12; ++halving, share *= 0.5) {
    problem.move(x, step_, share, trial_);
    (void)problem.linearise(trial_);
    residual_ = problem.residual();
    if (std::isfinite(residual_.norm) && problem.next_step_length() <= (1.0 - 0.25 * share) * length) {
      x.swap(trial_);
      return true;
    }
  }
  return false;
}

}  // namespace pliant
