#include "motion/simulation.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/error.hpp"
#include "base/parallel.hpp"
#include "base/points.hpp"
#include "base/profile.hpp"
#include "elasticity/viscous_forces.hpp"
#include "motion/body_forces.hpp"
#include "motion/continuation.hpp"

namespace pliant {

namespace {

bool holds_strongly(const Body& body, const SimulationOptions& options) {
  return options.hold_strongly || body.kind != ElementKind::Hexahedron;
}

PullPoints far_nodes(const Body& body, const std::vector<int>& held, int count) {
  std::vector<Vector3> all = to_vectors(body.scanned_positions()), there;
  for (const int node : held) there.push_back(all[std::size_t(node)]);
  // Where nothing is held the pull refuses; any nodes will do for that.
  if (there.empty()) all.resize(std::min(all.size(), std::size_t(count)));
  return {there.empty() ? all : far_points(all, there, count), body.size()};
}

std::vector<PointMass> hung_weights(const SimulationOptions& options) {
  std::vector<PointMass> hung = options.weights;
  hung.insert(hung.end(), options.loads.begin(), options.loads.end());
  return hung;
}

std::unique_ptr<ForceTerm> plane_contact(const Body& body, const PlaneBlock& plane, const SimulationOptions& options) {
  auto contact =
      std::make_unique<RigidContact>(RigidContact::sliding(body, surface_samples(body), plane, options.contact));
  if (options.friction_speed > 0.0) contact->set_friction(0.0, options.friction_speed);
  return contact;
}

std::vector<std::unique_ptr<ForceTerm>> make_terms(const std::shared_ptr<const Body>& body,
                                                   const SimulationOptions& options, Elasticity*& elasticity,
                                                   FixedRegions*& fixed, Pull*& pull, PointWeights*& let_go) {
  std::vector<std::unique_ptr<ForceTerm>> terms;
  auto elastic = scene_elasticity(body, options);
  elasticity = elastic.get();
  terms.push_back(std::move(elastic));
  if (options.material.damping == StiffnessDamping::KelvinVoigt && !options.is_static)
    terms.push_back(make_viscous_forces(body, options.blocks, options.blocks.stiffness_damping));
  terms.push_back(std::make_unique<Gravity>(*body, options.blocks, options.gravity_change));
  for (const PlaneBlock& plane : options.blocks.planes) terms.push_back(plane_contact(*body, plane, options));
  if (const std::vector<PointMass> hung = hung_weights(options); !hung.empty())
    terms.push_back(std::make_unique<PointWeights>(*body, hung, options.blocks.gravity, options.gravity_change));
  if (!options.released_weights.empty()) {
    auto weights = std::make_unique<PointWeights>(*body, options.released_weights, options.blocks.gravity);
    let_go = weights.get();
    let_go->set_active(false);
    terms.push_back(std::move(weights));
  }
  if (!options.holds.empty() && !holds_strongly(*body, options)) {
    auto regions = std::make_unique<FixedRegions>(body, options.holds, options.blocks);
    fixed = regions.get();
    terms.push_back(std::move(regions));
  }
  if (!options.blocks.pulls.empty()) {
    const std::vector<int> held = held_nodes(*body, options.holds);
    PullPoints points = options.pull_points;
    if (points.at.empty()) points = far_nodes(*body, held, int(options.blocks.pulls.size()));
    auto pulling = std::make_unique<Pull>(body, points, held, options.blocks);
    pull = pulling.get();
    pull->set_active(false);
    terms.push_back(std::move(pulling));
  }
  for (const auto& make : options.further_forces) terms.push_back(make(body));
  return terms;
}

}  // namespace

Simulation::Simulation(std::shared_ptr<const Body> body, SimulationOptions options)
    : body_(std::move(body)),
      options_(std::move(options)),
      stepper_(make_stepper(forces_)),
      statics_(body_, stepper_.terms(), {.newton = options_.newton, .solver = options_.solver.kind}),
      rest_(body_->scanned_positions()) {
  if (holds_strongly(*body_, options_))
    statics_.hold(eliminated_nodes(*body_, options_));
  else
    statics_.anchor(held_nodes(*body_, options_.holds));
  if (!options_.times.empty()) statics_.set_time(options_.times.front());
  element_edge_ = std::cbrt(body_->volume() / std::max(1, body_->element_count()));
  check_start();
  prepare_holds();
  if (options_.scan_sags || !options_.shape.points.empty()) {
    const std::vector<int> held = held_nodes(*body_, options_.holds);
    shape_ = std::make_unique<RestShape>(body_, held, options_.scan_sags, options_.weights,
                                         shape_basis(*body_, options_.shape, held), options_.blocks, options_.material);
  }
  if (!options_.is_static) move_holds(0.0, 1.0, rest_);
  lever_ = body_->scanned_positions().rowwise() - body_->centre_of_mass().transpose();
  if (options_.holds.empty() && !(options_.start_pose == RigidMotion())) {
    rest_ = (rest_ * options_.start_pose.rotation.transpose()).rowwise() + options_.start_pose.translation.transpose();
    lever_ = lever_ * options_.start_pose.rotation.transpose();
  }
  for (int frame = 1; frame < frame_count() && !options_.is_static; ++frame) {
    const double interval = options_.times[frame] - options_.times[frame - 1];
    const int steps = std::max(1, int(std::ceil(interval / options_.max_dt - 1e-9)));
    for (int s = 1; s <= steps; ++s)
      plan_.push_back(
          {options_.times[frame - 1] + (s - 1) * interval / steps, interval / steps, s == steps ? frame : -1});
    longest_step_ = std::max(longest_step_, interval / steps);
  }
}

Stepper Simulation::make_stepper(StepForces& forces) const {
  Stepper stepper(
      body_, make_terms(body_, options_, forces.elasticity, forces.fixed_regions, forces.pull, forces.let_go),
      options_.blocks,
      {options_.is_static ? 1.0 : options_.max_dt, options_.newmark_theta, options_.contact_weight,
       options_.rotation_prediction, options_.material.damping, options_.solver, options_.integrator, options_.newton});
  if (holds_strongly(*body_, options_)) stepper.hold(eliminated_nodes(*body_, options_));
  if (const std::vector<PointMass> weights = hung_weights(options_); !weights.empty()) {
    const PointWeights hung(*body_, weights, options_.blocks.gravity);
    stepper.carry(hung.points(), hung.masses());
  }
  return stepper;
}

void Simulation::prepare_second(const VectorX& parameters) {
  if (!second_) {
    StepForces forces;
    Stepper stepper = make_stepper(forces);
    second_ = std::make_unique<Second>(Second{forces, std::move(stepper), nullptr});
    if (forces.fixed_regions) forces.fixed_regions->move_to(options_.holds);
  }
  const std::shared_ptr<const Body> reference = shape_ ? shape_->body() : reference_body_;
  if (reference && reference != second_->reference) second_->stepper.set_reference(reference);
  second_->reference = reference;
  second_->stepper.set_parameters(parameters);
}

void Simulation::check_start() const {
  for (const Points* given : {&options_.start, &options_.start_velocities})
    if (given->rows() > 0 && (given->rows() != rest_.rows() || starts_held() || options_.is_static))
      throw std::invalid_argument("a start that is given has a row for each node, and no equilibrium is looked for");
}

void Simulation::set_start(Points positions, Points velocities) {
  options_.start.swap(positions), options_.start_velocities.swap(velocities);
  try {
    check_start();
  } catch (const std::invalid_argument&) {
    options_.start.swap(positions), options_.start_velocities.swap(velocities);
    throw;
  }
}

void Simulation::check_reference() const {
  const bool has_derivatives = body_->kind != ElementKind::Hexahedron && options_.material.of_mean_strain();
  if (!has_derivatives || shape_)
    throw std::invalid_argument(
        "a stress-free shape that is set wants tetrahedra, moduli in the parameters, and parameters that do not say "
        "it");
}

void Simulation::set_reference(Points reference) {
  check_reference();
  reference_body_ = std::make_shared<Body>(with_reference(*body_, std::move(reference)));
  stepper_.set_reference(reference_body_);
}

bool Simulation::set_parameters(const VectorX& parameters, RolloutSummary& summary) {
  if (shape_ && !shape_is_held_) {
    const Timed timed(Activity::LoadFree);
    summary.failure = shape_->find(parameters);
    if (!summary.failure.empty()) return false;
    stepper_.set_reference(shape_->body());
    rest_ = shape_->scan();
    if (!options_.is_static) move_holds(0.0, 1.0, rest_);
  }
  stepper_.set_parameters(parameters);
  return true;
}

std::shared_ptr<const Body> Simulation::rest_body(const VectorX& parameters) {
  if (follows_shape() && !shape_->find(parameters).empty()) return body_;
  return shape_ ? shape_->body() : reference_body_ ? reference_body_ : body_;
}

void Simulation::begin_shape_from(const Simulation& other) {
  if (shape_ && other.shape_) shape_->begin_from(*other.shape_);
}

std::string Simulation::hold_shape(const VectorX& parameters) {
  shape_is_held_ = false;
  RolloutSummary summary;
  shape_is_held_ = set_parameters(parameters, summary);
  return summary.failure;
}

bool Simulation::shape_tangents(const MatrixX& directions, ShapeChange& change, RolloutSummary& summary) {
  if (!follows_shape() || directions.cols() == 0) return true;
  const Timed timed(Activity::LoadFree, 0);
  if (!shape_->prepare_derivatives()) {
    summary.failure = "the matrix of the load-free shape's derivatives cannot be factorised";
    return false;
  }
  for (Eigen::Index c = 0; c < directions.cols(); ++c) {
    change.scan.push_back(shape_->scan_tangent(directions.col(c)));
    change.reference.push_back(shape_->reference_tangent(directions.col(c), change.scan.back()));
  }
  return true;
}

Points Simulation::velocities(const VectorX& parameters) const {
  const Vector3 linear = options_.blocks.linear_velocity.vector(parameters);
  const Matrix3 spin = cross_matrix(options_.blocks.angular_velocity.vector(parameters));
  return (lever_ * spin.transpose()).rowwise() + linear.transpose();
}

void Simulation::hold_start(bool held) {
  if (forces_.pull) forces_.pull->set_active(held);
  if (forces_.let_go) forces_.let_go->set_active(held);
}

bool Simulation::start(const VectorX& parameters, State& state, RolloutSummary& summary) {
  state = {options_.start.rows() > 0 ? options_.start : rest_, velocities(parameters)};
  if (options_.start_velocities.rows() > 0) state.v += options_.start_velocities;
  if (!starts_held()) return true;
  hold_start(true);
  RolloutSummary search;
  const bool found = find_equilibrium(parameters, state, search);
  hold_start(false);
  summary.solver_iterations += search.solver_iterations;
  summary.failure = search.failure;
  state.v = velocities(parameters);
  return found;
}

std::vector<State> Simulation::start_tangents(const State& start, const MatrixX& directions, const ShapeChange& shape) {
  const Timed timed(Activity::Equilibria, 0);
  std::vector<State> tangents;
  hold_start(true);
  for (Eigen::Index c = 0; c < directions.cols(); ++c) {
    const VectorX direction = directions.col(c);
    tangents.push_back({Points::Zero(rest_.rows(), 3), velocities(direction)});  // velocities are linear in theta
    if (!shape.scan.empty() && options_.start.rows() == 0) tangents.back().x = shape.scan[std::size_t(c)];
    if (starts_held()) tangents.back().x = statics_.tangent(start.x, direction, shape.of(std::size_t(c)));
  }
  hold_start(false);
  return tangents;
}

bool Simulation::start_adjoint(const State& start, const State& bar, VectorX& theta_bar, Points* reference_bar) {
  const Timed timed(Activity::Equilibria, 0);
  theta_bar.segment<3>(options_.blocks.linear_velocity) += bar.v.colwise().sum().transpose();
  for (Eigen::Index n = 0; n < bar.v.rows(); ++n) {
    const Vector3 lever = lever_.row(n), v_bar = bar.v.row(n);
    theta_bar.segment<3>(options_.blocks.angular_velocity) += lever.cross(v_bar);
  }
  if (starts_held()) {
    hold_start(true);
    const bool ready = statics_.prepare_derivatives(start.x);
    if (ready) statics_.adjoint(start.x, bar.x, theta_bar, reference_bar);
    hold_start(false);
    if (!ready) return false;
  }
  if (!follows_shape()) return true;
  if (!shape_->prepare_derivatives()) return false;
  const bool starts_as_scanned = !starts_held() && options_.start.rows() == 0;
  shape_->adjoint(starts_as_scanned ? bar.x : Points::Zero(rest_.rows(), 3), reference_bar_, theta_bar);
  return true;
}

void Simulation::prepare_holds() {
  const Points& X = body_->scanned_positions();
  const double least = 1e-12 * std::pow(body_->size(), 2);
  hold_share_.setZero(X.rows(), Eigen::Index(options_.holds.size()));
  bool any_moves = false;  // else no node's share is asked for
  for (const Hold& hold : options_.holds)
    any_moves = any_moves || hold.rotation != Matrix3::Identity() || hold.translation != Vector3::Zero();
  for (std::size_t h = 0; h < options_.holds.size(); ++h) {
    const std::vector<int> nodes = held_nodes(*body_, {options_.holds[h]});
    Vector3 middle = Vector3::Zero();
    for (const int node : nodes) middle += X.row(node).transpose() / double(nodes.size());
    hold_middle_.push_back(middle);
    if (!any_moves) continue;
    for_parts(Parts(std::size_t(X.rows())), [&](std::size_t first, std::size_t last) {
      for (auto n = Eigen::Index(first); n < Eigen::Index(last); ++n) {
        double nearest = nodes.empty() ? 1.0 : std::numeric_limits<double>::infinity();
        for (const int node : nodes) nearest = std::min(nearest, (X.row(n) - X.row(node)).squaredNorm());
        hold_share_(n, Eigen::Index(h)) = 1.0 / (nearest + least);
      }
    });
  }
  for (Eigen::Index n = 0; n < X.rows() && any_moves; ++n)
    if (hold_share_.cols() > 0) hold_share_.row(n) /= hold_share_.row(n).sum();
}

void Simulation::move_holds(double from, double to, Points& positions) {
  std::vector<Hold> there;
  const Points before = positions;
  for (std::size_t h = 0; h < options_.holds.size(); ++h) {
    const Hold start = part_of_the_way(options_.holds[h], from, hold_middle_[h]);
    there.push_back(part_of_the_way(options_.holds[h], to, hold_middle_[h]));
    const Matrix3 R = there[h].rotation * start.rotation.transpose();
    const Vector3 t = there[h].translation - R * start.translation;
    for (Eigen::Index n = 0; n < positions.rows(); ++n) {
      const Vector3 x = before.row(n).transpose();
      positions.row(n) += hold_share_(n, Eigen::Index(h)) * (R * x + t - x).transpose();
    }
  }
  for (std::size_t h = 0; h < there.size() && holds_strongly(*body_, options_); ++h)
    for (const int node : held_nodes(*body_, {there[h]}))
      positions.row(node) =
          (there[h].rotation * body_->scanned_positions().row(node).transpose() + there[h].translation).transpose();
  if (forces_.fixed_regions) forces_.fixed_regions->move_to(there);
}

bool Simulation::settle(Points& x, RolloutSummary& summary) {
  const Timed timed(Activity::Equilibria);
  const SolveSummary solved = statics_.solve(x);
  summary.solver_iterations += solved.iterations;
  ++summary.steps;
  return solved.converged && statics_.prepare_derivatives(x);
}

bool Simulation::find_equilibrium(const VectorX& parameters, State& state, RolloutSummary& summary) {
  constexpr double largest_turn = 0.4;  // [rad] of a held region, a step of the load
  constexpr int most_iterations = 400;
  double turn = 0.0;
  for (const Hold& hold : options_.holds) turn = std::max(turn, Eigen::AngleAxisd(hold.rotation).angle());
  state = {shape_ ? shape_->scan() : body_->scanned_positions(), Points::Zero(rest_.rows(), 3)};
  const double longest = turn > 0.0 ? std::min(1.0, largest_turn / turn) : 1.0;
  LoadContinuation steps({.first = longest, .largest = longest, .shrink = 0.4, .least = 1.0 / 256.0});
  while (const auto share = steps.next()) {
    VectorX part = parameters;
    part.segment<3>(options_.blocks.gravity) *= *share;
    for (const ParameterHandle& pull : options_.blocks.pulls) part.segment<3>(pull) *= *share;
    Points x = state.x;
    stepper_.set_parameters(part);
    move_holds(steps.carried(), *share, x);
    const bool is_carried = settle(x, summary);
    if (is_carried) state.x = x;
    steps.report(is_carried ? LoadContinuation::Outcome::Carried : LoadContinuation::Outcome::NotFollowed);
    if (!is_carried && summary.solver_iterations > most_iterations) break;
  }
  if (!steps.is_complete()) {
    summary.failure = "no equilibrium was found beyond " + std::to_string(100.0 * steps.carried()) +
                      " % of the load: the material may be too soft to hold the object up";
    return false;
  }
  return true;
}

bool Simulation::forward_step(const StepPlan& plan, Stepper& stepper, const State& start, Points& delta,
                              RolloutSummary& summary) {
  const Timed timed(Activity::Steps);
  stepper.set_time(plan.time);
  stepper.set_time_step(plan.dt);
  if (!stepper.prepare(start)) {
    summary.failure =
        "the step's matrix is not positive definite or not finite at step " + std::to_string(summary.steps);
    return false;
  }
  delta = plan.dt * start.v;
  const SolveSummary solved = stepper.solve(start, delta);
  summary.solver_iterations += solved.iterations;
  if (!solved.converged) {
    summary.failure = std::string(options_.integrator == Integrator::Newton ? "Newton's method" : "the linear solver") +
                      " did not converge at step " + std::to_string(summary.steps);
    return false;
  }
  ++summary.steps;
  return true;
}

double Simulation::surprise(const StepPlan& plan, const State& start, const Points& delta) const {
  if (options_.integrator == Integrator::Newton) return 0.0;
  return 0.5 * std::sqrt((delta - plan.dt * start.v).rowwise().squaredNorm().maxCoeff()) / element_edge_;
}

bool Simulation::take_step(std::size_t i, Stepper& stepper, const State& start, Points& delta,
                           RolloutSummary& summary) {
  constexpr double too_long = 0.1, explosion = 3.0;  // surprises
  const double shortest = std::ldexp(longest_step_, -options_.most_halvings);
  for (;;) {
    const StepPlan plan = steps_[i];
    const bool is_taken = forward_step(plan, stepper, start, delta, summary);
    const double surprised = is_taken ? surprise(plan, start, delta) : 0.0;
    if (is_taken && !(surprised > too_long)) return true;
    const double half = 0.5 * plan.dt;
    if (half < (1.0 - 1e-9) * shortest) {
      if (surprised > explosion)
        summary.failure = "nodes leap by several elements within the shortest step, number " +
                          std::to_string(summary.steps) + ": the motion cannot be resolved";
      return is_taken && !(surprised > explosion);
    }
    summary.failure.clear();
    if (is_taken) --summary.steps;
    steps_[i] = {plan.time, half, -1};
    steps_.insert(steps_.begin() + std::ptrdiff_t(i) + 1, {plan.time + half, half, plan.frame_after});
  }
}

void Simulation::take_steps(const VectorX& parameters, const MatrixX& directions, const ShapeChange& shape,
                            int last_frame, const OnFrame& on_frame, const State& start, std::vector<State>& tangents,
                            RolloutSummary& summary) {
  // Forces beyond a scene's own may remember the step before: one stepper takes all steps then.
  const bool is_beside = !tangents.empty() && options_.further_forces.empty();
  if (is_beside) prepare_second(parameters);
  std::array<Stepper*, 2> steppers{&stepper_, is_beside ? &second_->stepper : &stepper_};
  const std::array<Elasticity*, 2> forces{forces_.elasticity, is_beside ? second_->forces.elasticity : nullptr};
  std::array<State, 2> starts{start, start};  // of a step and of the next one
  std::array<Points, 2> deltas;
  bool has_tangents = true;
  std::array<std::function<void()>, 2> carry_tangents;
  for (std::size_t k : {0, 1})
    carry_tangents[k] = [&, k] {
      has_tangents = step_tangents(*steppers[k], starts[k], deltas[k], directions, tangents, shape);
    };
  enum class Way { On, Stop, Failed };
  std::optional<int> under_way;  // frame, -1: none, of the step whose tangents are carried along
  TaskGroup beside;
  const auto end_step = [&](const State& end) {
    if (!under_way) return Way::On;
    const int frame = *under_way;
    under_way.reset();
    beside.wait();
    if (!has_tangents) {
      summary.failure = "a matrix of the tangents cannot be factorised";
      return Way::Failed;
    }
    if (frame < 0) return Way::On;
    ++summary.frames;
    return on_frame(frame, end, tangents) && frame < last_frame ? Way::On : Way::Stop;
  };
  steps_ = plan_;
  for (std::size_t s = 0; s < steps_.size() && summary.frames <= last_frame; ++s) {
    const std::size_t k = s % 2, next = 1 - k;
    const bool is_needed = !under_way || *under_way < last_frame;
    const bool is_taken = is_needed && take_step(s, *steppers[k], starts[k], deltas[k], summary);
    const std::string why_not = std::exchange(summary.failure, {});
    if (const Way way = end_step(starts[k]); way != Way::On) {
      if (is_taken) --summary.steps;  // in vain
      summary.succeeded = way == Way::Stop;
      return;
    }
    if (!is_taken) {
      summary.failure = why_not;
      return;
    }
    under_way = steps_[s].frame_after;
    if (is_beside) {
      // Bit for bit as one stepper would; and before tangents linearise again, as those of Newton's steps do.
      forces[next]->look_for_rotations_from(*forces[k]);
      beside.run(std::cref(carry_tangents[k]));
    } else {
      carry_tangents[k]();
    }
    starts[next] = starts[k];
    steppers[k]->advance(deltas[k], starts[next]);
    if (is_beside) continue;
    if (const Way way = end_step(starts[next]); way != Way::On) {
      summary.succeeded = way == Way::Stop;
      return;
    }
  }
  summary.succeeded = end_step(starts[steps_.size() % 2]) != Way::Failed;
}

RolloutSummary Simulation::run(const VectorX& parameters, const OnFrame& on_frame) {
  return run(parameters, MatrixX(parameters.size(), 0), frame_count() - 1, on_frame);
}

RolloutSummary Simulation::run(const VectorX& parameters, const MatrixX& directions, int last_frame,
                               const OnFrame& on_frame) {
  RolloutSummary summary;
  ShapeChange shape;
  if (!set_parameters(parameters, summary) || !shape_tangents(directions, shape, summary)) return summary;
  State state;
  std::vector<State> tangents;
  if (options_.is_static) {
    if (!find_equilibrium(parameters, state, summary)) return summary;
    const Timed timed(Activity::Equilibria, 0);
    for (Eigen::Index c = 0; c < directions.cols(); ++c)
      tangents.push_back(
          {statics_.tangent(state.x, directions.col(c), shape.of(std::size_t(c))), Points::Zero(rest_.rows(), 3)});
    for (int frame = 0; frame <= std::min(last_frame, frame_count() - 1); ++frame) {
      ++summary.frames;
      if (!on_frame(frame, state, tangents)) break;
    }
    return summary.succeeded = true, summary;
  }
  if (!start(parameters, state, summary)) return summary;
  tangents = start_tangents(state, directions, shape);
  summary.frames = 1;
  if (!on_frame(0, state, tangents)) return summary.succeeded = true, summary;
  run_isolated([&] { take_steps(parameters, directions, shape, last_frame, on_frame, state, tangents, summary); });
  return summary;
}

bool Simulation::step_tangents(Stepper& stepper, const State& start, const Points& delta, const MatrixX& directions,
                               std::vector<State>& tangents, const ShapeChange& shape) {
  if (tangents.empty()) return true;
  const Timed timed(Activity::Tangents, directions.cols());
  if (options_.integrator == Integrator::Newton && !stepper.prepare_derivatives(start, delta)) return false;
  if (!shape.reference.empty()) stepper.prepare_reference_derivatives(start, delta);
  stepper.tangents(start, delta, directions, tangents, shape.reference);
  return true;
}

std::size_t Simulation::segment_length(std::size_t steps) const {
  if ((steps + 1) * state_bytes() <= options_.memory_budget) return steps + 1;
  return std::max<std::size_t>(1, std::size_t(std::ceil(std::sqrt(double(steps)))));
}

RolloutSummary Simulation::run_adjoint(const VectorX& parameters, int last_frame,
                                       const std::function<bool(int, const State&)>& cost,
                                       const std::function<void(int, const State&, Points&)>& cotangent,
                                       VectorX& theta_bar, NodeCotangents* nodes) {
  RolloutSummary summary;
  const bool by_reference = nodes && nodes->with_reference;
  if (by_reference && !reference_body_) set_reference(body_->reference_positions());
  if (!set_parameters(parameters, summary)) return summary;
  theta_bar.setZero(parameters.size());
  reference_bar_ = Points::Zero(rest_.rows(), 3);
  Points* const reference_bar = follows_shape() || by_reference ? &reference_bar_ : nullptr;
  const auto keep = [&](const Points& start, const Points& velocities) {
    if (!nodes) return;
    nodes->start = start, nodes->start_velocities = velocities;
    nodes->reference = by_reference ? reference_bar_ : Points();
  };
  if (options_.is_static) {
    State state;
    if (!find_equilibrium(parameters, state, summary)) return summary;
    Points x_bar = Points::Zero(rest_.rows(), 3);
    for (int frame = 0; frame <= std::min(last_frame, frame_count() - 1); ++frame) {
      ++summary.frames;
      if (!cost(frame, state)) return summary.failure = "the cost failed", summary;
      cotangent(frame, state, x_bar);
    }
    const Timed timed(Activity::Equilibria, 0);
    statics_.adjoint(state.x, x_bar, theta_bar, reference_bar);
    keep(Points::Zero(rest_.rows(), 3), Points::Zero(rest_.rows(), 3));
    if (follows_shape()) {
      if (!shape_->prepare_derivatives()) return summary.failure = "the load-free shape has no derivatives", summary;
      shape_->adjoint(Points::Zero(rest_.rows(), 3), reference_bar_, theta_bar);
    }
    return summary.succeeded = true, summary;
  }
  std::size_t steps = 0;
  while (steps < plan_.size() && (steps == 0 || plan_[steps - 1].frame_after < last_frame)) ++steps;
  if (last_frame == 0) steps = 0;
  const std::size_t length = segment_length(steps);
  steps_.assign(plan_.begin(), plan_.begin() + std::ptrdiff_t(steps));

  std::vector<State> checkpoints;
  State state;
  if (!start(parameters, state, summary)) return summary;
  const State released = state;
  summary.frames = 1;
  if (!cost(0, state)) return summary.failure = "the cost failed", summary;
  std::vector<State> segment;
  const bool all_kept = length > steps;
  for (std::size_t s = 0; s < steps_.size(); ++s) {
    if (all_kept)
      segment.push_back(state);
    else if (s % length == 0)
      checkpoints.push_back(state);
    if (!take_step(s, stepper_, state, delta_, summary)) return summary;
    stepper_.advance(delta_, state);
    const int frame = steps_[s].frame_after;
    if (frame < 0) continue;
    ++summary.frames;
    if (!cost(frame, state)) return summary.failure = "the cost failed", summary;
  }
  steps = steps_.size();
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
        if (!forward_step(steps_[r], stepper_, replay, delta_, ignored))
          return summary.failure = ignored.failure, summary;
        stepper_.advance(delta_, replay);
      }
      if (s + 1 == steps) state = replay;
    }
    const Timed timed(Activity::AdjointSteps);
    const State& start = segment.back();
    if (steps_[s].frame_after >= 0) cotangent(steps_[s].frame_after, state, bar.x);
    stepper_.set_time(steps_[s].time);
    stepper_.set_time_step(steps_[s].dt);
    delta_ = state.x - start.x;
    if (!stepper_.prepare_derivatives(start, delta_))
      return summary.failure = "a matrix of the reverse sweep is not positive definite", summary;
    if (reference_bar) stepper_.prepare_reference_derivatives(start, delta_);
    stepper_.adjoint(start, delta_, bar, theta_bar, reference_bar);
    state = start;
    segment.pop_back();
  }
  cotangent(0, state, bar.x);
  if (!start_adjoint(released, bar, theta_bar, reference_bar))
    return summary.failure = "a matrix of the start's derivatives cannot be factorised", summary;
  keep(starts_held() ? Points::Zero(rest_.rows(), 3) : bar.x, bar.v);
  summary.succeeded = true;
  return summary;
}

std::unique_ptr<Elasticity> scene_elasticity(const std::shared_ptr<const Body>& body,
                                             const SimulationOptions& options) {
  return options.material.make_elasticity(body, options.blocks);
}

std::vector<std::unique_ptr<ForceTerm>> scene_forces(const std::shared_ptr<const Body>& body,
                                                     const SimulationOptions& options) {
  SimulationOptions without_pulls = options;
  without_pulls.blocks.pulls.clear();
  without_pulls.released_weights.clear();
  Elasticity* elasticity = nullptr;
  FixedRegions* fixed = nullptr;
  Pull* pull = nullptr;
  PointWeights* let_go = nullptr;
  std::vector<std::unique_ptr<ForceTerm>> terms = make_terms(body, without_pulls, elasticity, fixed, pull, let_go);
  if (fixed) fixed->move_to(options.holds);
  return terms;
}

std::vector<int> eliminated_nodes(const Body& body, const SimulationOptions& options) {
  if (!holds_strongly(body, options)) return {};
  std::vector<int> held = held_nodes(body, options.holds);
  if (held.empty() && !options.holds.empty())
    throw InputError({{},
                      "the held regions contain no node of the object",
                      "regions that hold a part of it",
                      "move them onto the object, make them larger, or use smaller elements"});
  return held;
}

double default_time_step(const Body& body, double gravity) { return 0.0125 * std::sqrt(body.size() / gravity); }

}  // namespace pliant
