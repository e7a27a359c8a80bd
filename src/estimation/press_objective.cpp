#include "estimation/press_objective.hpp"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numeric>
#include <stdexcept>

namespace pliant {

namespace {

/// ln E of an element by those of the control moduli.
double log_modulus(const Body& body, int e, const PressTheta& layout, const VectorX& theta) {
  const ModulusField& field = body.modulus;
  double log = std::log(field.relative[std::size_t(e)]);
  if (field.controls == 1) return log + std::log(theta[layout.modulus(0)]);
  for (int k = 0; k < field.controls; ++k) log += field.weights(e, k) * std::log(theta[layout.modulus(k)]);
  return log;
}
double weight_of(const Body& body, int e, int control) {
  return body.modulus.controls == 1 ? 1.0 : body.modulus.weights(e, control);
}

/// mu_i / mu of each term.
VectorX shares(const PressTheta& layout, const VectorX& theta) {
  VectorX share = VectorX::Ones(layout.terms);
  for (int i = 1; i < layout.terms; ++i) share[i] = theta[layout.ratio(i)];
  return share / share.sum();
}

}  // namespace

MatrixX press_table_derivative(const PressTheta& layout, const VectorX& theta, double E) {
  const double nu = theta[layout.poissons_ratio()];
  if (layout.terms == 0) {
    MatrixX by = MatrixX::Zero(2, 2);
    const LambdaAlpha p = lambda_alpha({E, nu});
    by(0, 0) = p.lambda, by(1, 0) = p.alpha;
    by(0, 1) = p.lambda * (1.0 + 4.0 * nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    by(1, 1) = p.lambda + nu * by(0, 1);
    return by;
  }
  const VectorX share = shares(layout, theta);
  const double mu = E / (2.0 * (1.0 + nu));
  MatrixX by = MatrixX::Zero(3 * layout.terms, 2 + layout.shapes());
  for (int i = 0; i < layout.terms; ++i) {
    by(3 * i, 0) = mu * share[i];
    by(3 * i, 1) = -mu * share[i] / (1.0 + nu);
    by(3 * i + 1, layout.exponent(i)) = 1.0;
    by(3 * i + 2, 1) = 1.0;
    for (int j = 1; j < layout.terms; ++j)
      by(3 * i, layout.ratio(j)) = mu * share[j] / theta[layout.ratio(j)] * ((i == j) - share[i]);
  }
  return by;
}

ParameterSet press_parameters(const Body& body, const std::vector<std::string>& modulus_names, int terms,
                              double youngs_modulus) {
  const PressTheta layout{body.modulus.controls, terms};
  if (int(modulus_names.size()) != layout.controls) throw std::invalid_argument("a name a control modulus is needed");
  VectorX theta = VectorX::Zero(layout.size());
  std::vector<Parameter> parameters;
  const auto add = [&](const std::string& name, const char* unit, Transform transform, int index, double value,
                       double lower, double upper, double prior_std) {
    theta[index] = value;
    Parameter p{name, unit, transform, index, 1.0, lower, upper, true};
    p.prior_std = prior_std;
    p.prior_mean = VectorX::Constant(1, transform == Transform::Logarithm ? std::log(value)
                                        : transform == Transform::Shift   ? value
                                                                          : std::log(value / (0.5 - value)));
    parameters.push_back(std::move(p));
  };
  const double none = std::numeric_limits<double>::infinity();
  for (int k = 0; k < layout.controls; ++k)
    add(modulus_names[std::size_t(k)], "Pa", Transform::Logarithm, layout.modulus(k), youngs_modulus,
        1e-4 * youngs_modulus, 1e4 * youngs_modulus, none);
  add("poisson_ratio", "1", Transform::LogitHalf, layout.poissons_ratio(), 0.3, 0.01, 0.495, 2.0);
  for (int i = 0; i < terms; ++i) {
    const std::string number = "@" + std::to_string(i + 1);
    // Negative exponents stiffen in compression, great ones in tension; which of them do follows from the presses.
    const double sign = i % 2 == 0 ? 1.0 : -1.0, size = i < 2 ? 3.0 : 12.0;
    add("exponent" + number, "1", Transform::Shift, layout.exponent(i), sign * size, -60.0, 60.0, none);
    parameters.back().scale = 4.0;
    parameters.back().prior_mean /= 4.0;
    parameters.back().prior_std = 3.0;
    if (i > 0)
      add("stiffness_ratio" + number, "1", Transform::Logarithm, layout.ratio(i), i < 2 ? 1.0 : 0.1, 1e-6, 1e3, 3.0);
  }
  return {std::move(parameters), std::move(theta)};
}

std::shared_ptr<const TabulatedLaw> press_law(const Body& body, const PressTheta& layout, const VectorX& theta) {
  const double nu = theta[layout.poissons_ratio()];
  MatrixX table(body.element_count(), layout.terms == 0 ? 2 : 3 * layout.terms);
  const VectorX share = layout.terms == 0 ? VectorX() : shares(layout, theta);
  for (int e = 0; e < body.element_count(); ++e) {
    const double E = std::exp(log_modulus(body, e, layout, theta));
    if (layout.terms == 0) {
      const LambdaAlpha p = lambda_alpha({E, nu});
      table.row(e) << p.lambda, p.alpha;
      continue;
    }
    for (int i = 0; i < layout.terms; ++i)
      table.row(e).segment<3>(3 * i) << E / (2.0 * (1.0 + nu)) * share[i], theta[layout.exponent(i)], nu;
  }
  if (layout.terms == 0) return std::make_shared<LinearLaw>(std::move(table));
  return std::make_shared<OgdenLaw>(std::move(table));
}

PressObjective::PressObjective(std::shared_ptr<const PressScene> scene, std::vector<int> presses,
                               const PressTheta& layout, ParameterSet parameters, const PressObjectiveOptions& options)
    : scene_(std::move(scene)),
      presses_(std::move(presses)),
      layout_(layout),
      parameters_(std::move(parameters)),
      options_(options),
      residuals_(presses_.size()) {
  const auto law = press_law(*scene_->body, layout_, parameters_.reference());
  const double modulus = mean_modulus(*scene_->body, *law);
  for (const int press : presses_) bodies_.emplace_back(*scene_, press, law, modulus);
}

std::vector<double> PressObjective::residuals() const {
  std::vector<double> all;
  for (const Points& r : residuals_) all.insert(all.end(), r.data(), r.data() + r.size());
  return all;
}

CostEvaluation PressObjective::run(const VectorX& p, bool with_derivatives) {
  CostEvaluation result;
  theta_ = parameters_.to_theta(p);
  const auto law = press_law(*scene_->body, layout_, theta_);
  const MatrixX by_p = with_derivatives ? parameters_.jacobian(p) : MatrixX();
  result.frames.resize(presses_.size());
  std::vector<std::string> failures(presses_.size());
  tbb::parallel_for(std::size_t(0), presses_.size(), [&](std::size_t i) {
    bodies_[i].equilibrium().set_law(law);
    result.frames[i].frame = presses_[i];
    add_press(i, by_p, with_derivatives, result.frames[i], failures[i]);
  });
  for (std::size_t i = 0; i < failures.size(); ++i)
    if (!failures[i].empty()) {
      result.failure = scene_->presses[std::size_t(presses_[i])].name + ": " + failures[i];
      return result;
    }
  VectorX gradient;
  MatrixX curvature;
  result.cost = parameters_.prior(p, with_derivatives ? &gradient : nullptr, with_derivatives ? &curvature : nullptr);
  if (with_derivatives) result.gradient = gradient, result.gauss_newton = curvature;
  for (const FrameFit& frame : result.frames) {
    result.cost += frame.cost;
    result.steps += 1;
    if (!with_derivatives) continue;
    result.gradient += frame.gradient;
    result.gauss_newton += frame.gauss_newton;
  }
  result.succeeded = std::isfinite(result.cost);
  if (!result.succeeded) result.failure = "the cost is not finite";
  return result;
}

void PressObjective::add_press(std::size_t i, const MatrixX& by_p, bool with_derivatives, FrameFit& fit,
                               std::string& failure) {
  PressedBody& body = bodies_[i];
  const ObservedPress& seen = scene_->presses[std::size_t(presses_[i])];
  if (!body.solve().converged) {
    failure = body.equilibrium().failure();
    return;
  }
  Points residuals = body.points();
  for (Eigen::Index m = 0; m < residuals.rows(); ++m) residuals.row(m) -= seen.loaded[std::size_t(m)].transpose();
  residuals_[i] = residuals;
  // Pseudo-Huber in each coordinate: c^2 (sqrt(1 + r^2 / c^2) - 1).
  const double c = options_.outlier_scale, inverse = 1.0 / options_.noise;
  VectorX slope{residuals.size()}, weight{residuals.size()};
  for (Eigen::Index k = 0; k < residuals.size(); ++k) {
    const double r = residuals.data()[k] * inverse, root = std::sqrt(1.0 + r * r / (c * c));
    fit.cost += c * c * (root - 1.0);
    slope[k] = r / root * inverse;
    weight[k] = inverse * inverse / root;
  }
  fit.tracks = int(residuals.rows());
  fit.independent = 3.0 * fit.tracks;
  fit.track_sum_squares = residuals.squaredNorm();
  fit.sum_noise_squares = fit.tracks * options_.noise * options_.noise;
  if (!with_derivatives) return;
  if (!body.equilibrium().prepare_derivatives(body.placement())) {
    failure = "the equilibrium is not stable";
    return;
  }
  // Changes of the forces -dW/dx by each number of theta.
  const int n = scene_->body->node_count(), rows = n + body.equilibrium().contact_count();
  std::vector<Points> forces(std::size_t(layout_.size()), Points::Zero(rows, 3));
  body.equilibrium().elasticity().for_parameter_derivatives(
      [&](int e, std::span<const int> nodes, const Eigen::Ref<const MatrixX>& by_q) {
        const double E = std::exp(log_modulus(*scene_->body, e, layout_, theta_));
        const MatrixX by = by_q * press_table_derivative(layout_, theta_, E);
        for (std::size_t a = 0; a < nodes.size(); ++a) {
          const auto at = 3 * Eigen::Index(a);
          for (int k = 0; k < layout_.controls; ++k)
            if (const double w = weight_of(*scene_->body, e, k); w != 0.0)
              forces[std::size_t(layout_.modulus(k))].row(nodes[a]) -=
                  w / theta_[layout_.modulus(k)] * by.col(0).segment<3>(at).transpose();
          for (int s = 1; s < 2 + layout_.shapes(); ++s)
            forces[std::size_t(s)].row(nodes[a]) -= by.col(s).segment<3>(at).transpose();
        }
      });
  MatrixX by_theta(residuals.size(), layout_.size());
  for (int k = 0; k < layout_.size(); ++k) {
    const Points& change = body.equilibrium().response(forces[std::size_t(k)]);
    Points moved = Points::Zero(residuals.rows(), 3);
    moved.topRows(body.embedding().point_count()) = body.embedding().positions(change.topRows(n));
    if (body.has_probe()) moved.row(moved.rows() - 1) = change.row(n);
    by_theta.col(k) = flat(moved);
  }
  const MatrixX J = by_theta * by_p;
  fit.gradient = J.transpose() * slope;
  fit.gauss_newton = J.transpose() * weight.asDiagonal() * J;
}

}  // namespace pliant
