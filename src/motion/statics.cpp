#include "motion/statics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "motion/rounding.hpp"

namespace pliant {

Statics::Statics(std::shared_ptr<const Body> body, std::vector<ForceTerm*> terms, const StaticsOptions& options,
                 std::shared_ptr<const BlockPattern> pattern)
    : body_(std::move(body)),
      terms_(std::move(terms)),
      options_(options),
      pattern_(std::move(pattern)),
      newton_(options.newton) {
  if (!pattern_) pattern_ = body_->pattern;
}

void Statics::clear_held(Points& points) const {
  for (const int row : held_) points.row(row).setZero();
}

void Statics::constrain(BlockMatrix& matrix) const {
  for (const int row : held_) matrix.constrain(row);
}

SolveSummary Statics::solve(Points& x) {
  rounding_ = 0.0;
  return newton_.solve(*this, x);
}

std::optional<double> Statics::linearise(const Points& x) {
  x_ = x;
  double sum = 0.0;
  has_energy_ = true;
  energy_scale_ = 0.0;
  for (ForceTerm* term : terms_) {
    term->begin_step({nullptr, nullptr, time_, 0.0});
    term->linearise(x_);
    if (!has_energy_) continue;
    const std::optional<double> energy = term->potential(x_);
    has_energy_ = energy.has_value();
    if (!has_energy_) continue;
    sum += *energy;
    energy_scale_ += std::abs(*energy);
    if (!std::isfinite(sum)) return sum;  // no such state: the other terms do not matter
  }
  return has_energy_ ? std::optional(sum) : std::nullopt;
}

NewtonProblem::Residual Statics::residual() {
  residual_.setZero(rows(), 3);
  force_.resize(rows(), 3);
  double squares = 0.0;
  for (ForceTerm* term : terms_) {
    force_.setZero();
    term->add_force(x_, force_);
    squares += force_.squaredNorm();
    residual_ -= force_;
  }
  clear_held(residual_);
  return {residual_.norm(), std::max(std::sqrt(squares), options_.smallest_force)};
}

/// Motions need none of it: a matrix is most of the memory of a large body.
void Statics::clear_matrix() {
  if (!matrix_.shared_pattern())
    matrix_ = BlockMatrix(pattern_);
  else
    matrix_.set_zero();
}

void Statics::assemble_exact() {
  clear_matrix();
  for (ForceTerm* term : terms_) term->add_tangent_stiffness(x_, 1.0, matrix_);
  constrain(matrix_);
  rounding_ = rounding_of_residual(matrix_, body_->size());
}

void Statics::assemble_positive() {
  clear_matrix();
  for (ForceTerm* term : terms_) term->add_matrix(1.0, matrix_);
  constrain(matrix_);
}

bool Statics::solve_with_last_factor() {
  constexpr int most = 12;
  if (!options_.reuse_factor || !has_factor_) return false;
  if (stiffness_solver(options_.solver, *pattern_, 1e-10).kind == SolverKind::Multigrid) return false;  // no factor
  assemble_exact();
  // Direct factorisations are kept when the matrix changes.
  return conjugate_gradients_.solve(matrix_, *factor_, right_, solution_, 1e-4, most).converged;
}

void Statics::prepare_factor() {
  if (!factor_) factor_ = make_linear_solver(pattern_, stiffness_solver(options_.solver, *pattern_, 1e-10));
  factor_->set_positions(x_.topRows(body_->node_count()));
}

bool Statics::factorise_lifted() {
  double mean = 0.0;
  for (const int d : pattern_->diagonal) mean += Eigen::Map<const Matrix3>(matrix_.block(d)).trace();
  mean /= 3.0 * rows();
  for (double lift = 1e-8; lift < 1e2; lift *= 100.0) {
    for (const int d : pattern_->diagonal) Eigen::Map<Matrix3>(matrix_.block(d)).diagonal().array() += lift * mean;
    if (factor_->factorise(matrix_)) return true;
  }
  return false;
}

bool Statics::factorise_general() {
  if (!general_) {
    general_ = std::make_unique<GeneralSolver>(pattern_, options_.solver);
    positive_ = BlockMatrix(pattern_);
  }
  positive_.set_zero();
  for (ForceTerm* term : terms_) term->add_matrix(1.0, positive_);
  matrix_ = positive_;
  for (ForceTerm* term : terms_) term->add_lag_matrix(x_, 1.0, matrix_);
  constrain(positive_);
  constrain(matrix_);
  rounding_ = rounding_of_residual(matrix_, body_->size());
  general_->set_positions(x_.topRows(body_->node_count()));
  if (!general_->factorise(matrix_, positive_)) return false;
  // Where the exact matrix is indefinite, Newton's step leads to whatever point has no force, or nowhere. The matrix
  // with lag points kept leads downhill.
  is_exact_ = general_->symmetric_part_is_definite();
  return true;
}

std::string Statics::find_step(Points& step) {
  constexpr const char* singular = "the stiffness matrix is singular: insufficient Dirichlet constraints";
  right_ = -flat(residual_);
  if (has_energy_) {
    prepare_factor();
    if (!solve_with_last_factor()) {
      assemble_exact();
      has_factor_ = factor_->factorise(matrix_);
      if (!has_factor_) {
        assemble_positive();
        has_factor_ = factor_->factorise(matrix_) || factorise_lifted();
      }
      if (!has_factor_) return singular;
      solution_.setZero(right_.size());
      if (!factor_->solve(right_, solution_).converged) {  // an iteration has met a direction of negative stiffness
        assemble_positive();
        has_factor_ = factor_->factorise(matrix_) || factorise_lifted();
        solution_.setZero(right_.size());
        if (!has_factor_ || !factor_->solve(right_, solution_).converged) return singular;
      }
    }
  } else {
    if (!factorise_general()) return singular;
    if (is_exact_)
      general_->solve(right_, solution_, 1e-4);
    else
      general_->precondition(right_, solution_);
  }
  step = as_points(std::as_const(solution_));
  return {};
}

double Statics::next_step_length() {
  right_ = -flat(residual_);
  if (is_exact_)
    general_->solve(right_, solution_, 1e-2);
  else
    general_->precondition(right_, solution_);
  return solution_.norm();
}

double Statics::prepare_move(const Points& x, const Points& step) {
  constexpr double hardly = 1e-3, farthest = 1.0;  // [rad]
  turns_ = false;
  double share = 1.0;
  if (options_.longest_step > 0.0) share = std::min(share, options_.longest_step / step.rowwise().norm().maxCoeff());
  if (has_energy_) return share;
  if (!turning_) turning_ = std::make_unique<RotationStrainStep>(body_, options_.solver);
  if (!turning_->fix(held_.empty() ? anchors_ : held_)) return share;
  const double angle = turning_->prepare(x, step);
  // A straight step is as good for small angles, and free of rounding.
  turns_ = angle > hardly;
  return std::min(share, farthest / angle);
}

void Statics::move(const Points& x, const Points& step, double share, Points& out) {
  if (turns_)
    turning_->move(share, out);
  else
    out = x + share * step;
}

bool Statics::prepare_derivatives(const Points& x) {
  if (const auto energy = linearise(x); energy && !std::isfinite(*energy)) return false;
  return prepare_derivatives_there();
}

bool Statics::prepare_derivatives_there() {
  for (ForceTerm* term : terms_) term->linearise_reference(x_);
  if (!has_energy_) return factorise_general();
  prepare_factor();
  assemble_exact();
  return has_factor_ = factor_->factorise(matrix_);
}

void Statics::solve_derivative(const Points& b, GeneralSolver::Side side) {
  right_ = flat(b);
  solution_.setZero(right_.size());
  if (has_energy_)
    factor_->solve(right_, solution_);
  else
    general_->solve(right_, solution_, 1e-12, side);
}

const Points& Statics::response(const Points& forces) {
  force_ = forces;
  clear_held(force_);
  solve_derivative(force_, GeneralSolver::Side::Plain);
  response_ = as_points(std::as_const(solution_));
  return response_;
}

void Statics::respond(std::span<Points> changes) {
  if (!has_energy_) {
    for (Points& change : changes) change = response(change);
    return;
  }
  const auto count = Eigen::Index(changes.size());
  columns_.resize(3 * rows(), count);
  responses_.setZero(3 * rows(), count);
  for (Eigen::Index c = 0; c < count; ++c) {
    Points& change = changes[std::size_t(c)];
    clear_held(change);
    columns_.col(c) = flat(change);
  }
  factor_->solve_columns(columns_, responses_);
  for (Eigen::Index c = 0; c < count; ++c)
    changes[std::size_t(c)] = Eigen::Map<const Points>(responses_.col(c).data(), rows(), 3);
}

Points Statics::tangent(const Points& x, const VectorX& d_theta, const Points* d_reference) {
  const Points none = Points::Zero(rows(), 3);
  Points d_force = none;
  for (ForceTerm* term : terms_) {
    term->add_force_tangent(x, none, none, d_theta, d_force);
    if (d_reference) term->add_reference_tangent(*d_reference, d_force);
  }
  return response(d_force);
}

void Statics::adjoint(const Points& x, const Points& x_bar, VectorX& theta_bar, Points* reference_bar) {
  force_ = x_bar;
  clear_held(force_);
  solve_derivative(force_, GeneralSolver::Side::Transposed);
  Points w = as_points(std::as_const(solution_)), ignored = Points::Zero(rows(), 3);
  clear_held(w);
  for (ForceTerm* term : terms_) {
    term->add_force_adjoint(x, w, ignored, ignored, theta_bar);
    if (reference_bar) term->add_reference_adjoint(w, *reference_bar);
  }
}

}  // namespace pliant
