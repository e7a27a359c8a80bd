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
  for (Points* p : {&predicted_, &blended_, &end_, &force_, &d_blended_, &d_end_, &d_predicted_, &d_force_, &w_,
                    &blended_bar_, &end_bar_, &predicted_bar_, &current_bar_, &mass_part_})
    p->setZero(body_->node_count(), 3);
  solution_.setZero(3 * body_->node_count());
}

void LaggedStepper::set_parameters(const VectorX& parameters) {
  mass_damping_ = parameters[theta::mass_damping];
  stiffness_damping_ = parameters[theta::stiffness_damping];
  density_ = parameters[theta::density];
  for (auto& term : terms_) term->set_parameters(parameters);
}

const Points& LaggedStepper::lag_point(const ForceTerm& term, const State& start) {
  return term.lag() == ForceTerm::Lag::Current ? start.x : predicted_;
}

void LaggedStepper::clear_held(Points& points) const {
  for (const int node : held_) points.row(node).setZero();
}

bool LaggedStepper::prepare(const State& start) {
  if (!start.x.allFinite() || !start.v.allFinite()) return false;
  predicted_ = start.x + options_.dt * start.v;
  const double m = mass_factor();
  const std::vector<double>& mass = body_->mass;
  matrix_.set_zero();
  for (std::size_t b = 0; b < mass.size(); ++b) {
    double* block = matrix_.block(int(b));
    block[0] = block[4] = block[8] = m * mass[b];
  }
  for (auto& term : terms_) {
    term->linearise(lag_point(*term, start));
    term->add_matrix(term->at() == ForceTerm::At::Blended ? options_.dt * blend() : options_.dt, matrix_);
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
  blended_ = start.x + blend() * delta;
  end_ = start.x + delta;
  d_blended_ = change.x + d_beta / dt * delta;
  d_predicted_ = change.x + dt * change.v;
  d_force_.setZero();
  for (auto& term : terms_) {
    const bool blended = term->at() == ForceTerm::At::Blended, current = term->lag() == ForceTerm::Lag::Current;
    term->add_force_tangent(blended ? blended_ : end_, current ? change.x : d_predicted_, blended ? d_blended_ : change.x,
                            d_theta, d_force_);
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
  blended_ = start.x + blend() * delta;
  end_ = start.x + delta;
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
  for (Points* p : {&blended_bar_, &end_bar_, &predicted_bar_, &current_bar_}) p->setZero();
  for (auto& term : terms_) {
    const bool blended = term->at() == ForceTerm::At::Blended, current = term->lag() == ForceTerm::Lag::Current;
    term->add_force_adjoint(blended ? blended_ : end_, w_, current ? current_bar_ : predicted_bar_,
                            blended ? blended_bar_ : end_bar_, theta_bar);
  }
  theta_bar[theta::stiffness_damping] += blended_bar_.cwiseProduct(delta).sum() / dt;
  bar.x += current_bar_ + predicted_bar_ + blended_bar_ + end_bar_;
  bar.v = -(1.0 - t) / t * bar.v + density_ / t * mass_part_ + dt * predicted_bar_;
}

}  // namespace pliant
