#include "motion/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "motion/body_forces.hpp"
#include "elasticity/corotated.hpp"

namespace pliant {

namespace {

std::vector<std::unique_ptr<ForceTerm>> make_terms(const std::shared_ptr<const Body>& body,
                                                   const SimulationOptions& options) {
  std::vector<std::unique_ptr<ForceTerm>> terms;
  terms.push_back(std::make_unique<CorotatedElasticity>(body));
  terms.push_back(std::make_unique<Gravity>(*body));
  for (int plane = 0; plane < options.planes; ++plane)
    terms.push_back(std::make_unique<PlaneContact>(body, plane, options.contact));
  if (!options.holds.empty() && !options.hold_strongly)
    terms.push_back(std::make_unique<FixedRegions>(body, options.holds));
  return terms;
}

}  // namespace

Simulation::Simulation(std::shared_ptr<const Body> body, SimulationOptions options)
    : body_(body),
      options_(std::move(options)),
      stepper_(body, make_terms(body, options_), {options_.max_dt, options_.newmark_theta, options_.contact_weight, options_.rotation_prediction,
                options_.solver}),
      rest_(body->reference_positions()) {
  if (options_.hold_strongly) {
    stepper_.hold(held_nodes(*body_, options_.holds));
    for (const Hold& hold : options_.holds)
      for (const int node : held_nodes(*body_, {hold}))
        rest_.row(node) = (hold.rotation * body_->reference_positions().row(node).transpose() + hold.translation).transpose();
  }
  lever_ = body_->reference_positions().rowwise() - body_->centre_of_mass().transpose();
  for (int frame = 1; frame < frame_count(); ++frame) {
    const double interval = options_.times[frame] - options_.times[frame - 1];
    const int steps = std::max(1, int(std::ceil(interval / options_.max_dt - 1e-9)));
    for (int s = 1; s <= steps; ++s) plan_.push_back({interval / steps, s == steps ? frame : -1});
  }
}

void Simulation::set_parameters(const VectorX& parameters) { stepper_.set_parameters(parameters); }

State Simulation::initial_state(const VectorX& parameters) const {
  State state{rest_, Points(rest_.rows(), 3)};
  const Vector3 linear = theta::vector_at(parameters, theta::linear_velocity);
  const Matrix3 spin = cross_matrix(theta::vector_at(parameters, theta::angular_velocity));
  state.v = (lever_ * spin.transpose()).rowwise() + linear.transpose();
  return state;
}

State Simulation::initial_tangent(const VectorX&, const VectorX& d_theta) const {
  State state = initial_state(d_theta);  // velocities are linear in theta, positions do not depend on it
  state.x.setZero();
  return state;
}

void Simulation::initial_adjoint(const VectorX&, const State& bar, VectorX& theta_bar) const {
  theta_bar.segment<3>(theta::linear_velocity) += bar.v.colwise().sum().transpose();
  for (Eigen::Index n = 0; n < bar.v.rows(); ++n) {
    const Vector3 lever = lever_.row(n), v_bar = bar.v.row(n);
    theta_bar.segment<3>(theta::angular_velocity) += lever.cross(v_bar);
  }
}

bool Simulation::forward_step(const StepPlan& plan, State& state, RolloutSummary& summary) {
  stepper_.set_time_step(plan.dt);
  if (!stepper_.prepare(state)) {
    summary.failure = "the step's matrix is not positive definite or not finite at step " + std::to_string(summary.steps);
    return false;
  }
  delta_ = plan.dt * state.v;
  const SolveSummary solved = stepper_.solve(state, delta_);
  summary.solver_iterations += solved.iterations;
  if (!solved.converged) {
    summary.failure = "the linear solver did not converge at step " + std::to_string(summary.steps);
    return false;
  }
  ++summary.steps;
  return true;
}

RolloutSummary Simulation::run(const VectorX& parameters, const OnFrame& on_frame) {
  return run(parameters, MatrixX(theta_size(), 0), frame_count() - 1, on_frame);
}

RolloutSummary Simulation::run(const VectorX& parameters, const MatrixX& directions, int last_frame,
                               const OnFrame& on_frame) {
  RolloutSummary summary;
  set_parameters(parameters);
  State state = initial_state(parameters);
  std::vector<State> tangents;
  for (Eigen::Index c = 0; c < directions.cols(); ++c)
    tangents.push_back(initial_tangent(parameters, directions.col(c)));
  summary.frames = 1;
  if (!on_frame(0, state, tangents)) return summary.succeeded = true, summary;
  for (const StepPlan& plan : plan_) {
    if (summary.frames > last_frame) break;
    if (!forward_step(plan, state, summary)) return summary;
    for (std::size_t c = 0; c < tangents.size(); ++c)
      stepper_.tangent(state, delta_, directions.col(Eigen::Index(c)), tangents[c]);
    stepper_.advance(delta_, state);
    if (plan.frame_after < 0) continue;
    ++summary.frames;
    if (!on_frame(plan.frame_after, state, tangents)) break;
  }
  summary.succeeded = true;
  return summary;
}

std::size_t Simulation::segment_length(std::size_t steps) const {
  if ((steps + 1) * state_bytes() <= options_.memory_budget) return steps + 1;
  return std::max<std::size_t>(1, std::size_t(std::ceil(std::sqrt(double(steps)))));
}

RolloutSummary Simulation::run_adjoint(const VectorX& parameters, int last_frame,
                                       const std::function<bool(int, const State&)>& cost,
                                       const std::function<void(int, const State&, Points&)>& cotangent,
                                       VectorX& theta_bar) {
  RolloutSummary summary;
  set_parameters(parameters);
  theta_bar.setZero(theta_size());
  std::size_t steps = 0;
  while (steps < plan_.size() && (steps == 0 || plan_[steps - 1].frame_after < last_frame)) ++steps;
  if (last_frame == 0) steps = 0;
  const std::size_t length = segment_length(steps);

  std::vector<State> checkpoints;
  State state = initial_state(parameters);
  summary.frames = 1;
  if (!cost(0, state)) return summary.failure = "the cost failed", summary;
  std::vector<State> segment;
  const bool all_kept = length > steps;
  for (std::size_t s = 0; s < steps; ++s) {
    if (all_kept)
      segment.push_back(state);
    else if (s % length == 0)
      checkpoints.push_back(state);
    if (!forward_step(plan_[s], state, summary)) return summary;
    stepper_.advance(delta_, state);
    if (plan_[s].frame_after < 0) continue;
    ++summary.frames;
    if (!cost(plan_[s].frame_after, state)) return summary.failure = "the cost failed", summary;
  }
  peak_state_bytes_ = (segment.size() + checkpoints.size() + (all_kept ? 1 : length + 1)) * state_bytes();

  State bar{Points::Zero(rest_.rows(), 3), Points::Zero(rest_.rows(), 3)};
  for (std::size_t s = steps; s-- > 0;) {
    if (!all_kept && (s + 1 == steps || (s + 1) % length == 0)) {  // entering a segment from behind: run it again
      const std::size_t first = s / length * length;
      segment.clear();
      State replay = checkpoints.back();
      checkpoints.pop_back();
      RolloutSummary ignored;
      for (std::size_t r = first; r <= s; ++r) {
        segment.push_back(replay);
        if (!forward_step(plan_[r], replay, ignored)) return summary.failure = ignored.failure, summary;
        stepper_.advance(delta_, replay);
      }
      if (s + 1 == steps) state = replay;
    }
    const State& start = segment.back();
    if (plan_[s].frame_after >= 0) cotangent(plan_[s].frame_after, state, bar.x);
    stepper_.set_time_step(plan_[s].dt);
    if (!stepper_.prepare(start)) return summary.failure = "a matrix of the reverse sweep is not positive definite", summary;
    delta_ = state.x - start.x;
    stepper_.adjoint(start, delta_, bar, theta_bar);
    state = start;
    segment.pop_back();
  }
  cotangent(0, state, bar.x);
  initial_adjoint(parameters, bar, theta_bar);
  summary.succeeded = true;
  return summary;
}

ContactOptions default_contact(const Body& body, double mass, double gravity) {
  Box box;
  for (Eigen::Index n = 0; n < body.grid.nodes.rows(); ++n) box.extend(body.grid.nodes.row(n).transpose());
  const double size = box.extent().maxCoeff();
  double projected = 0.0;  // a convex body's mean projected area is a quarter of its surface
  for (const SurfacePoint& point : body.grid.surface) projected += 0.25 * point.area;
  return {mass * gravity / (projected * 1e-4 * size), 1e-3 * size};
}

double default_time_step(const Body& body, double gravity) {
  Box box;
  for (Eigen::Index n = 0; n < body.grid.nodes.rows(); ++n) box.extend(body.grid.nodes.row(n).transpose());
  return 0.0125 * std::sqrt(box.extent().maxCoeff() / gravity);
}

}  // namespace pliant
