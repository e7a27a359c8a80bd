#include "indentation.hpp"

#include <cmath>

#include "motion/contact_defaults.hpp"

namespace pliant {

namespace {

constexpr double contact_stiffness = 3.0;  // times that of a disc's bond
constexpr double smoothing = 0.01;         // of the ball's radius
constexpr double reach = 2.5;              // radii from the touched point within which the ball may meet the surface

RigidContact ball_on(const Body& body, const Indentation& indentation, double modulus) {
  const ContactSamples all = boundary_samples(body, 6);
  ContactSamples near;
  double edge = 0.0;
  for (std::size_t i = 0; i < all.rest.size(); ++i)
    if ((all.rest[i] - indentation.touch).norm() < reach * indentation.radius) {
      near.rest.push_back(all.rest[i]);
      near.area.push_back(all.area[i]);
      edge += 6.0 * std::sqrt(2.0 * all.area[i]);
    }
  if (near.rest.empty()) throw std::invalid_argument("a ball touches nothing");
  edge /= double(near.rest.size());
  return RigidContact::sliding(
      body, near, rigid_ball(indentation.touch + indentation.radius * indentation.normal, indentation.radius),
      Penalty{contact_stiffness * bond_stiffness(modulus, edge), smoothing * indentation.radius,
              Penalty::Onset::Quadratic});
}

std::vector<RigidContact> one(RigidContact contact) {
  std::vector<RigidContact> contacts;
  contacts.push_back(std::move(contact));
  return contacts;
}

}  // namespace

Indenter::Indenter(std::shared_ptr<const Body> body, const std::vector<int>& held, const Indentation& indentation,
                   std::shared_ptr<const MaterialLaw> law, double modulus)
    : body_(body),
      indentation_(indentation),
      equilibrium_(body, std::move(law), held, one(ball_on(*body, indentation, modulus)),
                   EquilibriumOptions{.tolerance = 1e-7}),
      placements_(indentation.depths.size()) {}

bool Indenter::solve(std::size_t depth) {
  ProbeControl control;
  control.kind = ProbeControl::Kind::Position;
  control.translation = -indentation_.depths[depth] * indentation_.normal;
  equilibrium_.set_control(0, control);
  Placement& placement = placements_[depth];
  if (placement.nodes.size() > 0 && equilibrium_.solve(placement).converged) return true;
  placement = depth > 0 && placements_[depth - 1].nodes.size() > 0 ? placements_[depth - 1] : equilibrium_.rest();
  const bool solved = equilibrium_.solve(placement).converged;
  if (!solved) placement = {};
  return solved;
}

double Indenter::force(std::size_t depth) const {
  return -indentation_.normal.dot(equilibrium_.contact_force(0, placements_[depth]));
}

/// The force on the object is -sum grad psi(x - u). With u kept it changes with the nodes, and they with the law.
bool Indenter::derivatives(std::size_t depth, const LawLayout& layout, const VectorX& theta, VectorX& by_theta) {
  const Placement& placement = placements_[depth];
  if (!equilibrium_.prepare_derivatives(placement)) return false;
  const RigidContact& contact = equilibrium_.contact(0);
  const int n = body_->node_count();
  Points by_nodes = Points::Zero(n + 1, 3), of_nodes = Points::Zero(n, 3);
  for (int i = 0; i < contact.points().point_count(); ++i) {
    const Vector3 y =
        contact.points().position(i, placement.nodes) - Vector3(placement.translations.row(0).transpose());
    contact.points().add_transpose(i, contact.potential(i, y, false).hessian * indentation_.normal, of_nodes);
  }
  by_nodes.topRows(n) = of_nodes;
  const Points adjoint = equilibrium_.response(by_nodes);
  by_theta = VectorX::Zero(layout.size());
  equilibrium_.elasticity().for_parameter_derivatives(
      [&](int e, std::span<const int> nodes, const Eigen::Ref<const MatrixX>& by_q) {
        VectorX along = VectorX::Zero(by_q.cols());
        for (std::size_t a = 0; a < nodes.size(); ++a)
          along -= by_q.middleRows<3>(3 * Eigen::Index(a)).transpose() * adjoint.row(nodes[a]).transpose();
        by_theta += law_parameters_by_theta(*body_, layout, theta, e).transpose() * along;
      });
  return true;
}

IndentationTrial::IndentationTrial(const Indentation& indentation, const std::vector<int>& held,
                                   std::shared_ptr<PressedMaterial> material, const VectorX& reference, int number)
    : indentation_(indentation),
      material_(std::move(material)),
      number_(number),
      indenter_(material_->shared_body(), held, indentation, material_->law(reference),
                mean_modulus(material_->body(), *material_->law(reference))) {}

CostEvaluation IndentationTrial::run(const VectorX& theta, const MatrixX& directions) {
  CostEvaluation result;
  indenter_.set_law(material_->law(theta));
  const Eigen::Index n = directions.cols();
  FrameFit fit;
  fit.frame = number_;
  fit.independent = double(indentation_.depths.size());
  if (n > 0) fit.gradient = VectorX::Zero(n), fit.gauss_newton = MatrixX::Zero(n, n);
  forces_.clear();
  VectorX by_theta;
  for (std::size_t d = 0; d < indentation_.depths.size(); ++d) {
    if (!indenter_.solve(d)) return result.failure = indenter_.failure(), result;
    forces_.push_back(indenter_.force(d));
    const double r = (forces_.back() - indentation_.forces[d]) / indentation_.noise;
    fit.cost += 0.5 * r * r;
    ++result.steps;
    if (n == 0) continue;
    if (!indenter_.derivatives(d, material_->layout(), theta, by_theta))
      return result.failure = "the equilibrium is not stable", result;
    const VectorX J = directions.transpose() * by_theta / indentation_.noise;
    fit.gradient += r * J;
    fit.gauss_newton += J * J.transpose();
  }
  result.cost = fit.cost;
  result.frames.push_back(std::move(fit));
  result.succeeded = true;
  return result;
}

CostEvaluation IndentationTrial::gradient(const VectorX& theta, VectorX& theta_bar) {
  CostEvaluation result = run(theta, MatrixX::Identity(theta.size(), theta.size()));
  if (result.succeeded) theta_bar = result.frames.front().gradient;
  return result;
}

std::vector<std::unique_ptr<Trial>> indentation_trials(const std::shared_ptr<const Body>& body,
                                                       const std::vector<int>& held,
                                                       const std::vector<Indentation>& indentations,
                                                       const LawLayout& layout, const VectorX& reference) {
  const auto material = std::make_shared<PressedMaterial>(body, layout);
  std::vector<std::unique_ptr<Trial>> trials;
  for (const Indentation& indentation : indentations)
    trials.push_back(std::make_unique<IndentationTrial>(indentation, held, material, reference, int(trials.size())));
  return trials;
}

}  // namespace pliant
