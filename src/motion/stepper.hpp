#pragma once

#include <array>
#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "elasticity/material.hpp"
#include "motion/newton.hpp"
#include "parameters/motion_blocks.hpp"
#include "solvers/general_solver.hpp"
#include "solvers/linear_solver.hpp"

namespace pliant {

/// Node positions [m] and velocities [m/s], n x 3 each.
struct State {
  Points x, v;
};

enum class Integrator {
  Lagged,  ///< rotations, contact and a law's tangent predicted from the start: one linear solve a step (Weiss 2020)
  Newton,  ///< fully implicit with the exact stiffness (Wang 2015)
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
  StiffnessDamping stiffness_damping = StiffnessDamping::Rayleigh;
  SolverOptions solver;
  Integrator integrator = Integrator::Lagged;
  NewtonOptions newton;
};

/// One step of the Newmark scheme with lagged rotations (Weiss 2020, eq. 14-15, the sign of the (1 - theta) dt K term
/// corrected: it is subtracted). With Delta = x' - x and the terms' affine forces,
///   (1/(theta dt) + alpha) M Delta = M v / theta + dt sum of f(x + s Delta),
///   v' = Delta / (theta dt) - (1 - theta)/theta v,
/// s = theta + beta/dt for blended terms (Rayleigh's stiffness damping with them), the contact's weight, or 1.
/// One linear system a step; its tangent and adjoint solve with the same (symmetric) matrix.
///
/// The fully implicit scheme is the same equation with lag points that move along: rotations are those of x + theta
/// Delta (the implicit midpoint for theta = 1/2), contact is that of x + w Delta. It is solved by `Newton`; tangent and
/// adjoint follow from the implicit function theorem with the exact, slightly unsymmetric matrix.
class Stepper : private NewtonProblem {
 public:
  /// Terms may share data; they belong to this stepper and are used by one thread.
  /// @param blocks  of dampings and density
  Stepper(std::shared_ptr<const Body> body, std::vector<std::unique_ptr<ForceTerm>> terms, const MotionBlocks& blocks,
          const StepOptions& options);

  const StepOptions& options() const { return options_; }
  /// The forces, for equilibria between steps (`Statics`). Steps are to be prepared again afterwards.
  std::vector<ForceTerm*> terms() const;
  /// For frames that are not equally far apart.
  void set_time_step(double dt) { options_.dt = dt; }
  /// Time [s] of the start of the steps to come, for forces that change with it.
  void set_time(double time) { time_ = time; }
  void set_parameters(const VectorX& theta);
  /// Where the nodes are stress-free from now on (`ForceTerm::set_reference`); parameters are to be set anew.
  void set_reference(const std::shared_ptr<const Body>& body);
  /// Nodes that stay where they are (strong Dirichlet elimination).
  void hold(std::vector<int> nodes) { held_ = std::move(nodes); }
  /// Point masses that move along with points of the body: they add the inertia sum_i m_i w_i w_i^T, w_i the points'
  /// weights, to the body's, and neither weight nor damping. One mass [kg] a point.
  void carry(Embedding points, std::vector<double> masses);

  /// Linearises and factorises about a step's start. False where the matrix is not positive definite or not finite.
  [[nodiscard]] bool prepare(const State& start);
  /// The same about where a step would end that is nearly known: steps of the lagged scheme can be repeated until their
  /// rotations and contact are those of their own end.
  [[nodiscard]] bool prepare(const State& start, const Points& delta);
  /// Delta of the prepared step; in: a guess (dt v is a good one). Not converged or not finite: `converged` is false.
  /// `iterations` are those of the linear solver, or Newton's.
  [[nodiscard]] SolveSummary solve(const State& start, Points& delta);
  /// start -> end.
  void advance(const Points& delta, State& state) const;

  /// Makes ready for `tangent` or `adjoint` of a step whose Delta is known. False where a matrix cannot be factorised.
  [[nodiscard]] bool prepare_derivatives(const State& start, const Points& delta);
  /// Changes of the end for changes of start, theta and, where given, of where the nodes are stress-free.
  /// @param d_theta      one direction a column
  /// @param changes      one a direction; in: of the start, out: of the end
  /// @param d_reference  one a direction, or none
  /// Directions go beside each other, four a thread.
  void tangents(const State& start, const Points& delta, const MatrixX& d_theta, std::span<State> changes,
                std::span<const Points> d_reference = {});
  /// Cotangent of the start for one of the end, in place; theta_bar and, where given, reference_bar accumulate.
  void adjoint(const State& start, const Points& delta, State& bar, VectorX& theta_bar,
               Points* reference_bar = nullptr);
  /// Makes ready for derivatives by the reference, after `prepare_derivatives`.
  void prepare_reference_derivatives(const State& start, const Points& delta);

  const BlockMatrix& matrix() const { return matrix_; }

 private:
  /// What a term's points are made of: p = x + lag Delta (+ prediction v), z = x + at Delta.
  struct Scheme {
    std::array<double, 3> at;
    std::array<double, 2> lag, prediction;
    double dt = 1.0;
  };
  Scheme scheme() const;
  /// Assembles and factorises the lagged step's matrix about the lag points at hand.
  [[nodiscard]] bool factorise(const Scheme& scheme);
  /// Sets `points_at_` to the positions x + s Delta at which terms act.
  void set_points_at(const Scheme& scheme, const Points& x, const Points& delta);
  double mass_factor() const { return density_ * (1.0 / (options_.newmark_theta * options_.dt) + mass_damping_); }
  void clear_held(Points& points) const;
  /// out += scale (density M + the carried masses) v
  void add_inertia(double scale, const Points& v, Points& out) const;
  /// out += scale times the carried masses times v
  void add_carried(double scale, const Points& v, Points& out) const;
  void set_mass_matrix(const Scheme& scheme, BlockMatrix& matrix) const;
  /// Linearises every term where its lag point is for this Delta.
  void linearise(const Scheme& scheme, const Points& x, const Points& delta);
  /// The exact matrix of the implicit equation about Delta, with terms linearised there, factorised.
  [[nodiscard]] bool factorise_exact(const Scheme& scheme);
  void begin(const State& start);

  // The implicit equation of Delta.
  std::optional<double> linearise(const Points& delta) override;
  Residual residual() override;
  double residual_rounding() const override { return rounding_; }
  std::string find_step(Points& step) override;
  double slope(const Points& step) const override { return residual_.cwiseProduct(step).sum(); }
  double next_step_length() override;
  double size() const override { return body_->size(); }

  /// A y = b or A^T y = b with the matrix of the derivatives at hand.
  void solve_derivative(const Points& b, Points& y, GeneralSolver::Side side);
  /// `d_force_`: changes of the step's right-hand side along directions from `first` on, Delta staying as it is.
  void find_changes_of_force(const State& start, const Points& delta, const MatrixX& d_theta,
                             std::span<const State> changes, std::span<const Points> d_reference, std::size_t first,
                             std::size_t count);
  bool is_newton() const { return options_.integrator == Integrator::Newton; }
  bool is_rayleigh() const { return options_.stiffness_damping == StiffnessDamping::Rayleigh; }
  GeneralSolver& general();

  std::shared_ptr<const Body> body_;
  std::vector<std::unique_ptr<ForceTerm>> terms_;
  ParameterHandle mass_damping_block_, stiffness_damping_block_, density_block_;
  StepOptions options_;
  std::vector<int> held_;
  double time_ = 0.0;
  Newton newton_;
  const Points* start_ = nullptr;  // of the implicit equation being solved
  Embedding carried_;
  std::vector<double> carried_mass_;
  double mass_damping_ = 0.0, stiffness_damping_ = 0.0, density_ = 0.0;

  BlockMatrix matrix_, exact_matrix_;
  double rounding_ = 0.0;  // residual that rounded positions alone leave, about the exact matrix at hand
  std::unique_ptr<LinearSolver> solver_;
  std::unique_ptr<GeneralSolver> general_;
  std::array<Points, 3> points_at_, bar_at_;  // by ForceTerm::At
  std::array<Points, 2> lag_, lag_bar_;       // by ForceTerm::Lag
  Points force_, w_, mass_part_, residual_, inertia_, delta_, no_change_;
  std::array<std::vector<Points>, 2> d_lag_;  // by ForceTerm::Lag; of each direction, as the two below
  std::vector<Points> d_blended_, d_force_;
  VectorX solution_, right_;
  MatrixX derivative_right_, derivative_solutions_;  // one direction a column, or the adjoint's one
  std::array<VectorX, 2> adjoint_solution_;  // of the last adjoint steps with these parameters: guesses of the next
  int adjoint_solutions_ = 0;
};

}  // namespace pliant
