#include "estimation/indentation_trial.hpp"

#include "estimation/law_derivatives.hpp"

namespace pliant {

IndentedBody::IndentedBody(const PressScene& scene, const ObservedIndentation& test,
                           std::shared_ptr<const MaterialLaw> law, double modulus)
    : depths_(test.curve.depths),
      axis_(probe_axis(*scene.body, test.probe)),
      equilibrium_(scene.body, std::move(law), scene.held,
                   scene.contacts(probe_contact(*scene.body, test.probe, modulus), modulus),
                   EquilibriumOptions{.tolerance = 1e-8}),
      placements_(depths_.size()) {
  equilibrium_.set_dead_load(scene.dead_load());
  keep_inner_bodies(equilibrium_, 1);
}

bool IndentedBody::solve(std::size_t depth) {
  ProbeControl control;
  control.kind = ProbeControl::Kind::Position;
  control.translation = depths_[depth] * axis_;
  equilibrium_.set_control(0, control);
  Placement& placement = placements_[depth];
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
bool IndentedBody::force_derivative(std::size_t depth, const PressedMaterial& material, const VectorX& theta,
                                    VectorX& by_theta) {
  const Placement& placement = placements_[depth];
  if (!equilibrium_.prepare_derivatives(placement)) return false;
  const RigidContact& contact = equilibrium_.contact(0);
  const int n = equilibrium_.body().node_count();
  Points bar = Points::Zero(n + equilibrium_.contact_count(), 3), of_nodes = Points::Zero(n, 3);
  for (int i = 0; i < contact.points().point_count(); ++i) {
    const Vector3 y =
        contact.points().position(i, placement.nodes) - Vector3(placement.translations.row(0).transpose());
    contact.points().add_transpose(i, -contact.potential(i, y, false).hessian * axis_, of_nodes);
  }
  bar.topRows(n) = of_nodes;
  by_theta = VectorX::Zero(theta.size());
  add_force_adjoint(equilibrium_.elasticity(), material, theta, equilibrium_.response(bar), by_theta);
  return true;
}

IndentationTrial::IndentationTrial(std::shared_ptr<const PressScene> scene, int indentation,
                                   std::shared_ptr<PressedMaterial> material, const VectorX& reference, int number)
    : EquilibriumTrial(std::move(scene), std::move(material), number),
      indentation_(indentation),
      body_(*scene_, test(), material_->law(reference), mean_modulus(material_->body(), *material_->law(reference))) {}

const ObservedIndentation& IndentationTrial::test() const {
  return scene_->tests->indentations[std::size_t(indentation_)];
}

CostEvaluation IndentationTrial::run(const VectorX& theta, const MatrixX& directions) {
  CostEvaluation result;
  const ForceCurve& curve = test().curve;
  body_.set_law(material_->law(theta));
  const Eigen::Index n = directions.cols();
  VectorX by_theta;
  for (std::size_t d = 0; d < curve.depths.size(); ++d) {
    if (!body_.solve(d)) return result.failure = test().name + ": " + body_.failure(), result;
    ++result.steps, result.work += steps_of_an_equilibrium * scene_->body->node_count();
    const double r = (body_.force(d) - curve.forces[d]) / curve.stds[d];
    FrameFit fit;
    fit.recording = number_;
    fit.frame = int(d);
    fit.independent = 1.0;
    fit.cost = 0.5 * r * r;
    result.cost += fit.cost;
    if (n > 0) {
      if (!body_.force_derivative(d, *material_, theta, by_theta)) return unstable(std::move(result), test().name);
      const VectorX J = directions.transpose() * by_theta / curve.stds[d];
      fit.gradient = r * J;
      fit.gauss_newton = J * J.transpose();
    }
    result.frames.push_back(std::move(fit));
  }
  result.succeeded = true;
  return result;
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
  VectorX by_theta;
  for (std::size_t d = 0; d < curve.depths.size(); ++d) {
    if (!body_.force_derivative(d, *material_, theta, by_theta)) return unstable(std::move(result), test().name);
    theta_bar += (body_.force(d) - curve.forces[d]) / (curve.stds[d] * curve.stds[d]) * by_theta;
  }
  return result;
}

}  // namespace pliant
