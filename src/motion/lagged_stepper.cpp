#include "motion/lagged_stepper.hpp"

#include <stdexcept>
#include <utility>

namespace pliant {

LaggedStepper::LaggedStepper(std::shared_ptr<const Body> body, std::vector<std::unique_ptr<ForceTerm>> terms,
                             const StepOptions& options)
    : body_(std::move(body)), terms_(std::move(terms)), options_(options), matrix_(body_->pattern) {
  if (!(options.dt > 0.0)) throw std::invalid_argument("the time step must be positive");
  if (!(options.newmark_theta >= 0.5 && options.newmark_theta < 1.0))
    throw std::invalid_argument("Newmark's theta must lie in [0.5, 1)");
  solver_ = make_linear_solver(body_->pattern, options.solver);
  if (!(options_.contact_weight > 0.5 && options_.contact_weight <= 1.0))
    throw std::invalid_argument("the contact's weight must lie in (0.5, 1]");
  if (!(options_.rotation_prediction >= 0.0 && options_.rotation_prediction <= 1.0))
    throw std::invalid_argument("the prediction of rotations must lie in [0, 1]");
  for (Points* p : {&force_, &d_blended_, &d_force_, &w_, &mass_part_}) p->setZero(body_->node_count(), 3);
  for (auto* points : {&lag_, &d_lag_, &lag_bar_})
    for (Points& p : *points) p.setZero(body_->node_count(), 3);
  for (auto* points : {&points_at_, &bar_at_})
    for (Points& p : *points) p.setZero(body_->node_count(), 3);
  solution_.setZero(3 * body_->node_count());
}

void LaggedStepper::set_parameters(const VectorX& parameters) {
  mass_damping_ = parameters[theta::mass_damping];
  stiffness_damping_ = parameters[theta::stiffness_damping];
  density_ = parameters[theta::density];
  for (auto& term : terms_) term->set_parameters(parameters);
}

namespace {
constexpr std::array all_lags = {ForceTerm::Lag::Rotation, ForceTerm::Lag::Contact};
}

double LaggedStepper::weight(ForceTerm::At at) const {
  switch (at) {
    case ForceTerm::At::Blended: return options_.newmark_theta + stiffness_damping_ / options_.dt;
    case ForceTerm::At::Contact: return options_.contact_weight;
    case ForceTerm::At::End: break;
  }
  return 1.0;
}

void LaggedStepper::set_points_at(const State& start, const Points& delta) {
  for (const auto at : {ForceTerm::At::Blended, ForceTerm::At::Contact, ForceTerm::At::End})
    points_at_[std::size_t(at)] = start.x + weight(at) * delta;
}

void LaggedStepper::clear_held(Points& points) const {
  for (const int node : held_) points.row(node).setZero();
}

bool LaggedStepper::prepare(const State& start) {
  if (!start.x.allFinite() || !start.v.allFinite()) return false;
  for (const auto lag : all_lags) lag_[std::size_t(lag)] = start.x + prediction(lag) * start.v;
  const double m = mass_factor();
  const std::vector<double>& mass = body_->mass;
  matrix_.set_zero();
  for (std::size_t b = 0; b < mass.size(); ++b) {
    double* block = matrix_.block(int(b));
    block[0] = block[4] = block[8] = m * mass[b];
  }
  for (auto& term : terms_) {
    term->linearise(lag_[std::size_t(term->lag())]);
    term->add_matrix(options_.dt * weight(term->at()), matrix_);
  }
  for (const int node : held_) matrix_.constrain(node);
  return solver_->factorise(matrix_);
}

SolveSummary LaggedStepper::solve(const State& start, Points& delta) {
  force_.setZero();
  for (auto& term : terms_) term->add_force(start.x, force_);
  force_ *= options_.dt;
  body_->add_mass_product(density_ / options_.newmark_theta, start.v, force_);
  clear_held(force_);
  clear_held(delta);
  solution_ = flat(delta);
  const SolveSummary summary = solver_->solve(flat(force_), solution_);
  delta = as_points(solution_);
  SolveSummary checked = summary;
  checked.converged = summary.converged && delta.allFinite();
  return checked;
}

void LaggedStepper::advance(const Points& delta, State& state) const {
  const double t = options_.newmark_theta;
  state.x += delta;
  state.v = delta / (t * options_.dt) - (1.0 - t) / t * state.v;
}

void LaggedStepper::tangent(const State& start, const Points& delta, const VectorX& d_theta, State& change) {
  const double dt = options_.dt, t = options_.newmark_theta;
  const double d_beta = d_theta[theta::stiffness_damping];
  set_points_at(start, delta);
  d_blended_ = change.x + d_beta / dt * delta;
  for (const auto lag : all_lags) d_lag_[std::size_t(lag)] = change.x + prediction(lag) * change.v;
  d_force_.setZero();
  for (auto& term : terms_) {
    const bool blended = term->at() == ForceTerm::At::Blended;
    term->add_force_tangent(points_at_[std::size_t(term->at())], d_lag_[std::size_t(term->lag())],
                            blended ? d_blended_ : change.x, d_theta, d_force_);
  }
  d_force_ *= dt;
  mass_part_ = density_ / t * change.v;
  mass_part_ += d_theta[theta::density] / t * start.v;
  mass_part_ -= (d_theta[theta::density] * (1.0 / (t * dt) + mass_damping_) + density_ * d_theta[theta::mass_damping]) * delta;
  body_->add_mass_product(1.0, mass_part_, d_force_);
  clear_held(d_force_);
  solution_ = flat(change.v) * dt;
  solver_->solve(flat(d_force_), solution_);
  const auto d_delta = as_points(std::as_const(solution_));
  change.x += d_delta;
  change.v = d_delta / (t * dt) - (1.0 - t) / t * change.v;
}

void LaggedStepper::adjoint(const State& start, const Points& delta, State& bar, VectorX& theta_bar) {
  const double dt = options_.dt, t = options_.newmark_theta;
  set_points_at(start, delta);
  force_ = bar.x + bar.v / (t * dt);
  clear_held(force_);
  solution_.setZero();
  solver_->solve(flat(force_), solution_);
  w_ = as_points(std::as_const(solution_));
  clear_held(w_);

  mass_part_.setZero();
  body_->add_mass_product(1.0, w_, mass_part_);
  const double w_m_delta = mass_part_.cwiseProduct(delta).sum();
  theta_bar[theta::mass_damping] -= density_ * w_m_delta;
  theta_bar[theta::density] += mass_part_.cwiseProduct(start.v).sum() / t - (1.0 / (t * dt) + mass_damping_) * w_m_delta;

  w_ *= dt;
  for (Points& p : lag_bar_) p.setZero();
  for (Points& p : bar_at_) p.setZero();
  for (auto& term : terms_) {
    const auto at = std::size_t(term->at());
    term->add_force_adjoint(points_at_[at], w_, lag_bar_[std::size_t(term->lag())], bar_at_[at], theta_bar);
  }
  theta_bar[theta::stiffness_damping] += bar_at_[std::size_t(ForceTerm::At::Blended)].cwiseProduct(delta).sum() / dt;
  bar.v = -(1.0 - t) / t * bar.v + density_ / t * mass_part_;
  for (const Points& p : bar_at_) bar.x += p;
  for (const auto lag : all_lags) {
    bar.x += lag_bar_[std::size_t(lag)];
    bar.v += prediction(lag) * lag_bar_[std::size_t(lag)];
  }
}

}  // namespace pliant
