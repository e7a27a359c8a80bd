#include "estimation/press_trial.hpp"

#include <cmath>

#include "estimation/law_derivatives.hpp"

namespace pliant {

PressedMaterial::PressedMaterial(std::shared_ptr<const Body> body, LawLayout layout)
    : body_(std::move(body)), layout_(std::move(layout)) {}

std::shared_ptr<const MaterialLaw> PressedMaterial::law(const VectorX& theta) {
  const std::lock_guard lock(mutex_);
  if (!law_ || theta_.size() != theta.size() || theta_ != theta) {
    law_ = press_law(*body_, layout_, theta);
    theta_ = theta;
  }
  return law_;
}

void PressedMaterial::set_form(std::shared_ptr<const Body> body, LawLayout layout) {
  body_ = std::move(body);
  layout_ = std::move(layout);
  law_.reset();
  ++form_;
}

void LinearisedEquilibrium::set(int form, const VectorX& theta, const Placement& placement,
                                const std::vector<Eigen::Index>& rows, std::vector<Points> changes) {
  constexpr std::size_t most = 64;  // a field of nodes each
  form_ = changes.empty() || changes.size() > most ? -1 : form;
  if (form_ < 0) return;
  theta_ = theta, placement_ = placement, rows_ = rows, changes_ = std::move(changes);
}

std::optional<Placement> LinearisedEquilibrium::at(int form, const VectorX& theta, double size) const {
  constexpr double farthest = 0.02;  // of the object's size
  if (form_ != form || theta_.size() != theta.size()) return std::nullopt;
  Points change = Points::Zero(changes_.front().rows(), 3);
  for (std::size_t k = 0; k < changes_.size(); ++k)
    if (const double d = theta[rows_[k]] - theta_[rows_[k]]; d != 0.0) change += d * changes_[k];
  if (!(change.cwiseAbs().maxCoeff() < farthest * size)) return std::nullopt;
  const Eigen::Index n = placement_.nodes.rows();
  return Placement{placement_.nodes + change.topRows(n),
                   placement_.translations + change.bottomRows(change.rows() - n)};
}

PressTrial::PressTrial(std::shared_ptr<const PressScene> scene, int press,
                       const std::shared_ptr<PressedMaterial>& material, const VectorX& reference,
                       const PressTrialOptions& options, int number, const Placement* begin)
    : PressTrial(std::move(scene), press, material,
                 ContactMaterial{material->law(reference), mean_modulus(material->body(), *material->law(reference))},
                 options, number, begin) {
  if (options.noise.growth == 0.0) return;
  is_placed_ = body_.solve().converged;
  set_options(options);
}

PressTrial::PressTrial(std::shared_ptr<const PressScene> scene, int press, std::shared_ptr<PressedMaterial> material,
                       const ContactMaterial& contact, const PressTrialOptions& options, int number,
                       const Placement* begin)
    : EquilibriumTrial(std::move(scene), std::move(material), number),
      press_(press),
      options_(options),
      contact_(contact),
      body_(*scene_, press, contact_.law, contact_.youngs_modulus) {
  if (begin) body_.begin_from(*begin);
  set_options(options);
}

VectorX PressTrial::displacements() const {
  const ObservedPress& observed = seen();
  const Points placed = is_placed_ ? body_.points() : Points();
  VectorX moved{Eigen::Index(observed.rest.size())};
  for (Eigen::Index m = 0; m < moved.size(); ++m) {
    const auto k = std::size_t(m);
    const Vector3 now = is_placed_ ? Vector3(placed.row(m).transpose()) : observed.loaded[k];
    moved[m] = (now - observed.rest[k]).norm();
  }
  return moved;
}

void PressTrial::set_options(const PressTrialOptions& options) {
  options_ = options;
  const VectorX moved = displacements();
  deviations_.resize(moved.size(), 3);
  for (Eigen::Index k = 0; k < deviations_.size(); ++k)
    deviations_.data()[k] = options.noise.deviation(seen().weight(std::size_t(k)), moved[k / 3]);
}

std::vector<Placement> PressTrial::placements() const { return {is_placed_ ? body_.placement() : Placement()}; }

std::unique_ptr<Trial> PressTrial::anew() const {
  const auto material = std::make_shared<PressedMaterial>(material_->shared_body(), material_->layout());
  std::unique_ptr<PressTrial> trial(
      new PressTrial(scene_, press_, material, contact_, options_, number_, is_placed_ ? &body_.placement() : nullptr));
  trial->deviations_ = deviations_;
  return trial;
}

bool PressTrial::compare(const VectorX& theta, CostEvaluation& result, VectorX& slope, VectorX& weight) {
  const ObservedPress& seen = scene_->presses[std::size_t(press_)];
  body_.equilibrium().set_law(material_->law(theta));
  result.steps = 1, result.work = steps_of_an_equilibrium * scene_->body->node_count();
  const bool is_there = is_placed_ && placed_for_.size() == theta.size() && placed_for_ == theta;
  const std::optional<Placement> nearly = is_there ? std::nullopt : guess(linearised_, theta);
  const SolveSummary solved = nearly ? body_.solve_from(*nearly) : body_.solve();
  is_placed_ = solved.converged;
  iterations_ = solved.iterations;
  placed_for_ = theta;
  if (!is_placed_) return result.failure = seen.name + ": " + body_.equilibrium().failure(), false;
  Points residuals = body_.points();
  for (Eigen::Index m = 0; m < residuals.rows(); ++m) residuals.row(m) -= seen.loaded[std::size_t(m)].transpose();
  residuals_ = residuals;
  FrameFit fit;
  fit.recording = number_;
  fit.frame = press_;
  // Pseudo-Huber in each coordinate: c^2 (sqrt(1 + r^2 / c^2) - 1).
  const double c = options_.outlier_scale;
  slope.resize(residuals.size()), weight.resize(residuals.size());
  for (Eigen::Index k = 0; k < residuals.size(); ++k) {
    const double inverse = 1.0 / deviations_.data()[k], r = residuals.data()[k] * inverse,
                 root = std::sqrt(1.0 + r * r / (c * c));
    fit.cost += c * c * (root - 1.0);
    slope[k] = r / root * inverse;
    weight[k] = inverse * inverse / root;
  }
  fit.tracks = int(residuals.rows());
  fit.independent = 3.0 * fit.tracks;
  fit.track_sum_squares = residuals.squaredNorm();
  fit.sum_noise_squares = deviations_.squaredNorm() / 3.0;
  result.cost = fit.cost;
  result.frames.push_back(std::move(fit));
  result.succeeded = true;
  return true;
}

CostEvaluation PressTrial::run(const VectorX& theta, const MatrixX& directions) {
  CostEvaluation result;
  VectorX slope, weight;
  if (!compare(theta, result, slope, weight) || directions.cols() == 0) return result;
  if (!body_.equilibrium().prepare_derivatives(body_.placement())) return unstable(std::move(result), seen().name);
  const LawNumbers numbers(material_->layout(), theta.size());
  const int n = scene_->body->node_count(), rows = n + body_.equilibrium().contact_count();
  std::vector<Points> changes = force_changes(body_.equilibrium().elasticity(), *material_, theta, numbers, rows);
  MatrixX by_parameters(residuals_.size(), Eigen::Index(numbers.count()));
  body_.equilibrium().respond(changes);
  for (std::size_t k = 0; k < numbers.count(); ++k) {
    const Points& change = changes[k];
    Points moved = Points::Zero(residuals_.rows(), 3);
    moved.topRows(body_.embedding().point_count()) = body_.embedding().positions(change.topRows(n));
    if (body_.has_probe()) moved.row(moved.rows() - 1) = change.row(n);
    by_parameters.col(Eigen::Index(k)) = flat(moved);
  }
  linearised_.set(material_->form(), theta, body_.placement(), numbers.rows, std::move(changes));
  const MatrixX J = by_parameters * directions(numbers.rows, Eigen::all);
  FrameFit& fit = result.frames.front();
  fit.gradient = J.transpose() * slope;
  fit.gauss_newton = J.transpose() * weight.asDiagonal() * J;
  return result;
}

CostEvaluation PressTrial::gradient(const VectorX& theta, VectorX& theta_bar) {
  CostEvaluation result;
  VectorX slope, weight;
  theta_bar = VectorX::Zero(theta.size());
  if (!compare(theta, result, slope, weight)) return result;
  if (!body_.equilibrium().prepare_derivatives(body_.placement())) return unstable(std::move(result), seen().name);
  // The cotangent of the points, back through the equilibrium: its matrix is symmetric.
  const int n = scene_->body->node_count(), points = body_.embedding().point_count();
  Points bar = Points::Zero(n + body_.equilibrium().contact_count(), 3), of_nodes = Points::Zero(n, 3);
  for (int m = 0; m < points; ++m) body_.embedding().add_transpose(m, slope.segment<3>(3 * m), of_nodes);
  bar.topRows(n) = of_nodes;
  if (body_.has_probe()) bar.row(n) = slope.tail<3>().transpose();
  const Points on_forces = body_.equilibrium().response(bar);
  add_force_adjoint(body_.equilibrium().elasticity(), *material_, theta, on_forces, theta_bar);
  return result;
}

}  // namespace pliant
