#include "estimation/indentation_trial.hpp"

#include <cmath>

#include "estimation/law_derivatives.hpp"

namespace pliant {

IndentedBody::IndentedBody(const PressScene& scene, const ObservedIndentation& test,
                           std::shared_ptr<const MaterialLaw> law, double modulus)
    : depths_(test.curve.depths),
      axis_(probe_axis(*scene.body, test.probe)),
      equilibrium_(scene.body, std::move(law), scene.held,
                   scene.contacts(probe_contact(*scene.body, test.probe, modulus), modulus),
                   EquilibriumOptions{.tolerance = 1e-8, .reuse_factor = true}),
      placements_(depths_.size()) {
  equilibrium_.set_dead_load(scene.dead_load());
  keep_inner_bodies(equilibrium_, 1);
}

bool IndentedBody::solve(std::size_t depth, const std::optional<Placement>& guess) {
  ProbeControl control;
  control.kind = ProbeControl::Kind::Position;
  control.translation = depths_[depth] * axis_;
  equilibrium_.set_control(0, control);
  Placement& placement = placements_[depth];
  if (guess) {
    Placement near = *guess;
    if (equilibrium_.solve(near).converged) {
      placement = std::move(near);
      return true;
    }
  }
  if (placement.nodes.size() > 0 && equilibrium_.solve(placement).converged) return true;
  placement = depth > 0 && placements_[depth - 1].nodes.size() > 0 ? placements_[depth - 1] : equilibrium_.rest();
  const bool solved = equilibrium_.solve(placement).converged;
  if (!solved) placement = {};
  return solved;
}

double IndentedBody::force(std::size_t depth) const {
  return axis_.dot(equilibrium_.contact_force(0, placements_[depth]));
}

/// The force on the object is -sum grad psi(x - u). With u kept it changes with the nodes, and they with the law.
Points IndentedBody::force_by_nodes(std::size_t depth) const {
  const Placement& placement = placements_[depth];
  const RigidContact& contact = equilibrium_.contact(0);
  Points of_nodes = Points::Zero(equilibrium_.body().node_count(), 3);
  for (int i = 0; i < contact.points().point_count(); ++i) {
    const Vector3 y =
        contact.points().position(i, placement.nodes) - Vector3(placement.translations.row(0).transpose());
    contact.points().add_transpose(i, -contact.potential(i, y, false).hessian * axis_, of_nodes);
  }
  return of_nodes;
}

bool IndentedBody::force_derivative(std::size_t depth, const PressedMaterial& material, const VectorX& theta,
                                    VectorX& by_theta) {
  if (!equilibrium_.prepare_derivatives(placements_[depth])) return false;
  const int n = equilibrium_.body().node_count();
  Points bar = Points::Zero(n + equilibrium_.contact_count(), 3);
  bar.topRows(n) = force_by_nodes(depth);
  by_theta = VectorX::Zero(theta.size());
  add_force_adjoint(equilibrium_.elasticity(), material, theta, equilibrium_.response(bar), by_theta);
  return true;
}

bool IndentedBody::force_derivatives(std::size_t depth, const PressedMaterial& material, const VectorX& theta,
                                     const LawNumbers& numbers, VectorX& by_numbers, std::vector<Points>& changes) {
  if (!equilibrium_.prepare_derivatives(placements_[depth])) return false;
  const int n = equilibrium_.body().node_count();
  const Points by_nodes = force_by_nodes(depth);
  changes = force_changes(equilibrium_.elasticity(), material, theta, numbers, n + equilibrium_.contact_count());
  equilibrium_.respond(changes);
  by_numbers.resize(Eigen::Index(changes.size()));
  for (std::size_t k = 0; k < changes.size(); ++k)
    by_numbers[Eigen::Index(k)] = by_nodes.cwiseProduct(changes[k].topRows(n)).sum();
  return true;
}

DepthOffset::DepthOffset(const ForceCurve& curve, double std) : curve_(curve), std_(std) {
  if (!is_unknown()) return;
  // Slopes of the parabola through a depth and its neighbours; before the first one no force at no depth.
  const std::vector<double>& d = curve.depths;
  const auto n = Eigen::Index(d.size());
  slope_ = MatrixX::Zero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double here = d[std::size_t(i)], before = i > 0 ? d[std::size_t(i - 1)] : 0.0;
    const double a = here - before, b = i + 1 < n ? d[std::size_t(i + 1)] - here : 0.0;
    if (a > 0.0) slope_(i, i) += b > 0.0 ? b / (a * (a + b)) : 1.0 / a;
    if (a > 0.0 && i > 0) slope_(i, i - 1) -= slope_(i, i);
    if (b > 0.0) {
      const double forward = a > 0.0 ? a / (b * (a + b)) : 1.0 / b;
      slope_(i, i + 1) += forward, slope_(i, i) -= forward;
    }
  }
}

void DepthOffset::fit(const VectorX& forces) {
  if (!is_unknown()) return;
  slopes_ = slope_ * forces;
  double along = 0.0, bend = 1.0 / (std_ * std_);
  for (Eigen::Index i = 0; i < forces.size(); ++i) {
    const double weight = slopes_[i] / std::pow(curve_.stds[std::size_t(i)], 2);
    along -= weight * (forces[i] - curve_.forces[std::size_t(i)]), bend += weight * slopes_[i];
  }
  value_ = along / bend;
}

MatrixX DepthOffset::with_offset(const MatrixX& changes) const {
  if (!is_unknown()) return changes;
  return changes + value_ * (slope_ * changes);
}

VectorX DepthOffset::change(const MatrixX& changes) const {
  VectorX along = VectorX::Zero(changes.cols());
  if (!is_unknown()) return along;
  double bend = 1.0 / (std_ * std_);
  for (Eigen::Index i = 0; i < changes.rows(); ++i) {
    const double weight = slopes_[i] / std::pow(curve_.stds[std::size_t(i)], 2);
    along -= weight * changes.row(i).transpose(), bend += weight * slopes_[i];
  }
  return along / bend;
}

VectorX DepthOffset::transposed(const VectorX& bar) const {
  if (!is_unknown()) return bar;
  return bar + value_ * (slope_.transpose() * bar);
}

IndentationTrial::IndentationTrial(std::shared_ptr<const PressScene> scene, int indentation,
                                   std::shared_ptr<PressedMaterial> material, const VectorX& reference, int number)
    : EquilibriumTrial(std::move(scene), std::move(material), number),
      indentation_(indentation),
      body_(*scene_, test(), material_->law(reference), mean_modulus(material_->body(), *material_->law(reference))),
      linearised_(test().curve.depths.size()),
      offset_(test().curve, test().contact_std) {}

const ObservedIndentation& IndentationTrial::test() const {
  return scene_->tests->indentations[std::size_t(indentation_)];
}

CostEvaluation IndentationTrial::run(const VectorX& theta, const MatrixX& directions) {
  CostEvaluation result;
  const ForceCurve& curve = test().curve;
  body_.set_law(material_->law(theta));
  const Eigen::Index n = directions.cols(), count = Eigen::Index(curve.depths.size());
  const LawNumbers numbers(material_->layout(), theta.size());
  VectorX by_numbers, forces(count);
  MatrixX changes(count, n);
  for (Eigen::Index d = 0; d < count; ++d) {
    LinearisedEquilibrium& linearised = linearised_[std::size_t(d)];
    if (!body_.solve(std::size_t(d), guess(linearised, theta)))
      return result.failure = test().name + ": " + body_.failure(), result;
    ++result.steps, result.work += steps_of_an_equilibrium * scene_->body->node_count();
    forces[d] = body_.force(std::size_t(d));
    if (n == 0) continue;
    std::vector<Points> moves;
    if (!body_.force_derivatives(std::size_t(d), *material_, theta, numbers, by_numbers, moves))
      return unstable(std::move(result), test().name);
    changes.row(d) = by_numbers.transpose() * directions(numbers.rows, Eigen::all);
    linearised.set(material_->form(), theta, body_.placements()[std::size_t(d)], numbers.rows, std::move(moves));
  }
  offset_.fit(forces);
  changes = offset_.with_offset(changes);
  const VectorX offset_change = offset_.change(changes);
  if (offset_.is_unknown()) forces += offset_.value() * offset_.slopes();
  for (Eigen::Index d = 0; d < count; ++d) {
    const double std = curve.stds[std::size_t(d)], r = (forces[d] - curve.forces[std::size_t(d)]) / std;
    FrameFit fit;
    fit.recording = number_;
    fit.frame = int(d);
    fit.independent = 1.0;
    fit.cost = 0.5 * r * r;
    if (n > 0) {
      VectorX J = changes.row(d).transpose() / std;
      if (offset_.is_unknown()) J += offset_.slopes()[d] / std * offset_change;
      fit.gradient = r * J;
      fit.gauss_newton = J * J.transpose();
    }
    if (offset_.is_unknown() && d + 1 == count) add_prior(offset_change, fit);
    result.cost += fit.cost;
    result.frames.push_back(std::move(fit));
  }
  result.succeeded = true;
  return result;
}

/// The offset's own square, beside the last depth.
void IndentationTrial::add_prior(const VectorX& offset_change, FrameFit& fit) const {
  const double r = offset_.value() / offset_.prior_std();
  fit.cost += 0.5 * r * r;
  if (offset_change.size() == 0) return;
  const VectorX J = offset_change / offset_.prior_std();
  fit.gradient += r * J;
  fit.gauss_newton += J * J.transpose();
}

/// A back-substitution a depth gives the force's derivative by all parameters: nothing is left to sweep back.
double IndentationTrial::expected_work() const {
  return double(test().curve.depths.size()) * steps_of_an_equilibrium * scene_->body->node_count();
}

CostEvaluation IndentationTrial::gradient(const VectorX& theta, VectorX& theta_bar) {
  CostEvaluation result;
  const ForceCurve& curve = test().curve;
  theta_bar = VectorX::Zero(theta.size());
  result = run(theta, MatrixX(theta.size(), 0));
  if (!result.succeeded) return result;
  // The offset fits best: its own change does not move the cost.
  VectorX by_theta, bar(Eigen::Index(curve.depths.size()));
  for (std::size_t d = 0; d < curve.depths.size(); ++d) {
    const double offset = offset_.is_unknown() ? offset_.value() * offset_.slopes()[Eigen::Index(d)] : 0.0;
    bar[Eigen::Index(d)] = (body_.force(d) + offset - curve.forces[d]) / (curve.stds[d] * curve.stds[d]);
  }
  bar = offset_.transposed(bar);
  for (std::size_t d = 0; d < curve.depths.size(); ++d) {
    if (!body_.force_derivative(d, *material_, theta, by_theta)) return unstable(std::move(result), test().name);
    theta_bar += bar[Eigen::Index(d)] * by_theta;
  }
  return result;
}

}  // namespace pliant
