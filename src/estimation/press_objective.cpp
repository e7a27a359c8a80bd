#include "estimation/press_objective.hpp"

#include <tbb/parallel_for.h>

#include <cmath>
#include <numeric>
#include <stdexcept>

namespace pliant {

namespace {

double weight_of(const Body& body, int e, int control) {
  return body.modulus.controls == 1 ? 1.0 : body.modulus.weights(e, control);
}

/// Ogden's law of one element by its own theta: terms share the shear modulus, and its E is that at rest.
struct OgdenShares {
  VectorX share;              // mu_i / mu
  VectorX bulk;               // b_i = nu_i / (1 - 2 nu_i)
  double nu = 0.0, mu = 0.0;  // of all terms together, at rest
  double mean_bulk = 0.0;     // sum of share times bulk
};
OgdenShares ogden_shares(const PressTheta& layout, const VectorX& own) {
  OgdenShares s;
  s.share = VectorX::Ones(layout.terms);
  s.bulk.resize(layout.terms);
  for (int i = 0; i < layout.terms; ++i) {
    if (i > 0) s.share[i] = own[layout.stiffness_ratio(i)];
    const double nu = own[layout.poissons_ratio_of(i, 0)];
    s.bulk[i] = nu / (1.0 - 2.0 * nu);
  }
  s.share /= s.share.sum();
  s.mean_bulk = s.share.dot(s.bulk);
  s.nu = s.mean_bulk / (1.0 + 2.0 * s.mean_bulk);
  s.mu = own[0] / (2.0 * (1.0 + s.nu));
  return s;
}

}  // namespace

VectorX element_theta(const Body& body, const PressTheta& layout, const VectorX& theta, int e) {
  VectorX own = VectorX::Zero(1 + layout.law_size());
  double log = std::log(body.modulus.relative[std::size_t(e)]);
  for (int k = 0; k < layout.controls; ++k)
    if (const double w = weight_of(body, e, k); w != 0.0) log += w * std::log(theta[layout.modulus(k)]);
  own[0] = std::exp(log);
  if (layout.laws == 1) {
    own.tail(layout.law_size()) = theta.segment(1, layout.law_size());
    return own;
  }
  const PressTheta single = layout.of_element();
  for (int k = 0; k < layout.controls; ++k) {
    const double w = weight_of(body, e, k);
    if (w == 0.0) continue;
    VectorX law = theta.segment(layout.poissons_ratio(k), layout.law_size());
    for (int i = 1; i < layout.terms; ++i)
      law[single.stiffness_ratio(i) - 1] = std::log(law[single.stiffness_ratio(i) - 1]);
    own.tail(layout.law_size()) += w * law;
  }
  for (int i = 1; i < layout.terms; ++i) own[single.stiffness_ratio(i)] = std::exp(own[single.stiffness_ratio(i)]);
  return own;
}

std::vector<ThetaShare> element_theta_shares(const Body& body, const PressTheta& layout, const VectorX& theta,
                                             const VectorX& own, int e) {
  std::vector<ThetaShare> shares;
  for (int k = 0; k < layout.controls; ++k) {
    const double w = weight_of(body, e, k);
    if (w == 0.0) continue;
    shares.push_back({0, layout.modulus(k), w / theta[layout.modulus(k)]});
    if (layout.laws == 1) continue;
    for (int s = 1; s <= layout.law_size(); ++s) {
      const bool is_ratio = s >= 4 && s % 3 == 1;
      const int at = layout.poissons_ratio(k) + s - 1;
      shares.push_back({s, at, is_ratio ? w * own[s] / theta[at] : w});
    }
  }
  if (layout.laws == 1)
    for (int s = 1; s <= layout.law_size(); ++s) shares.push_back({s, s, 1.0});
  return shares;
}

MatrixX press_table_derivative(int terms, const VectorX& own) {
  const PressTheta layout{1, terms};
  if (terms == 0) {
    const double E = own[0], nu = own[layout.poissons_ratio()];
    MatrixX by = MatrixX::Zero(2, 2);
    const LambdaAlpha p = lambda_alpha({E, nu});
    by(0, 0) = p.lambda, by(1, 0) = p.alpha;
    by(0, 1) = p.lambda * (1.0 + 4.0 * nu) / ((1.0 + nu) * (1.0 - 2.0 * nu));
    by(1, 1) = p.lambda + nu * by(0, 1);
    return by;
  }
  const OgdenShares o = ogden_shares(layout, own);
  const double mu_by_bulk = -o.mu / (1.0 + o.nu) / std::pow(1.0 + 2.0 * o.mean_bulk, 2);
  MatrixX by = MatrixX::Zero(3 * terms, layout.size());
  for (int i = 0; i < terms; ++i) {
    by(3 * i, 0) = o.mu * o.share[i];
    by(3 * i + 1, layout.exponent(i)) = 1.0;
    by(3 * i + 2, layout.poissons_ratio_of(i, 0)) = 1.0;
    for (int j = 0; j < terms; ++j) {
      const double nu = own[layout.poissons_ratio_of(j, 0)], bulk_by_nu = 1.0 / std::pow(1.0 - 2.0 * nu, 2);
      by(3 * i, layout.poissons_ratio_of(j, 0)) = o.share[i] * mu_by_bulk * o.share[j] * bulk_by_nu;
      if (j == 0) continue;
      const int ratio = layout.stiffness_ratio(j);
      by(3 * i, ratio) = o.share[j] / own[ratio] *
                         (o.mu * ((i == j) - o.share[i]) + o.share[i] * mu_by_bulk * (o.bulk[j] - o.mean_bulk));
    }
  }
  return by;
}

ParameterSet press_parameters(const PressTheta& layout, const std::vector<std::string>& modulus_names,
                              double youngs_modulus) {
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
  for (int law = 0; law < layout.laws; ++law) {
    const std::string& owner = modulus_names[std::size_t(law)];
    const std::string place =
        layout.laws == 1 || owner.find('@') == std::string::npos ? "" : owner.substr(owner.find('@'));
    add("poisson_ratio" + place, "1", Transform::LogitHalf, layout.poissons_ratio(law), 0.3, 0.01, 0.495, 2.0);
    for (int i = 1; i < layout.terms; ++i) {
      theta[layout.poissons_ratio_of(i, law)] = 0.3;
      if (!layout.own_ratios) parameters.back().also.push_back(layout.poissons_ratio_of(i, law));
    }
    for (int i = 0; i < layout.terms; ++i) {
      const std::string number = "_" + std::to_string(i + 1) + place;
      // Negative exponents stiffen in compression, great ones in tension; which of them do follows from the presses.
      const double sign = i % 2 == 0 ? 1.0 : -1.0, size = i < 2 ? 3.0 : 12.0;
      add("exponent" + number, "1", Transform::Shift, layout.exponent(i, law), sign * size, -60.0, 60.0, none);
      parameters.back().scale = 4.0;
      parameters.back().prior_mean /= 4.0;
      parameters.back().prior_std = 3.0;
      if (i > 0)
        add("stiffness_ratio" + number, "1", Transform::Logarithm, layout.stiffness_ratio(i, law), i < 2 ? 1.0 : 0.1,
            1e-6, 1e3, 3.0);
      if (i > 0 && layout.own_ratios)
        add("poisson_ratio" + number, "1", Transform::LogitHalf, layout.poissons_ratio_of(i, law), 0.3, 0.01, 0.495,
            2.0);
    }
  }
  return {std::move(parameters), std::move(theta)};
}

std::shared_ptr<const TabulatedLaw> press_law(const Body& body, const PressTheta& layout, const VectorX& theta) {
  const PressTheta single = layout.of_element();
  MatrixX table(body.element_count(), layout.terms == 0 ? 2 : 3 * layout.terms);
  for (int e = 0; e < body.element_count(); ++e) {
    const VectorX own = element_theta(body, layout, theta, e);
    if (layout.terms == 0) {
      const LambdaAlpha p = lambda_alpha({own[0], own[single.poissons_ratio()]});
      table.row(e) << p.lambda, p.alpha;
      continue;
    }
    const OgdenShares o = ogden_shares(single, own);
    for (int i = 0; i < layout.terms; ++i)
      table.row(e).segment<3>(3 * i) << o.mu * o.share[i], own[single.exponent(i)], own[single.poissons_ratio_of(i, 0)];
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

void PressObjective::set_form(std::shared_ptr<const PressScene> scene, const PressTheta& layout,
                              ParameterSet parameters) {
  scene_ = std::move(scene);
  layout_ = layout;
  parameters_ = std::move(parameters);
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
        const VectorX own = element_theta(*scene_->body, layout_, theta_, e);
        const MatrixX by = by_q * press_table_derivative(layout_.terms, own);
        for (const auto& [number, at, share] : element_theta_shares(*scene_->body, layout_, theta_, own, e))
          for (std::size_t a = 0; a < nodes.size(); ++a)
            forces[std::size_t(at)].row(nodes[a]) -= share * by.col(number).segment<3>(3 * Eigen::Index(a)).transpose();
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
