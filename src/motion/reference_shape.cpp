#include "motion/reference_shape.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "base/error.hpp"
#include "motion/continuation.hpp"

namespace pliant {

namespace {

constexpr double first_step = 10.0;  // of pseudo-time: ten elevenths of Newton's
constexpr double next_step = 1e3;    // where the shape under most of the load is known
constexpr double least_step = 1e-4;
constexpr double fastest_growth =
    8.0;                           // of steps that go well, in one iteration; those that go better grow with r's fall
constexpr double most_left = 4.0;  // of what was left to do, after one step
// Of the load, and of the body's size by which a node moves on average: below, iterations that gain nothing have met
// rounding. Forces in slender bodies are so much larger than the load that they never get as low.
constexpr double rounding = 1e-6, rounding_of_length = 1e-10;
constexpr double least_share = 1e-4, least_stride = 1.0 / 40.0;  // of the load, and of what is carried already
// Relative residuals of linear systems.
constexpr double of_a_step = 1e-6, of_a_length = 1e-2, of_a_derivative = 1e-12;
constexpr int most_steps = 30;  // of pseudo-time: a load that they do not balance is better taken part by part

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g %%", 100.0 * share);
  return text;
}

}  // namespace

ReferenceShapeSolver::ReferenceShapeSolver(std::shared_ptr<const Body> body, std::vector<int> held, Material material,
                                           const MotionBlocks& blocks, const ReferenceShapeOptions& options)
    : body_(std::move(body)),
      held_(std::move(held)),
      material_(std::move(material)),
      blocks_(blocks),
      scan_(body_->scanned_positions()),
      options_(options),
      forces_(material_.make_reference_forces(body_, blocks_)),
      solver_(body_->pattern, options.solver),
      stability_(body_->pattern, options.solver),
      turning_(body_, options.solver),
      jacobian_(body_->pattern),
      metric_(body_->pattern),
      matrix_(body_->pattern) {
  if (held_.size() < 3)
    throw InputError({{},
                      "nothing holds the object",
                      "a [[fixed]] region that contains a part of it",
                      "say in capture.toml where the object is held while it sags"});
  (void)turning_.fix(held_);
  turn_.assign(std::size_t(body_->node_count()), Matrix3::Identity());
}

void ReferenceShapeSolver::constrain(BlockMatrix& matrix) const {
  for (const int node : held_) matrix.constrain(node);
}

void ReferenceShapeSolver::add_mass(double density, BlockMatrix& matrix) const {
  for (std::size_t b = 0; b < body_->mass.size(); ++b)
    for (const int d : {0, 4, 8}) matrix.block(int(b))[d] += density * body_->mass[b];
}

void ReferenceShapeSolver::clear_held(Points& points) const {
  for (const int node : held_) points.row(node).setZero();
}

bool ReferenceShapeSolver::set_residual(const Points& X, const Points& load) {
  if (!X.allFinite() || !forces_->linearise(X, scan_)) return false;
  residual_ = load;
  forces_->add_force(residual_);
  clear_held(residual_);
  return residual_.allFinite();
}

void ReferenceShapeSolver::set_turns() {
  std::ranges::fill(turn_, Matrix3::Zero());
  for (int e = 0; e < body_->element_count(); ++e)
    for (const int n : body_->element(e))
      turn_[std::size_t(n)] += body_->element_volume[std::size_t(e)] * forces_->rotation(e);
  for (Matrix3& turn : turn_) turn = polar_decomposition(turn / turn.norm()).R;
}

void ReferenceShapeSolver::set_jacobian() {
  jacobian_.set_zero();
  forces_->add_matrix(1.0, jacobian_);
  const BlockPattern& pattern = *body_->pattern;
  for (int row = 0; row < pattern.rows; ++row)
    for (int b = pattern.row_start[row]; b < pattern.row_start[row + 1]; ++b) {
      Eigen::Map<Matrix3> block(jacobian_.block(b));
      block = (turn_[std::size_t(row)].transpose() * block).eval();
    }
  constrain(jacobian_);
}

VectorX ReferenceShapeSolver::solve(const VectorX& b, double tolerance, GeneralSolver::Side side) {
  VectorX x;
  if (solver_.solve(b, x, tolerance, side).converged) return x;
  return VectorX::Constant(b.size(), std::numeric_limits<double>::quiet_NaN());
}

Points ReferenceShapeSolver::turned_back(const Points& forces) const {
  Points out(forces.rows(), 3);
  for (Eigen::Index n = 0; n < forces.rows(); ++n) out.row(n) = forces.row(n) * turn_[std::size_t(n)];
  return out;
}

Points ReferenceShapeSolver::moved(const Points& X, const Points& step) {
  constexpr double farthest = 1.0;  // [rad]
  const double angle = turning_.prepare(X, step);
  Points out;
  turning_.move(std::min(1.0, farthest / std::max(angle, 1e-12)), out);
  return out;
}

auto ReferenceShapeSolver::attempt(const Points& load, const Points& from, double pseudo_step) -> Attempt {
  Attempt a;
  a.X = from;
  Points free_load = load;
  clear_held(free_load);
  const double scale = free_load.norm();
  if (scale == 0.0) return a.converged = true, a;
  if (!set_residual(a.X, load)) return a.reason = "elements of the first guess are inside out", a;
  double r = residual_.norm();
  const bool is_newton = options_.scheme == ReferenceScheme::Newton,
             is_virtual = options_.scheme == ReferenceScheme::VirtualForce, by_pseudo_time = !is_newton && !is_virtual;
  double step = is_newton ? std::numeric_limits<double>::infinity() : is_virtual ? options_.virtual_step : pseudo_step;
  Points velocity = Points::Zero(load.rows(), 3);
  const int blocks = body_->pattern->block_count();
  const double least_length = rounding_of_length * body_->size() * std::sqrt(double(body_->node_count()));
  const bool is_part = options_.by_parts && by_pseudo_time;
  const int most = is_part ? std::min(options_.max_iterations, most_steps) : options_.max_iterations;
  for (;; ++a.iterations) {
    a.residual = r / scale;
    a.least_volume_ratio = forces_->least_volume_ratio();
    if (a.residual <= options_.tolerance) return a.converged = true, a;
    if (a.iterations == most) return a.reason = "too many iterations", a;
    set_turns();
    set_jacobian();
    const Points back = turned_back(residual_);
    for (;; step = std::min(0.25 * step, 1.0)) {
      if (step < least_step) return a.reason = "elements fold before the forces balance", a;
      const double share = is_newton ? 0.0 : is_virtual ? (1.0 / step + options_.virtual_damping) / step : 1.0 / step;
      for (int b = 0; b < blocks; ++b)
        Eigen::Map<Matrix3>(matrix_.block(b)) =
            Eigen::Map<const Matrix3>(jacobian_.block(b)) + share * Eigen::Map<const Matrix3>(metric_.block(b));
      constrain(matrix_);
      VectorX b = -flat(back);
      if (is_virtual) {
        VectorX inertia;
        metric_.multiply(flat(velocity), inertia);
        b += inertia / step;
      }
      solver_.set_positions(scan_);
      const bool solved = solver_.factorise(matrix_, GeneralSolver::Lu::Before);
      const VectorX solution = solved ? solve(b, of_a_step) : VectorX();
      if (!solved || !solution.allFinite()) {
        if (is_newton) return a.reason = "the linear system cannot be solved", a;
        continue;
      }
      const Points change = as_points(std::as_const(solution));
      const Points X = by_pseudo_time ? moved(a.X, change) : Points(a.X + change);
      const bool fits = set_residual(X, load) && forces_->least_volume_ratio() >= options_.least_volume_ratio;
      if (is_newton && !fits) return a.reason = "elements fold", a;
      // The same matrix says how far nodes would have to move now: forces of slender bodies say little of that.
      double left = 0.0;
      if (fits && by_pseudo_time) left = solve(flat(turned_back(residual_)), of_a_length).norm() / solution.norm();
      const bool is_newtons = by_pseudo_time && step >= next_step;  // about
      const bool is_at_rounding = a.residual < rounding || (is_newtons && solution.norm() < least_length);
      if (!fits || left > most_left) {
        if (fits && is_at_rounding) return a.converged = true, a;
        continue;
      }
      if (left > 0.3 && is_at_rounding) return a.converged = true, a;
      a.X = X;
      velocity = change / step;
      if (by_pseudo_time) step *= left < 0.9 ? std::max(fastest_growth, 1.0 / left) : 1.0 / left;
      r = residual_.norm();
      if (is_newtons && left * solution.norm() < 0.01 * least_length) {
        a.residual = r / scale, a.least_volume_ratio = forces_->least_volume_ratio();
        return a.converged = true, a;
      }
      break;
    }
  }
}

bool ReferenceShapeSolver::holds_still(const VectorX& theta, const Points& X) {
  const auto reference = std::make_shared<Body>(with_reference(*body_, X));
  const auto elasticity = material_.make_elasticity(reference, blocks_);
  elasticity->set_parameters(theta);
  elasticity->linearise(scan_);
  matrix_.set_zero();
  elasticity->add_matrix(1.0, matrix_);
  elasticity->add_lag_matrix(scan_, 1.0, matrix_);
  constrain(matrix_);
  return stability_.factorise(matrix_, metric_) && stability_.symmetric_part_is_definite();
}

ReferenceShape ReferenceShapeSolver::find(const VectorX& theta, const Points& load, const Points* guess) {
  const Points& scan = scan_;
  forces_->set_parameters(theta);
  if (!set_residual(scan, load)) throw InputError({{}, "elements of the scan are inside out", "a sound mesh", ""});
  std::ranges::fill(turn_, Matrix3::Identity());
  metric_.set_zero();
  if (options_.scheme == ReferenceScheme::VirtualForce)
    add_mass(theta[blocks_.density], metric_);
  else
    forces_->add_matrix(1.0, metric_);  // the stiffness: in the scan nothing is strained
  constrain(metric_);

  ReferenceShape shape;
  const auto take = [&](const Attempt& a, double share) {
    shape.X = a.X, shape.residual = a.residual, shape.least_volume_ratio = a.least_volume_ratio;
    shape.carried = share;
  };
  const auto try_share = [&](double share, const Points& from, double pseudo_step = first_step) {
    Attempt a = attempt(share * load, from, pseudo_step);
    shape.iterations += a.iterations;
    if (a.converged && !holds_still(theta, a.X)) {
      a.converged = false, a.gives_way = true;
      a.reason = "the shape that balances the load gives way under it";
    }
    return a;
  };
  // Part by part, from what the part before gave. Where forces find no balance a shorter step of the load may help.
  // Where they do but the shape gives way, only less load helps: that limit is closed in on, and tried once more from
  // nearby.
  const bool in_parts = options_.by_parts && options_.scheme == ReferenceScheme::PseudoTransient;
  LoadContinuation steps({.first = 1.0, .growth = 1.0, .least = least_share, .least_relative = least_stride});
  Points from = scan;
  while (const auto share = steps.next()) {
    const bool is_whole = shape.X.rows() == 0;
    const double done = steps.carried();
    const bool has_guess = is_whole && guess;
    const double pseudo_step = has_guess || *share < 2.0 * done ? next_step : first_step;
    Attempt part = try_share(*share, has_guess ? *guess : from, pseudo_step);
    if (has_guess && !part.converged) part = try_share(*share, scan);
    if (part.converged || is_whole) take(part, part.converged ? *share : 0.0);
    if (part.converged) from = part.X;
    if (!part.converged) shape.reason = part.reason;
    steps.report(part.converged   ? LoadContinuation::Outcome::Carried
                 : part.gives_way ? LoadContinuation::Outcome::TooMuch
                                  : LoadContinuation::Outcome::NotFollowed);
    if (!in_parts) break;
  }
  shape.found = steps.is_complete();
  if (shape.found) shape.reason.clear();
  if (shape.found || !in_parts) return shape;
  shape.reason = "this material carries " + percent(shape.carried) + " of the load: " + shape.reason;
  return shape;
}

bool ReferenceShapeSolver::prepare_derivatives(const VectorX& theta, const Points& X) {
  forces_->set_parameters(theta);
  if (!forces_->linearise(X, scan_)) return false;
  set_turns();
  set_jacobian();
  solver_.set_positions(scan_);
  return solver_.factorise(jacobian_);
}

Points ReferenceShapeSolver::tangent(const Points& d_force) {
  Points b = -turned_back(d_force);
  clear_held(b);
  const VectorX change = solve(flat(b), of_a_derivative);
  return as_points(change);
}

Points ReferenceShapeSolver::adjoint(const Points& X_bar) {
  Points b = -X_bar;
  clear_held(b);
  const VectorX y = solve(flat(b), of_a_derivative, GeneralSolver::Side::Transposed);
  Points force_bar(X_bar.rows(), 3);
  for (Eigen::Index n = 0; n < force_bar.rows(); ++n)
    force_bar.row(n) = y.segment<3>(3 * n).transpose() * turn_[std::size_t(n)].transpose();
  return force_bar;
}

Points scan_load(const Body& body, const MotionBlocks& blocks, const VectorX& theta,
                 const std::vector<PointMass>& weights) {
  Points load = Points::Zero(body.node_count(), 3);
  Gravity gravity(body, blocks);
  gravity.set_parameters(theta);
  gravity.add_force(body.scanned_positions(), load);
  if (!weights.empty()) {
    PointWeights hung(body, weights, blocks.gravity);
    hung.set_parameters(theta);
    hung.add_force(body.scanned_positions(), load);
  }
  return load;
}

}  // namespace pliant
