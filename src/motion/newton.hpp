#pragma once

#include <optional>
#include <string>

#include "base/types.hpp"
#include "solvers/linear_solver.hpp"

namespace pliant {

struct NewtonOptions {
  double tolerance = 1e-9;  ///< of the residual, relative to the forces that meet in it, (0, 1)
  int max_iterations = 60;  ///< >= 1
};

/// A system of equations in positions as `newton` meets it: forces that balance, at rest or at the end of a step.
class NewtonProblem {
 public:
  virtual ~NewtonProblem() = default;

  /// Makes all that follows refer to x. Returns the energy [J] whose gradient the residual is, where there is one; not
  /// finite where x is no possible state.
  virtual std::optional<double> linearise(const Points& x) = 0;
  /// Size of terms that cancel in the energy [J]: rounding is relative to that.
  virtual double energy_scale() const { return 0.0; }
  struct Residual {
    double norm = 0.0, scale = 0.0;  ///< of the forces out of balance, and of those that meet in them
  };
  /// The forces out of balance at x.
  virtual Residual residual() = 0;
  /// Norm of residual that rounded positions alone leave.
  virtual double residual_rounding() const { return 0.0; }
  /// Newton's step from x, with a matrix that leads downhill where the exact one does not. Returns why there is none,
  /// or nothing.
  [[nodiscard]] virtual std::string find_step(Points& step) = 0;
  /// Derivative of the energy along a step.
  virtual double slope(const Points& step) const = 0;
  /// Length of the next step from the last `linearise`, roughly, with the matrix of the last `find_step`.
  virtual double next_step_length() = 0;
  /// Chooses how the step from x is taken. Returns the largest share of it that makes sense.
  virtual double prepare_move(const Points& x, const Points& step) {
    (void)x, (void)step;
    return 1.0;
  }
  /// out = x moved by a share of the step.
  virtual void move(const Points& x, const Points& step, double share, Points& out) { out = x + share * step; }
  /// Longest edge of what moves [m].
  virtual double size() const = 0;
};

/// Newton's method with backtracking. Where the problem has an energy, a share of the step is good where that falls
/// (Armijo's rule). Where it has none, where the next step from there, with the matrix at hand, is shorter (natural
/// monotonicity, Deuflhard 2004, section 3.3): residuals themselves may rise on the way to the solution, by orders of
/// magnitude for slender or nearly incompressible bodies. Keeps its vectors from call to call.
class Newton {
 public:
  explicit Newton(const NewtonOptions& options = {}) : options_(options) {}
  const NewtonOptions& options() const { return options_; }

  /// @param x  in: a guess; out: the solution, or the best found. The problem is linearised there.
  SolveSummary solve(NewtonProblem& problem, Points& x);
  const std::string& failure() const { return failure_; }  ///< of the last solve, in words

 private:
  [[nodiscard]] bool descend(NewtonProblem& problem, Points& x, double& energy, double last_norm);
  [[nodiscard]] bool contract(NewtonProblem& problem, Points& x);

  NewtonOptions options_;
  NewtonProblem::Residual residual_;
  Points step_, trial_;
  std::string failure_;
};

}  // namespace pliant
