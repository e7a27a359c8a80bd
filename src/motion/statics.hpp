#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/force_term.hpp"
#include "motion/newton.hpp"
#include "motion/rotation_strain_step.hpp"
#include "solvers/conjugate_gradients.hpp"
#include "solvers/general_solver.hpp"

namespace pliant {

struct StaticsOptions {
  NewtonOptions newton;
  SolverKind solver = SolverKind::Automatic;
  /// Forces that meet count at least as this [N]: below, relative tolerances ask for nothing.
  double smallest_force = 0.0;
  /// The longest way of a node in an iteration [m], for contacts through which steps must not jump; 0: any.
  double longest_step = 0.0;
  /// Keep the last factorisation while conjugate gradients with it solve Newton's system in a few iterations: for many
  /// equilibria that follow each other closely. Of forces with a potential only.
  bool reuse_factor = false;
};

/// Equilibria of force terms, sum of f(x | x) = 0 at every row that is not held, and their derivatives. Where all
/// forces have a potential the equilibrium is a minimum of their sum, and the stiffness is symmetric: Newton's method
/// descends on the energy, with what makes the exact Hessian positive definite where it is not. Else (corotated forces
/// have none) steps that turn parts of the body (`RotationStrainStep`) are judged by natural monotonicity, with the
/// exact, slightly unsymmetric stiffness. One instance for one thread.
class Statics : private NewtonProblem {
 public:
  /// @param terms    stay alive as long as this
  /// @param pattern  of matrices; null: the body's. It may have rows below the nodes', of rigid bodies that are unknown
  Statics(std::shared_ptr<const Body> body, std::vector<ForceTerm*> terms, const StaticsOptions& options = {},
          std::shared_ptr<const BlockPattern> pattern = nullptr);

  /// Rows that stay where a guess has them.
  void hold(std::vector<int> rows) { held_ = std::move(rows); }
  /// Nodes that hardly move though nothing eliminates them: on the way to an equilibrium parts turn about them.
  void anchor(std::vector<int> nodes) { anchors_ = std::move(nodes); }
  /// Time [s] of the equilibrium, for forces that change with it.
  void set_time(double time) { time_ = time; }
  void set_smallest_force(double force) { options_.smallest_force = force; }

  /// Positions where the forces balance, from a guess. Not converged: x is the best found, and `failure` says why.
  [[nodiscard]] SolveSummary solve(Points& x);
  const std::string& failure() const { return newton_.failure(); }

  /// Makes ready for derivatives at an equilibrium. False where the matrix cannot be factorised; for forces with a
  /// potential also where it is not positive definite: the equilibrium is not stable, or nothing holds the object.
  [[nodiscard]] bool prepare_derivatives(const Points& x);
  /// Change of the equilibrium for a change of theta and, where given, of the stress-free reference.
  [[nodiscard]] Points tangent(const Points& x, const VectorX& d_theta, const Points* d_reference = nullptr);
  /// theta_bar and, where given, reference_bar += the cotangents for one of the equilibrium's positions.
  void adjoint(const Points& x, const Points& x_bar, VectorX& theta_bar, Points* reference_bar = nullptr);
  /// The same where the last `solve` found x and nothing has changed since: terms are linearised there.
  [[nodiscard]] bool prepare_derivatives_there();
  /// Where the terms were linearised last.
  const Points& linearised_at() const { return x_; }
  /// Change of the equilibrium for a change of the forces, rows x 3 [N]; zeros for what is held.
  const Points& response(const Points& forces);
  /// The same of several changes together, which costs less than one by one. In: of the forces; out: of the
  /// equilibrium.
  void respond(std::span<Points> changes);

 private:
  std::optional<double> linearise(const Points& x) override;
  double energy_scale() const override { return energy_scale_; }
  Residual residual() override;
  double residual_rounding() const override { return rounding_; }
  std::string find_step(Points& step) override;
  double slope(const Points& step) const override { return residual_.cwiseProduct(step).sum(); }
  double next_step_length() override;
  double prepare_move(const Points& x, const Points& step) override;
  void move(const Points& x, const Points& step, double share, Points& out) override;
  double size() const override { return body_->size(); }

  int rows() const { return pattern_->rows; }
  void clear_held(Points& points) const;
  void clear_matrix();
  void assemble_exact();
  /// The same without negative parts.
  void assemble_positive();
  void constrain(BlockMatrix& matrix) const;
  [[nodiscard]] bool solve_with_last_factor();
  void prepare_factor();
  /// Of the matrix at hand, its diagonal raised until it can be factorised: a rigid body that touches nothing yet can
  /// move freely.
  [[nodiscard]] bool factorise_lifted();
  [[nodiscard]] bool factorise_general();
  /// solution_ = A^-1 b or A^-T b with the matrix of the derivatives at hand.
  void solve_derivative(const Points& b, GeneralSolver::Side side);

  std::shared_ptr<const Body> body_;
  std::vector<ForceTerm*> terms_;
  StaticsOptions options_;
  std::shared_ptr<const BlockPattern> pattern_;
  std::vector<int> held_, anchors_;
  double time_ = 0.0;  // [s]
  Newton newton_;

  BlockMatrix matrix_, positive_;
  std::unique_ptr<LinearSolver> factor_;    // of symmetric stiffnesses
  std::unique_ptr<GeneralSolver> general_;  // of others
  std::unique_ptr<RotationStrainStep> turning_;
  PreconditionedConjugateGradients conjugate_gradients_;
  bool has_energy_ = false, has_factor_ = false, is_exact_ = false, turns_ = false;
  double energy_scale_ = 0.0, rounding_ = 0.0;
  Points x_, force_, residual_, response_;
  VectorX right_, solution_;
  MatrixX columns_, responses_;  // of several changes
};

}  // namespace pliant
