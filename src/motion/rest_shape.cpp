#include "motion/rest_shape.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/points.hpp"
#include "motion/pull.hpp"

namespace pliant {

namespace {

constexpr int most_iterations = 40;  // from a shape nearby; those that succeed take about ten
constexpr int most_pins = 24;        // points that stand for what is held

MatrixX covariance(const std::vector<Vector3>& a, const std::vector<Vector3>& b, const ShapeField& field) {
  MatrixX K(Eigen::Index(a.size()), Eigen::Index(b.size()));
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j)
      K(Eigen::Index(i), Eigen::Index(j)) = std::pow(field.standard_deviation, 2) *
                                            std::exp(-0.5 * (a[i] - b[j]).squaredNorm() / std::pow(field.length, 2));
  return K;
}

MatrixX with_nugget(MatrixX K) {
  K.diagonal() *= 1.0 + 1e-6;
  return K;
}

}  // namespace

MatrixX shape_basis(const Body& body, const ShapeField& field, const std::vector<int>& held) {
  const auto count = Eigen::Index(field.points.size());
  if (count == 0) return MatrixX(body.node_count(), 0);
  if (!(field.standard_deviation > 0.0 && field.length > 0.0))
    throw std::invalid_argument("shape_basis: the field needs a width and a length");
  const std::vector<Vector3> nodes = to_vectors(body.scanned_positions());
  MatrixX at_points = covariance(field.points, field.points, field), at_nodes = covariance(nodes, field.points, field);
  if (!held.empty()) {
    std::vector<Vector3> candidates;
    for (const int n : held) candidates.push_back(nodes[std::size_t(n)]);
    const std::vector<Vector3> pins =
        far_points(candidates, {candidates.front()}, std::min(most_pins, int(held.size())));
    // What is left of the covariances where the field is known to vanish.
    const auto inverse = with_nugget(covariance(pins, pins, field)).ldlt();
    const MatrixX shared = inverse.solve(covariance(pins, field.points, field));
    at_points -= covariance(field.points, pins, field) * shared;
    at_nodes -= covariance(nodes, pins, field) * shared;
  }
  at_points.diagonal().array() += 1e-6 * std::pow(field.standard_deviation, 2);
  const Eigen::LLT<MatrixX> root(at_points);
  // u = k(X, P) K^-1 L zeta = (L^-1 k(P, X))^T zeta
  MatrixX basis = root.matrixL().solve(at_nodes.transpose()).transpose();
  for (const int n : held) basis.row(n).setZero();
  return basis;
}

RestShape::RestShape(std::shared_ptr<const Body> body, const std::vector<int>& held, bool sags,
                     const std::vector<PointMass>& weights, MatrixX basis, const MotionBlocks& blocks,
                     const Material& material)
    : body_(std::move(body)),
      free_(body_),
      held_(held),
      sags_(sags),
      basis_(std::move(basis)),
      blocks_(blocks),
      scan_(body_->scanned_positions()) {
  if (body_->kind == ElementKind::Hexahedron)
    throw std::invalid_argument("hexahedra are regular where they are stress-free");
  if (basis_.cols() != Eigen::Index(blocks_.scan_corrections.size()))
    throw std::invalid_argument("one parameter block a correction of the scan is expected");
  depends_on_ = blocks_.scan_corrections;
  if (!sags_) return;
  depends_on_.insert(depends_on_.end(), {blocks_.density, blocks_.gravity});
  for (const ParameterHandle& block : material.parameters(blocks_)) depends_on_.push_back(block);
  ReferenceShapeOptions options;
  options.by_parts = false;
  options.max_iterations = most_iterations;
  solver_ = std::make_unique<ReferenceShapeSolver>(body_, held, material, blocks_, options);
  elasticity_ = material.make_elasticity(body_, blocks_);
  terms_.push_back(std::make_unique<Gravity>(*body_, blocks_));
  if (!weights.empty()) terms_.push_back(std::make_unique<PointWeights>(*body_, weights, blocks_.gravity));
}

Points RestShape::scan_tangent(const VectorX& d_theta) const {
  Points zeta(basis_.cols(), 3);
  for (Eigen::Index k = 0; k < zeta.rows(); ++k)
    zeta.row(k) = blocks_.scan_corrections[std::size_t(k)].vector(d_theta).transpose();
  return basis_ * zeta;
}

std::string RestShape::find(const VectorX& theta) {
  if (theta_.size() == theta.size() && !changes_any(depends_on_, theta - theta_)) return {};
  theta_.resize(0);
  has_derivatives_ = false;
  const Points scan = body_->scanned_positions() + scan_tangent(theta);
  Points X = scan;
  if (sags_) {
    solver_->set_scan(scan);
    Points load = Points::Zero(scan.rows(), 3);
    for (auto& term : terms_) {
      term->set_parameters(theta);
      term->add_force(scan, load);
    }
    const ReferenceShape shape =
        solver_->find(theta, load, last_found_ ? &last_found_->reference_positions() : nullptr);
    if (!shape.found) return "the object as it was scanned cannot be held up: " + shape.reason;
    X = shape.X;
  }
  try {
    free_ = std::make_shared<Body>(with_reference(*body_, std::move(X)));
  } catch (const std::invalid_argument&) {
    return "the corrected scan has elements inside out";
  }
  last_found_ = free_;
  scan_ = scan;
  theta_ = theta;
  return {};
}

bool RestShape::prepare_derivatives() {
  if (!sags_ || has_derivatives_) return true;
  elasticity_->set_reference(free_);
  elasticity_->set_parameters(theta_);
  elasticity_->linearise(scan_);
  return has_derivatives_ = solver_->prepare_derivatives(theta_, free_->reference_positions());
}

Points RestShape::reference_tangent(const VectorX& d_theta, const Points& d_scan) {
  if (!sags_) return d_scan;
  if (!changes_any(depends_on_, d_theta)) return Points::Zero(scan_.rows(), 3);
  Points d_force = Points::Zero(scan_.rows(), 3);
  elasticity_->add_force_tangent(scan_, d_scan, d_scan, d_theta, d_force);
  for (auto& term : terms_) term->add_force_tangent(scan_, d_scan, d_scan, d_theta, d_force);
  return solver_->tangent(d_force);
}

void RestShape::adjoint(const Points& scan_bar, const Points& reference_bar, VectorX& theta_bar) {
  Points bar = scan_bar;
  if (sags_) {
    const Points force_bar = solver_->adjoint(reference_bar);
    Points lag_bar = Points::Zero(scan_.rows(), 3);
    elasticity_->add_force_adjoint(scan_, force_bar, lag_bar, bar, theta_bar);
    for (auto& term : terms_) term->add_force_adjoint(scan_, force_bar, lag_bar, bar, theta_bar);
    bar += lag_bar;
  } else {
    bar += reference_bar;
  }
  const Points zeta_bar = basis_.transpose() * bar;
  for (Eigen::Index k = 0; k < zeta_bar.rows(); ++k)
    theta_bar.segment<3>(blocks_.scan_corrections[std::size_t(k)]) += zeta_bar.row(k).transpose();
}

}  // namespace pliant
