#include "motion/stepper.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

#include "base/parallel.hpp"
#include "motion/rounding.hpp"

namespace pliant {

Stepper::Stepper(std::shared_ptr<const Body> body, std::vector<std::unique_ptr<ForceTerm>> terms,
                 const MotionBlocks& blocks, const StepOptions& options)
    : body_(std::move(body)),
      terms_(std::move(terms)),
      mass_damping_block_(blocks.mass_damping),
      stiffness_damping_block_(blocks.stiffness_damping),
      density_block_(blocks.density),
      options_(options),
      newton_(options.newton),
      matrix_(body_->pattern) {
  if (!(options.dt > 0.0)) throw std::invalid_argument("the time step must be positive");
  if (!(options.newmark_theta >= 0.5 && options.newmark_theta < 1.0))
    throw std::invalid_argument("Newmark's theta must lie in [0.5, 1)");
  solver_ = make_linear_solver(body_->pattern, options.solver);
  if (!(options_.contact_weight > 0.5 && options_.contact_weight <= 1.0))
    throw std::invalid_argument("the contact's weight must lie in (0.5, 1]");
  if (!(options_.rotation_prediction >= 0.0 && options_.rotation_prediction <= 1.0))
    throw std::invalid_argument("the prediction of rotations must lie in [0, 1]");
  for (Points* p : {&force_, &no_change_}) p->setZero(body_->node_count(), 3);
  solution_.setZero(3 * body_->node_count());
}

void Stepper::set_parameters(const VectorX& parameters) {
  mass_damping_ = parameters[mass_damping_block_];
  stiffness_damping_ = parameters[stiffness_damping_block_];
  density_ = parameters[density_block_];
  adjoint_solutions_ = 0;
  for (auto& term : terms_) term->set_parameters(parameters);
}

void Stepper::set_reference(const std::shared_ptr<const Body>& body) {
  for (auto& term : terms_) term->set_reference(body);
}

namespace {
constexpr std::array all_lags = {ForceTerm::Lag::Rotation, ForceTerm::Lag::Contact};
constexpr std::array all_ats = {ForceTerm::At::Blended, ForceTerm::At::Contact, ForceTerm::At::End};
}  // namespace

Stepper::Scheme Stepper::scheme() const {
  Scheme s;
  s.dt = options_.dt;
  s.at = {options_.newmark_theta + (is_rayleigh() ? stiffness_damping_ / options_.dt : 0.0), options_.contact_weight,
          1.0};
  if (is_newton()) {
    s.lag = {options_.newmark_theta, options_.contact_weight};
    s.prediction = {0.0, 0.0};
  } else {
    s.lag = {0.0, 0.0};
    s.prediction = {options_.dt * options_.rotation_prediction, options_.dt * options_.contact_weight};
  }
  return s;
}

std::vector<ForceTerm*> Stepper::terms() const {
  std::vector<ForceTerm*> all;
  for (const auto& term : terms_) all.push_back(term.get());
  return all;
}

void Stepper::begin(const State& start) {
  for (auto& term : terms_) term->begin_step({&start.x, &start.v, time_, options_.dt, options_.contact_weight});
}

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
  begin(start);
  if (is_newton()) return true;
  const Scheme s = scheme();
  for (const auto lag : all_lags) lag_[std::size_t(lag)] = start.x + s.prediction[std::size_t(lag)] * start.v;
  return factorise(s);
}

bool Stepper::prepare(const State& start, const Points& delta) {
  if (!start.x.allFinite() || !delta.allFinite()) return false;
  begin(start);
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
  solver_->set_positions(lag_[std::size_t(ForceTerm::Lag::Rotation)]);
  return solver_->factorise(matrix_);
}

SolveSummary Stepper::solve(const State& start, Points& delta) {
  if (is_newton()) {
    inertia_.setZero(body_->node_count(), 3);
    add_inertia(1.0 / options_.newmark_theta, start.v, inertia_);
    clear_held(delta);
    start_ = &start.x;
    rounding_ = 0.0;
    return newton_.solve(*this, delta);
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

std::optional<double> Stepper::linearise(const Points& delta) {
  delta_ = delta;
  linearise(scheme(), *start_, delta_);
  return std::nullopt;
}

NewtonProblem::Residual Stepper::residual() {
  const Scheme s = scheme();
  set_points_at(s, *start_, delta_);
  residual_ = -inertia_;
  double force_scale = inertia_.norm();
  body_->add_mass_product(mass_factor(), delta_, residual_);
  add_carried(1.0 / (options_.newmark_theta * s.dt), delta_, residual_);
  for (auto& term : terms_) {
    force_.setZero();
    term->add_force(points_at_[std::size_t(term->at())], force_);
    force_scale += s.dt * force_.norm();
    residual_ -= s.dt * force_;
  }
  clear_held(residual_);
  return {residual_.norm(), force_scale};
}

bool Stepper::factorise_exact(const Scheme& s) {
  GeneralSolver& solver = general();
  set_mass_matrix(s, matrix_);
  for (auto& term : terms_) term->add_matrix(s.dt * s.at[std::size_t(term->at())], matrix_);
  exact_matrix_ = matrix_;
  for (auto& term : terms_)
    term->add_lag_matrix(points_at_[std::size_t(term->at())], s.dt * s.lag[std::size_t(term->lag())], exact_matrix_);
  for (const int node : held_) {
    matrix_.constrain(node);
    exact_matrix_.constrain(node);
  }
  rounding_ = rounding_of_residual(exact_matrix_, body_->size());
  solver.set_positions(lag_[std::size_t(ForceTerm::Lag::Rotation)]);
  return solver.factorise(exact_matrix_, matrix_);
}

std::string Stepper::find_step(Points& step) {
  if (!factorise_exact(scheme())) return "the step's matrix cannot be factorised";
  right_ = -flat(residual_);
  general_->solve(right_, solution_, 1e-4);
  step = as_points(std::as_const(solution_));
  return {};
}

double Stepper::next_step_length() {
  right_ = -flat(residual_);
  general_->solve(right_, solution_, 1e-2);
  return solution_.norm();
}

bool Stepper::prepare_derivatives(const State& start, const Points& delta) {
  if (!is_newton()) return prepare(start);
  begin(start);
  linearise(scheme(), start.x, delta);
  set_points_at(scheme(), start.x, delta);
  return factorise_exact(scheme());
}

namespace {
constexpr double tolerance_of_implicit_derivatives = 1e-12;  // where no other is asked for
}  // namespace

void Stepper::solve_derivative(const Points& b, Points& y, GeneralSolver::Side side) {
  const double asked = options_.solver.derivative_tolerance;
  general_->solve(flat(b), solution_, asked > 0.0 ? asked : tolerance_of_implicit_derivatives, side);
  y = as_points(std::as_const(solution_));
}

void Stepper::prepare_reference_derivatives(const State& start, const Points& delta) {
  set_points_at(scheme(), start.x, delta);
  for (auto& term : terms_) term->linearise_reference(points_at_[std::size_t(term->at())]);
}

namespace {
constexpr std::size_t directions_together = 4;  // as many as wide registers take
}  // namespace

void Stepper::find_changes_of_force(const State& start, const Points& delta, const MatrixX& d_theta,
                                    std::span<const State> changes, std::span<const Points> d_reference,
                                    std::size_t first, std::size_t count) {
  const Scheme s = scheme();
  const double dt = options_.dt, t = options_.newmark_theta;
  std::array<const Points*, directions_together> lag_changes{}, z_changes{};
  const std::span<Points> forces(&d_force_[first], count);
  for (std::size_t c = first; c < first + count; ++c) {
    const State& change = changes[c];
    const double d_beta = is_rayleigh() ? d_theta(Eigen::Index(stiffness_damping_block_), Eigen::Index(c)) : 0.0;
    d_blended_[c] = change.x + d_beta / dt * delta;
    for (const auto lag : all_lags) d_lag_[std::size_t(lag)][c] = change.x + s.prediction[std::size_t(lag)] * change.v;
    d_force_[c].setZero();
  }
  std::array<const Points*, directions_together> along{};  // those that move the reference: pulls and dampings do not
  std::array<Points*, directions_together> into{};
  std::size_t moved = 0;
  for (std::size_t c = first; c < first + count && !d_reference.empty(); ++c)
    if (!d_reference[c].isZero(0.0)) along[moved] = &d_reference[c], into[moved++] = &d_force_[c];
  for (auto& term : terms_) {
    const bool blended = term->at() == ForceTerm::At::Blended, way_alone = term->sees_way_alone();
    const std::vector<Points>& lag = d_lag_[std::size_t(term->lag())];
    for (std::size_t l = 0; l < count; ++l) {
      lag_changes[l] = &lag[first + l];
      z_changes[l] = way_alone ? &no_change_ : blended ? &d_blended_[first + l] : &changes[first + l].x;
    }
    const Points& z = points_at_[std::size_t(term->at())];
    term->add_force_tangents(z,
                             {{lag_changes.data(), count},
                              {z_changes.data(), count},
                              d_theta.middleCols(Eigen::Index(first), Eigen::Index(count)),
                              Eigen::Index(first)},
                             forces);
    if (moved > 0) term->add_reference_tangents({along.data(), moved}, {into.data(), moved});
    if (!term->sees_start() || way_alone) continue;
    for (std::size_t c = first; c < first + count; ++c)
      term->add_start_tangent(z, changes[c].x, changes[c].v, d_force_[c]);
  }
  for (std::size_t c = first; c < first + count; ++c) {
    Points &force = d_force_[c], &mass_part = d_blended_[c];
    const Points& v = changes[c].v;
    const double d_density = d_theta(Eigen::Index(density_block_), Eigen::Index(c)),
                 d_damping = d_theta(Eigen::Index(mass_damping_block_), Eigen::Index(c));
    force *= dt;
    mass_part = density_ / t * v;
    mass_part += d_density / t * start.v;
    mass_part -= (d_density * (1.0 / (t * dt) + mass_damping_) + density_ * d_damping) * delta;
    body_->add_mass_product(1.0, mass_part, force);
    add_carried(1.0 / t, v, force);
    clear_held(force);
  }
}

void Stepper::tangents(const State& start, const Points& delta, const MatrixX& d_theta, std::span<State> changes,
                       std::span<const Points> d_reference) {
  const double dt = options_.dt, t = options_.newmark_theta;
  const auto count = std::size_t(d_theta.cols());
  set_points_at(scheme(), start.x, delta);
  derivative_right_.resize(delta.size(), d_theta.cols());
  derivative_solutions_.resize(delta.size(), d_theta.cols());
  for (auto* points : {&d_blended_, &d_lag_[0], &d_lag_[1], &d_force_})
    if (points->size() < count) points->resize(count, Points(delta.rows(), 3));
  for (auto& term : terms_) term->prepare_tangents(points_at_[std::size_t(term->at())], d_theta);
  const std::size_t parts = (count + directions_together - 1) / directions_together;
  const auto beside = [&](const auto& of_direction_range) {
    const auto part = [&](std::size_t i) {
      const std::size_t first = i * directions_together;
      of_direction_range(first, std::min(directions_together, count - first));
    };
    parallel_tasks(parts, std::cref(part));
  };
  beside([&](std::size_t first, std::size_t some) {
    find_changes_of_force(start, delta, d_theta, changes, d_reference, first, some);
    for (std::size_t c = first; c < first + some && !is_newton(); ++c) {
      derivative_right_.col(Eigen::Index(c)) = flat(d_force_[c]);
      derivative_solutions_.col(Eigen::Index(c)) = flat(changes[c].v) * dt;
    }
  });
  if (is_newton()) {
    for (std::size_t c = 0; c < count; ++c) {
      solve_derivative(d_force_[c], w_, GeneralSolver::Side::Plain);
      derivative_solutions_.col(Eigen::Index(c)) = flat(w_);
    }
  } else {
    solver_->solve_columns(derivative_right_, derivative_solutions_);
  }
  beside([&](std::size_t first, std::size_t some) {
    for (std::size_t c = first; c < first + some; ++c) {
      State& change = changes[c];
      const Eigen::Map<const Points> solved(&derivative_solutions_(0, Eigen::Index(c)), delta.rows(), 3);
      change.x += solved;
      change.v = solved / (t * dt) - (1.0 - t) / t * change.v;
    }
  });
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
    derivative_right_ = flat(force_);
    if (adjoint_solutions_ == 0)
      derivative_solutions_.setZero(delta.size(), 1);
    else
      derivative_solutions_ = adjoint_solution_[0];
    if (adjoint_solutions_ > 1) derivative_solutions_ += adjoint_solution_[0] - adjoint_solution_[1];
    solver_->solve_columns(derivative_right_, derivative_solutions_);
    adjoint_solution_[1].swap(adjoint_solution_[0]);
    adjoint_solution_[0] = derivative_solutions_;
    ++adjoint_solutions_;
    w_ = as_points(std::as_const(adjoint_solution_[0]));
  }
  clear_held(w_);

  mass_part_.setZero(delta.rows(), 3);
  body_->add_mass_product(1.0, w_, mass_part_);
  const double w_m_delta = mass_part_.cwiseProduct(delta).sum();
  theta_bar[mass_damping_block_] -= density_ * w_m_delta;
  theta_bar[density_block_] +=
      mass_part_.cwiseProduct(start.v).sum() / t - (1.0 / (t * dt) + mass_damping_) * w_m_delta;

  bar.v = -(1.0 - t) / t * bar.v + density_ / t * mass_part_;
  add_carried(1.0 / t, w_, bar.v);
  w_ *= dt;
  for (Points& p : lag_bar_) p.setZero(delta.rows(), 3);
  for (Points& p : bar_at_) p.setZero(delta.rows(), 3);
  for (auto& term : terms_) {
    const auto at = std::size_t(term->at());
    term->add_force_adjoint(points_at_[at], w_, lag_bar_[std::size_t(term->lag())], bar_at_[at], theta_bar);
    if (reference_bar) term->add_reference_adjoint(w_, *reference_bar);
    if (term->sees_start()) term->add_start_adjoint(points_at_[at], w_, bar.x, bar.v);
  }
  if (is_rayleigh())
    theta_bar[stiffness_damping_block_] += bar_at_[std::size_t(ForceTerm::At::Blended)].cwiseProduct(delta).sum() / dt;
  for (const Points& p : bar_at_) bar.x += p;
  for (const auto lag : all_lags) {
    bar.x += lag_bar_[std::size_t(lag)];
    bar.v += s.prediction[std::size_t(lag)] * lag_bar_[std::size_t(lag)];
  }
}

}  // namespace pliant
