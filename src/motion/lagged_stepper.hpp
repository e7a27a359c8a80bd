#pragma once

#include <array>
#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "solvers/linear_solver.hpp"

namespace pliant {

/// Node positions [m] and velocities [m/s], n x 3 each.
struct State {
  Points x, v;
};

struct StepOptions {
  double dt = 0.0;             ///< [s], > 0
  double newmark_theta = 0.5;  ///< [0.5, 1): weight of the step's end; above 0.5 adds numerical damping
  /// Where in the step contact acts, (0.5, 1]: 1 is backward Euler, which damps an impact by an error of first order;
  /// near 0.5 the error nearly vanishes, but stiff contact rings.
  double contact_weight = 0.6;
  /// Rotations are those of x + this dt v, [0, 1]: 0 takes the start's, as in the paper, an error of first order;
  /// 1/2 predicts the middle of the step, of second order.
  double rotation_prediction = 0.5;
  SolverOptions solver;
};

/// One step of the Newmark scheme with lagged rotations (Weiss 2020, eq. 14-15, the sign of the (1 - theta) dt K term
/// corrected: it is subtracted). With Delta = x' - x and the terms' affine forces,
///   (1/(theta dt) + alpha) M Delta = M v / theta + dt sum of f(x + s Delta),
///   v' = Delta / (theta dt) - (1 - theta)/theta v,
/// s = theta + beta/dt for blended terms (the stiffness damping's share with them), the contact's weight, or 1.
/// One linear system a step; its tangent and adjoint solve with the same (symmetric) matrix.
class LaggedStepper {
 public:
  /// Terms may share data; they belong to this stepper and are used by one thread.
  LaggedStepper(std::shared_ptr<const Body> body, std::vector<std::unique_ptr<ForceTerm>> terms,
                const StepOptions& options);

  const StepOptions& options() const { return options_; }
  /// For frames that are not equally far apart.
  void set_time_step(double dt) { options_.dt = dt; }
  void set_parameters(const VectorX& theta);
  /// Nodes that stay where they are (strong Dirichlet elimination).
  void hold(std::vector<int> nodes) { held_ = std::move(nodes); }

  /// Linearises and factorises about a step's start. False where the matrix is not positive definite or not finite.
  [[nodiscard]] bool prepare(const State& start);
  /// Delta of the prepared step; in: a guess (dt v is a good one). Not converged or not finite: `converged` is false.
  [[nodiscard]] SolveSummary solve(const State& start, Points& delta);
  /// start -> end.
  void advance(const Points& delta, State& state) const;

  /// Change of the end for a change of start and theta, about the prepared step. `change` goes in as that of the start
  /// and comes out as that of the end.
  void tangent(const State& start, const Points& delta, const VectorX& d_theta, State& change);
  /// Cotangent of the start for one of the end, in place; theta_bar accumulates.
  void adjoint(const State& start, const Points& delta, State& bar, VectorX& theta_bar);

  const BlockMatrix& matrix() const { return matrix_; }

 private:
  double prediction(ForceTerm::Lag lag) const {
    return options_.dt * (lag == ForceTerm::Lag::Rotation ? options_.rotation_prediction : options_.contact_weight);
  }
  double weight(ForceTerm::At at) const;
  /// Sets `points_at_` to the positions x + s Delta at which terms act.
  void set_points_at(const State& start, const Points& delta);
  double mass_factor() const { return density_ * (1.0 / (options_.newmark_theta * options_.dt) + mass_damping_); }
  void clear_held(Points& points) const;

  std::shared_ptr<const Body> body_;
  std::vector<std::unique_ptr<ForceTerm>> terms_;
  StepOptions options_;
  std::vector<int> held_;
  double mass_damping_ = 0.0, stiffness_damping_ = 0.0, density_ = 0.0;
  Vector3 gravity_ = Vector3::Zero();

  BlockMatrix matrix_;
  std::unique_ptr<LinearSolver> solver_;
  std::array<Points, 3> points_at_, bar_at_;    // by ForceTerm::At
  std::array<Points, 2> lag_, d_lag_, lag_bar_;  // by ForceTerm::Lag
  Points force_, d_blended_, d_force_, w_, mass_part_;
  VectorX solution_;
};

}  // namespace pliant
