#include "motion/stepper.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace pliant {

Stepper::Stepper(std::shared_ptr<const Body> body, std::vector<std::unique_ptr<ForceTerm>> terms,
                 const MotionBlocks& blocks, const StepOptions& options)
    : body_(std::move(body)),
      terms_(std::move(terms)),
      mass_damping_block_(blocks.mass_damping),
      stiffness_damping_block_(blocks.stiffness_damping),
      density_block_(blocks.density),
      options_(options),
      matrix_(body_->pattern) {
  if (!(options.dt > 0.0)) throw std::invalid_argument("the time step must be positive");
  if (!(options.newmark_theta >= 0.5 && options.newmark_theta < 1.0))
    throw std::invalid_argument("Newmark's theta must lie in [0.5, 1)");
  solver_ = make_linear_solver(body_->pattern, options.solver);
  if (!(options_.contact_weight > 0.5 && options_.contact_weight <= 1.0))
    throw std::invalid_argument("the contact's weight must lie in (0.5, 1]");
  if (!(options_.rotation_prediction >= 0.0 && options_.rotation_prediction <= 1.0))
    throw std::invalid_argument("the prediction of rotations must lie in [0, 1]");
  for (Points* p : {&force_, &d_blended_, &d_force_, &w_, &mass_part_, &residual_, &inertia_})
    p->setZero(body_->node_count(), 3);
  for (auto* points : {&lag_, &d_lag_, &lag_bar_})
    for (Points& p : *points) p.setZero(body_->node_count(), 3);
  for (auto* points : {&points_at_, &bar_at_})
    for (Points& p : *points) p.setZero(body_->node_count(), 3);
  solution_.setZero(3 * body_->node_count());
}

void Stepper::set_parameters(const VectorX& parameters) {
  mass_damping_ = parameters[mass_damping_block_];
  stiffness_damping_ = parameters[stiffness_damping_block_];
  density_ = parameters[density_block_];
  adjoint_solutions_ = 0;
  for (auto& term : terms_) term->set_parameters(parameters);
}

namespace {
constexpr std::array all_lags = {ForceTerm::Lag::Rotation, ForceTerm::Lag::Contact};
constexpr std::array all_ats = {ForceTerm::At::Blended, ForceTerm::At::Contact, ForceTerm::At::End};
}  // namespace

Stepper::Scheme Stepper::scheme() const {
  Scheme s;
  s.dt = options_.dt;
  s.at = {options_.newmark_theta + stiffness_damping_ / options_.dt, options_.contact_weight, 1.0};
  if (is_newton()) {
    s.lag = {options_.newmark_theta, options_.contact_weight};
    s.prediction = {0.0, 0.0};
  } else {
    s.lag = {0.0, 0.0};
    s.prediction = {options_.dt * options_.rotation_prediction, options_.dt * options_.contact_weight};
  }
  return s;
}

Stepper::Scheme Stepper::static_scheme() { return {{1.0, 1.0, 1.0}, {1.0, 1.0}, {0.0, 0.0}, 1.0, false}; }

void Stepper::set_points_at(const Scheme& s, const Points& x, const Points& delta) {
  for (const auto at : all_ats) points_at_[std::size_t(at)] = x + s.at[std::size_t(at)] * delta;
}

void Stepper::clear_held(Points& points) const {
  for (const int node : held_) points.row(node).setZero();
}

void Stepper::carry(Embedding points, std::vector<double> masses) {
  if (points.point_count() != int(masses.size())) throw std::invalid_argument("one mass a point is expected");
  carried_ = std::move(points);
  carried_mass_ = std::move(masses);
}

void Stepper::add_carried(double scale, const Points& v, Points& out) const {
  for (int i = 0; i < carried_.point_count(); ++i)
    carried_.add_transpose(i, scale * carried_mass_[std::size_t(i)] * carried_.position(i, v), out);
}

void Stepper::add_inertia(double scale, const Points& v, Points& out) const {
  body_->add_mass_product(scale * density_, v, out);
  add_carried(scale, v, out);
}

void Stepper::set_mass_matrix(const Scheme& s, BlockMatrix& matrix) const {
  matrix.set_zero();
  if (!s.has_mass) return;
  const double m = mass_factor();
  for (std::size_t b = 0; b < body_->mass.size(); ++b) {
    double* block = matrix.block(int(b));
    block[0] = block[4] = block[8] = m * body_->mass[b];
  }
  for (int i = 0; i < carried_.point_count(); ++i) {
    const double scale = carried_mass_[std::size_t(i)] / (options_.newmark_theta * s.dt);
    const auto nodes = carried_.nodes(i);
    const auto weights = carried_.weights(i);
    for (std::size_t a = 0; a < nodes.size(); ++a)
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        double* block = matrix.block(body_->pattern->find(nodes[a], nodes[b]));  // nodes of one element always meet
        for (const int d : {0, 4, 8}) block[d] += scale * weights[a] * weights[b];
      }
  }
}

bool Stepper::prepare(const State& start) {
  if (!start.x.allFinite() || !start.v.allFinite()) return false;
  if (is_newton()) return true;
  const Scheme s = scheme();
  for (const auto lag : all_lags) lag_[std::size_t(lag)] = start.x + s.prediction[std::size_t(lag)] * start.v;
  return factorise(s);
}

bool Stepper::prepare(const State& start, const Points& delta) {
  if (!start.x.allFinite() || !delta.allFinite()) return false;
  for (const auto lag : all_lags) {
    const double share = lag == ForceTerm::Lag::Rotation ? options_.newmark_theta : options_.contact_weight;
    lag_[std::size_t(lag)] = start.x + share * delta;
  }
  return factorise(scheme());
}

bool Stepper::factorise(const Scheme& s) {
  set_mass_matrix(s, matrix_);
  for (auto& term : terms_) {
    term->linearise(lag_[std::size_t(term->lag())]);
    term->add_matrix(s.dt * s.at[std::size_t(term->at())], matrix_);
  }
  for (const int node : held_) matrix_.constrain(node);
  return solver_->factorise(matrix_);
}

SolveSummary Stepper::solve(const State& start, Points& delta) {
  if (is_newton()) {
    inertia_.setZero();
    add_inertia(1.0 / options_.newmark_theta, start.v, inertia_);
    clear_held(delta);
    return newton(scheme(), start.x, inertia_, delta);
  }
  force_.setZero();
  for (auto& term : terms_) term->add_force(start.x, force_);
  force_ *= options_.dt;
  add_inertia(1.0 / options_.newmark_theta, start.v, force_);
  clear_held(force_);
  clear_held(delta);
  solution_ = flat(delta);
  const SolveSummary summary = solver_->solve(flat(force_), solution_);
  delta = as_points(solution_);
  SolveSummary checked = summary;
  checked.converged = summary.converged && delta.allFinite();
  return checked;
}

void Stepper::advance(const Points& delta, State& state) const {
  const double t = options_.newmark_theta;
  state.x += delta;
  state.v = delta / (t * options_.dt) - (1.0 - t) / t * state.v;
}

GeneralSolver& Stepper::general() {
  if (!general_) {
    general_ = std::make_unique<GeneralSolver>(body_->pattern, options_.solver.kind);
    exact_matrix_ = BlockMatrix(body_->pattern);
  }
  return *general_;
}

void Stepper::linearise(const Scheme& s, const Points& x, const Points& delta) {
  for (const auto lag : all_lags) lag_[std::size_t(lag)] = x + s.lag[std::size_t(lag)] * delta;
  for (auto& term : terms_) term->linearise(lag_[std::size_t(term->lag())]);
}

double Stepper::residual(const Scheme& s, const Points& x, const Points& delta, const Points& inertia,
                         double& force_scale) {
  set_points_at(s, x, delta);
  residual_ = -inertia;
  force_scale = inertia.norm();
  if (s.has_mass) {
    body_->add_mass_product(mass_factor(), delta, residual_);
    add_carried(1.0 / (options_.newmark_theta * s.dt), delta, residual_);
  }
  for (auto& term : terms_) {
    force_.setZero();
    term->add_force(points_at_[std::size_t(term->at())], force_);
    force_scale += s.dt * force_.norm();
    residual_ -= s.dt * force_;
  }
  clear_held(residual_);
  return residual_.norm();
}

bool Stepper::factorise_exact(const Scheme& s, const Points& x, const Points& delta) {
  GeneralSolver& solver = general();
  set_points_at(s, x, delta);
  set_mass_matrix(s, matrix_);
  for (auto& term : terms_) term->add_matrix(s.dt * s.at[std::size_t(term->at())], matrix_);
  exact_matrix_ = matrix_;
  for (auto& term : terms_)
    term->add_lag_matrix(points_at_[std::size_t(term->at())], s.dt * s.lag[std::size_t(term->lag())], exact_matrix_);
  for (const int node : held_) {
    matrix_.constrain(node);
    exact_matrix_.constrain(node);
  }
  double squares = 0.0;
  for (const int diagonal : body_->pattern->diagonal)
    for (int d = 0; d < 3; ++d) squares += std::pow(exact_matrix_.block(diagonal)[4 * d], 2);
  rounding_ = std::sqrt(squares) * body_->size() * std::numeric_limits<double>::epsilon();
  return solver.factorise(exact_matrix_, matrix_);
}

double Stepper::prepare_move(const Scheme& s, const Points& x, const Points& delta) {
  constexpr double hardly = 1e-3, farthest = 1.0;  // [rad]
  turns_ = false;
  if (s.has_mass) return 1.0;
  if (!turning_) turning_ = std::make_unique<TurningStep>(body_, options_.solver.kind);
  if (!turning_->fix(held_.empty() ? anchors_ : held_)) return 1.0;
  const double angle = turning_->prepare(x + delta, step_);
  // A straight step is as good for small angles, and free of rounding.
  turns_ = angle > hardly;
  return std::min(1.0, farthest / angle);
}

void Stepper::move(const Points& x, const Points& delta, double share) {
  if (!turns_) {
    trial_ = delta + share * step_;
    return;
  }
  turning_->move(share, trial_);
  trial_ -= x;
}

SolveSummary Stepper::newton(const Scheme& s, const Points& x, const Points& inertia, Points& delta) {
  SolveSummary summary;
  double force_scale = 0.0;
  linearise(s, x, delta);
  double r = residual(s, x, delta, inertia, force_scale);
  rounding_ = 0.0;
  const double size = body_->size();
  for (; summary.iterations < options_.newton.max_iterations; ++summary.iterations) {
    if (!std::isfinite(r)) return summary;
    summary.residual = force_scale > 0.0 ? r / force_scale : 0.0;
    if (summary.residual <= options_.newton.tolerance || r <= rounding_) {
      summary.converged = true;
      return summary;
    }
    if (!factorise_exact(s, x, delta)) return summary;
    // Where the exact matrix is indefinite, Newton's step leads to whatever point has no force, or nowhere. The
    // matrix with rotations kept leads downhill.
    const bool is_exact = s.has_mass || general_->symmetric_part_is_definite();
    const auto solve_for = [&](double tolerance, VectorX& y) {
      if (is_exact)
        general_->solve(-flat(residual_), y, tolerance);
      else
        general_->precondition(-flat(residual_), y);
    };
    VectorX direction;
    solve_for(1e-4, direction);
    step_ = as_points(std::as_const(direction));
    if (!step_.allFinite()) return summary;
    // Newton's next step after so small a one would be below rounding, which may leave more force than the tolerance:
    // stiff bodies under small loads.
    if (step_.cwiseAbs().maxCoeff() < 1e-11 * size) {
      delta += step_;
      summary.converged = true;
      return summary;
    }
    // Natural monotonicity (Deuflhard 2004, section 3.3): a share of the step is good where the next step from there,
    // with the matrix at hand, is shorter. Residuals themselves may rise on the way to the solution, by orders of
    // magnitude for slender or nearly incompressible bodies.
    const double length = step_.norm();
    double share = prepare_move(s, x, delta);
    for (int halving = 0;; ++halving, share *= 0.5) {
      move(x, delta, share);
      linearise(s, x, trial_);
      r = residual(s, x, trial_, inertia, force_scale);
      if (std::isfinite(r)) {
        solve_for(1e-2, direction);
        if (direction.norm() <= (1.0 - 0.25 * share) * length) break;
      }
      if (halving == 12) return summary;
    }
    delta = trial_;
  }
  return summary;
}

bool Stepper::prepare_derivatives(const State& start, const Points& delta) {
  if (!is_newton()) return prepare(start);
  linearise(scheme(), start.x, delta);
  return factorise_exact(scheme(), start.x, delta);
}

void Stepper::solve_derivative(const Points& b, Points& y, GeneralSolver::Side side) {
  general_->solve(flat(b), solution_, 1e-12, side);
  y = as_points(std::as_const(solution_));
}

void Stepper::prepare_reference_derivatives(const State& start, const Points& delta) {
  set_points_at(scheme(), start.x, delta);
  for (auto& term : terms_) term->linearise_reference(points_at_[std::size_t(term->at())]);
}

void Stepper::tangent(const State& start, const Points& delta, const VectorX& d_theta, State& change,
                      const Points* d_reference) {
  const Scheme s = scheme();
  const double dt = options_.dt, t = options_.newmark_theta;
  const double d_beta = d_theta[stiffness_damping_block_];
  set_points_at(s, start.x, delta);
  d_blended_ = change.x + d_beta / dt * delta;
  for (const auto lag : all_lags) d_lag_[std::size_t(lag)] = change.x + s.prediction[std::size_t(lag)] * change.v;
  d_force_.setZero();
  if (d_reference && d_reference->isZero(0.0)) d_reference = nullptr;  // pulls and dampings leave it where it is
  for (auto& term : terms_) {
    const bool blended = term->at() == ForceTerm::At::Blended;
    term->add_force_tangent(points_at_[std::size_t(term->at())], d_lag_[std::size_t(term->lag())],
                            blended ? d_blended_ : change.x, d_theta, d_force_);
    if (d_reference) term->add_reference_tangent(*d_reference, d_force_);
  }
  d_force_ *= dt;
  mass_part_ = density_ / t * change.v;
  mass_part_ += d_theta[density_block_] / t * start.v;
  mass_part_ -=
      (d_theta[density_block_] * (1.0 / (t * dt) + mass_damping_) + density_ * d_theta[mass_damping_block_]) * delta;
  body_->add_mass_product(1.0, mass_part_, d_force_);
  add_carried(1.0 / t, change.v, d_force_);
  clear_held(d_force_);
  if (is_newton()) {
    solve_derivative(d_force_, w_, GeneralSolver::Side::Plain);
  } else {
    solution_ = flat(change.v) * dt;
    solver_->solve(flat(d_force_), solution_);
    w_ = as_points(std::as_const(solution_));
  }
  change.x += w_;
  change.v = w_ / (t * dt) - (1.0 - t) / t * change.v;
}

void Stepper::adjoint(const State& start, const Points& delta, State& bar, VectorX& theta_bar, Points* reference_bar) {
  const Scheme s = scheme();
  const double dt = options_.dt, t = options_.newmark_theta;
  set_points_at(s, start.x, delta);
  force_ = bar.x + bar.v / (t * dt);
  clear_held(force_);
  if (is_newton()) {
    solve_derivative(force_, w_, GeneralSolver::Side::Transposed);
  } else {
    // Successive steps' solutions lie on a smooth curve, but for what frames between them add.
    if (adjoint_solutions_ == 0)
      solution_.setZero();
    else
      solution_ = adjoint_solution_[0];
    if (adjoint_solutions_ > 1) solution_ += adjoint_solution_[0] - adjoint_solution_[1];
    solver_->solve(flat(force_), solution_);
    adjoint_solution_[1].swap(adjoint_solution_[0]);
    adjoint_solution_[0] = solution_;
    ++adjoint_solutions_;
    w_ = as_points(std::as_const(solution_));
  }
  clear_held(w_);

  mass_part_.setZero();
  body_->add_mass_product(1.0, w_, mass_part_);
  const double w_m_delta = mass_part_.cwiseProduct(delta).sum();
  theta_bar[mass_damping_block_] -= density_ * w_m_delta;
  theta_bar[density_block_] +=
      mass_part_.cwiseProduct(start.v).sum() / t - (1.0 / (t * dt) + mass_damping_) * w_m_delta;

  bar.v = -(1.0 - t) / t * bar.v + density_ / t * mass_part_;
  add_carried(1.0 / t, w_, bar.v);
  w_ *= dt;
  for (Points& p : lag_bar_) p.setZero();
  for (Points& p : bar_at_) p.setZero();
  for (auto& term : terms_) {
    const auto at = std::size_t(term->at());
    term->add_force_adjoint(points_at_[at], w_, lag_bar_[std::size_t(term->lag())], bar_at_[at], theta_bar);
    if (reference_bar) term->add_reference_adjoint(w_, *reference_bar);
  }
  theta_bar[stiffness_damping_block_] += bar_at_[std::size_t(ForceTerm::At::Blended)].cwiseProduct(delta).sum() / dt;
  for (const Points& p : bar_at_) bar.x += p;
  for (const auto lag : all_lags) {
    bar.x += lag_bar_[std::size_t(lag)];
    bar.v += s.prediction[std::size_t(lag)] * lag_bar_[std::size_t(lag)];
  }
}

SolveSummary Stepper::equilibrium(Points& x) {
  const Scheme s = static_scheme();
  inertia_.setZero();
  Points delta = Points::Zero(x.rows(), 3);
  SolveSummary summary = newton(s, x, inertia_, delta);
  x += delta;
  if (summary.converged) summary.converged = prepare_equilibrium_derivatives(x);
  return summary;
}

bool Stepper::prepare_equilibrium_derivatives(const Points& x) {
  const Points none = Points::Zero(x.rows(), 3);
  linearise(static_scheme(), x, none);
  for (auto& term : terms_) term->linearise_reference(x);
  return factorise_exact(static_scheme(), x, none);
}

Points Stepper::equilibrium_tangent(const Points& x, const VectorX& d_theta, const Points* d_reference) {
  const Points none = Points::Zero(x.rows(), 3);
  d_force_.setZero();
  for (auto& term : terms_) {
    term->add_force_tangent(x, none, none, d_theta, d_force_);
    if (d_reference) term->add_reference_tangent(*d_reference, d_force_);
  }
  clear_held(d_force_);
  Points change;
  solve_derivative(d_force_, change, GeneralSolver::Side::Plain);
  return change;
}

void Stepper::equilibrium_adjoint(const Points& x, const Points& x_bar, VectorX& theta_bar, Points* reference_bar) {
  force_ = x_bar;
  clear_held(force_);
  solve_derivative(force_, w_, GeneralSolver::Side::Transposed);
  clear_held(w_);
  for (auto& term : terms_) {
    term->add_force_adjoint(x, w_, lag_bar_[std::size_t(term->lag())], bar_at_[std::size_t(term->at())], theta_bar);
    if (reference_bar) term->add_reference_adjoint(w_, *reference_bar);
  }
}

}  // namespace pliant
