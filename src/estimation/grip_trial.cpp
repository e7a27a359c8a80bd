#include "estimation/grip_trial.hpp"

#include <algorithm>
#include <utility>

#include "base/dense.hpp"
#include "estimation/law_derivatives.hpp"

namespace pliant {

namespace {

constexpr int most_parts = 64;  // of the displacement, where the body does not follow it at once

std::vector<int> held_by_all(const PressScene& scene, const ObservedGrip& test) {
  std::vector<int> held = scene.held;
  held.insert(held.end(), test.nodes.begin(), test.nodes.end());
  std::sort(held.begin(), held.end());
  held.erase(std::unique(held.begin(), held.end()), held.end());
  return held;
}

}  // namespace

GrippedBody::GrippedBody(const PressScene& scene, const ObservedGrip& test,
                         const std::shared_ptr<const MaterialLaw>& law)
    : body_(scene.body),
      test_(test),
      equilibrium_(scene.body, law, held_by_all(scene, test),
                   scene.contacts(std::nullopt, mean_modulus(*scene.body, *law)),
                   EquilibriumOptions{.tolerance = 1e-9, .reuse_factor = true}),
      markers_(*scene.body, test.rest),
      dead_load_(scene.dead_load()),
      direction_(Points::Zero(scene.body->node_count(), 3)) {
  equilibrium_.set_dead_load(dead_load_);
  keep_inner_bodies(equilibrium_, 0);
  for (const int n : test_.nodes) direction_.row(n) = test_.direction.transpose();
}

Points GrippedBody::stiffness_times(const Points& change) const {
  Points product = Points::Zero(body_->node_count(), 3);
  elasticity().add_product(LawElasticity::Stiffness::Exact, change, 1.0, product);
  return product;
}

Points GrippedBody::linear_way() {
  const Placement rest = equilibrium_.rest();
  Points way = Points::Zero(body_->node_count(), 3);
  for (const int n : test_.nodes) way.row(n) = test_.displacement.transpose();
  if (!equilibrium_.prepare_derivatives(rest)) return way;
  const Points forces = -stiffness_times(way);
  return way + response(forces);
}

bool GrippedBody::lead(double part) {
  for (const int n : test_.nodes) placement_.nodes.row(n) = body_->nodes.row(n) + part * test_.displacement.transpose();
  return equilibrium_.solve(placement_).converged;
}

bool GrippedBody::solve() {
  if (placement_.nodes.size() > 0 && lead(1.0)) return true;
  const Points way = linear_way();
  for (int parts = 1; parts <= most_parts; parts *= 4) {
    placement_ = equilibrium_.rest();
    Points step = way / parts;
    bool follows = true;
    for (int k = 1; k <= parts && follows; ++k) {
      const Points before = placement_.nodes;
      placement_.nodes += step;  // to first order at first, and then as the part before went
      follows = lead(double(k) / parts);
      step = placement_.nodes - before;
    }
    if (follows) return true;
  }
  placement_ = {};
  return false;
}

bool GrippedBody::solve_from(const Placement& guess) {
  const Placement last = std::exchange(placement_, guess);
  if (lead(1.0)) return true;
  placement_ = last;
  return solve();
}

Points GrippedBody::internal_forces() const {
  Points forces = Points::Zero(body_->node_count(), 3);
  elasticity().add_gradient(forces);
  for (int c = 0; c < equilibrium_.contact_count(); ++c) {
    const RigidContact& contact = equilibrium_.contact(c);
    for (int i = 0; i < contact.points().point_count(); ++i) {
      const Vector3 y = contact.points().position(i, placement_.nodes);
      contact.points().add_transpose(i, contact.potential(i, y, false).gradient, forces);
    }
  }
  return forces;
}

Points GrippedBody::response(const Points& forces) { return responses({forces}).front().topRows(body_->node_count()); }

std::vector<Points> GrippedBody::responses(std::vector<Points> forces) {
  const Eigen::Index nodes = body_->node_count();
  for (Points& of : forces) {
    of.conservativeResize(nodes + equilibrium_.contact_count(), 3);
    of.bottomRows(equilibrium_.contact_count()).setZero();
  }
  equilibrium_.respond(forces);
  return forces;
}

double GrippedBody::force() const { return (internal_forces() - dead_load_).cwiseProduct(direction_).sum(); }

bool GrippedBody::prepare_derivatives() {
  if (!equilibrium_.prepare_derivatives(placement_)) return false;
  force_by_nodes_ = stiffness_times(direction_);
  for (int c = 0; c < equilibrium_.contact_count(); ++c) {
    const RigidContact& contact = equilibrium_.contact(c);
    for (int i = 0; i < contact.points().point_count(); ++i) {
      const Vector3 along = contact.points().position(i, direction_);
      if (along.isZero()) continue;
      const Vector3 y = contact.points().position(i, placement_.nodes);
      contact.points().add_transpose(i, contact.potential(i, y, false).hessian * along, force_by_nodes_);
    }
  }
  return true;
}

GripTrial::GripTrial(std::shared_ptr<const PressScene> scene, int grip, std::shared_ptr<PressedMaterial> material,
                     const VectorX& reference, int number)
    : EquilibriumTrial(std::move(scene), std::move(material), number),
      grip_(grip),
      body_(*scene_, test(), material_->law(reference)) {}

const ObservedGrip& GripTrial::test() const { return scene_->tests->grips[std::size_t(grip_)]; }

bool GripTrial::compare(const VectorX& theta, CostEvaluation& result, Points& off, double& pull) {
  const ObservedGrip& seen = test();
  body_.set_law(material_->law(theta));
  result.steps = 1, result.work = steps_of_an_equilibrium * scene_->body->node_count();
  const std::optional<Placement> nearly = guess(linearised_, theta);
  if (!(nearly ? body_.solve_from(*nearly) : body_.solve()))
    return result.failure = seen.name + ": " + body_.failure(), false;
  FrameFit fit;
  fit.recording = number_;
  fit.frame = grip_;
  off = body_.markers();
  for (Eigen::Index m = 0; m < off.rows(); ++m)
    off.row(m) = (seen.seen * (off.row(m).transpose() - seen.loaded[std::size_t(m)])).transpose();
  fit.tracks = int(off.rows());
  fit.track_sum_squares = off.squaredNorm();
  fit.sum_noise_squares = fit.tracks * seen.markers_std * seen.markers_std;
  off /= seen.markers_std;
  pull = seen.has_force ? (body_.force() - seen.force) / seen.force_std : 0.0;
  fit.independent = seen.seen.trace() * fit.tracks + (seen.has_force ? 1.0 : 0.0);
  fit.cost = result.cost = 0.5 * off.squaredNorm() + 0.5 * pull * pull;
  result.frames.push_back(std::move(fit));
  result.succeeded = std::isfinite(result.cost);
  if (!result.succeeded) result.failure = seen.name + ": the cost is not finite";
  return result.succeeded;
}

CostEvaluation GripTrial::run(const VectorX& theta, const MatrixX& directions) {
  CostEvaluation result;
  Points off;
  double pull = 0.0;
  if (!compare(theta, result, off, pull) || directions.cols() == 0) return result;
  const ObservedGrip& seen = test();
  if (!body_.prepare_derivatives()) return unstable(std::move(result), seen.name);
  const LawNumbers numbers(material_->layout(), theta.size());
  const std::vector<Points> forces =
      force_changes(body_.elasticity(), *material_, theta, numbers, scene_->body->node_count());
  MatrixX by_parameters(off.size() + 1, Eigen::Index(numbers.count()));
  std::vector<Points> moves = body_.responses(forces);
  for (std::size_t k = 0; k < numbers.count(); ++k) {
    const Points moved = moves[k].topRows(forces[k].rows());
    Points there = body_.embedding().positions(moved);
    there = (there * seen.seen / seen.markers_std).eval();
    by_parameters.col(Eigen::Index(k)).head(off.size()) = flat(there);
    by_parameters(off.size(), Eigen::Index(k)) =
        seen.has_force
            ? (body_.force_by_nodes().cwiseProduct(moved).sum() - body_.direction().cwiseProduct(forces[k]).sum()) /
                  seen.force_std
            : 0.0;
  }
  linearised_.set(material_->form(), theta, body_.placement(), numbers.rows, std::move(moves));
  VectorX residuals(off.size() + 1);
  residuals << flat(off), pull;
  const MatrixX J = by_parameters * directions(numbers.rows, Eigen::all);
  FrameFit& fit = result.frames.front();
  fit.gradient = J.transpose() * residuals;
  fit.gauss_newton = J.transpose() * J;
  return result;
}

CostEvaluation GripTrial::gradient(const VectorX& theta, VectorX& theta_bar) {
  CostEvaluation result;
  Points off;
  double pull = 0.0;
  theta_bar = VectorX::Zero(theta.size());
  if (!compare(theta, result, off, pull)) return result;
  const ObservedGrip& seen = test();
  if (!body_.prepare_derivatives()) return unstable(std::move(result), seen.name);
  // The cotangents of the markers and of the force, back through the equilibrium: its matrix is symmetric.
  const double of_force = seen.has_force ? pull / seen.force_std : 0.0;
  Points bar = of_force * body_.force_by_nodes();
  for (Eigen::Index m = 0; m < off.rows(); ++m)
    body_.embedding().add_transpose(int(m), off.row(m).transpose() / seen.markers_std, bar);
  const Points on_forces = body_.response(bar) - of_force * body_.direction();
  add_force_adjoint(body_.elasticity(), *material_, theta, on_forces, theta_bar);
  return result;
}

}  // namespace pliant
