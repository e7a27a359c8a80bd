#include "elasticity/sampled_law.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "elasticity/polar.hpp"

namespace pliant {

namespace {

using Vector2 = Eigen::Vector2d;

/// The kernel's tip is rounded at this strain, so that it has a second derivative.
constexpr double tip = 1e-3;

/// Gauss-Legendre on (0, 1).
struct GaussPoint {
  double t, weight;
};
constexpr std::array<GaussPoint, 5> path = {{{0.046910077030668, 0.118463442528095},
                                             {0.230765344947158, 0.239314335249683},
                                             {0.5, 0.284444444444444},
                                             {0.769234655052842, 0.239314335249683},
                                             {0.953089922969332, 0.118463442528095}}};

/// A value that leaves [least, most] levels off within `below` and `above` of it, with continuous curvature.
struct Bounded {
  double value, first, second;
};
Bounded bounded(double v, double least, double most, double below, double above) {
  const auto level = [](double excess, double room, double edge, double sign) -> Bounded {
    const double x = std::tanh(excess / room);
    return {edge + sign * room * x, 1.0 - x * x, -2.0 * sign * x * (1.0 - x * x) / room};
  };
  if (v > most) return level(v - most, above, most, 1.0);
  if (v < least) return level(least - v, below, least, -1.0);
  return {v, 1.0, 0.0};
}

Strain6 mandel(const Strain6& e) {
  Strain6 m = e;
  m.tail<3>() *= std::sqrt(2.0);
  return m;
}

/// A symmetric L with |L m|^2 = (1 - 2 nu) e : e + nu tr(e)^2.
Matrix6 metric_root(double nu) {
  const double shape = std::sqrt(1.0 - 2.0 * nu), volume = std::sqrt(1.0 - 2.0 * nu + 3.0 * nu);
  Matrix6 L = shape * Matrix6::Identity();
  L.topLeftCorner<3, 3>().array() += (volume - shape) / 3.0;
  return L;
}

Bounded bounded_lambda(const StrainSamples& s, double v) {
  return bounded(v, s.least[0], s.most[0], 0.5 * s.least[0], s.most[0]);
}
Bounded bounded_nu(const StrainSamples& s, double v) {
  return bounded(v, s.least[1], s.most[1], 0.9 * (1.0 + s.least[1]), 0.9 * (0.5 - s.most[1]));
}

}  // namespace

SampledLaw::SampledLaw(std::vector<StrainSamples> elements, double metric_nu)
    : metric_nu_(metric_nu), to_metric_(metric_root(metric_nu)) {
  for (StrainSamples& samples : elements) {
    if (samples.strains.size() != samples.weights.size() || !(samples.least[0] > 0.0) || !(samples.least[1] > -1.0) ||
        !(samples.most[1] < 0.5) || !(samples.most[0] < 1e30))
      throw std::invalid_argument("sampled stiffness needs lambda > 0 and -1 < nu < 1/2, and a weight a strain");
    Element& element = elements_.emplace_back();
    for (const Strain6& strain : samples.strains) element.centres.push_back(to_metric_ * mandel(strain));
    element.given = std::move(samples);
  }
}

Eigen::Vector2d SampledLaw::interpolated(int e, const Strain6& strain) const {
  const Element& element = elements_[std::size_t(e)];
  const Vector6 y = to_metric_ * mandel(strain);
  Vector2 p = element.given.constant;
  for (std::size_t i = 0; i < element.centres.size(); ++i)
    p += element.given.weights[i] * std::sqrt((y - element.centres[i]).squaredNorm() + tip * tip);
  return {bounded_lambda(element.given, p[0]).value, bounded_nu(element.given, p[1]).value};
}

/// With m the strain and p(t m) = (lambda, nu) at the path's points,
///   W = sum_g w t Q(m; p_g),   Q = lambda ((1 - 2 nu) |m|^2 + nu tr^2).
void SampledLaw::stress(int e, const Matrix3& F, bool with_tangent, PointStress& out) const {
  const Element& element = elements_[std::size_t(e)];
  const StrainSamples& given = element.given;
  const Polar polar = polar_decomposition(F);
  const Matrix3& S = polar.S;
  Vector6 m;
  m << S(0, 0) - 1.0, S(1, 1) - 1.0, S(2, 2) - 1.0, S(0, 1), S(0, 2), S(1, 2);
  m = mandel(m);
  const Vector6 y = to_metric_ * m;
  const double square = m.squaredNorm(), trace = m.head<3>().sum();
  Vector6 ones = Vector6::Zero();
  ones.head<3>().setOnes();
  double energy = 0.0;
  Vector6 gradient = Vector6::Zero();
  Matrix6 hessian = Matrix6::Zero(), of_y = Matrix6::Zero();  // the second by y, from both sides still without L
  for (const GaussPoint& g : path) {
    Vector2 value = given.constant;
    Vector6 d_lambda = Vector6::Zero(), d_nu = Vector6::Zero();  // by y at t y
    for (std::size_t i = 0; i < element.centres.size(); ++i) {
      const Vector6 d = g.t * y - element.centres[i];
      const double r = std::sqrt(d.squaredNorm() + tip * tip);
      const Vector2& w = given.weights[i];
      value += w * r;
      d_lambda += w[0] / r * d;
      d_nu += w[1] / r * d;
    }
    const Bounded lambda = bounded_lambda(given, value[0]), nu = bounded_nu(given, value[1]);
    const double shape = 1.0 - 2.0 * nu.value, weight = g.weight * g.t;
    const double by_lambda = shape * square + nu.value * trace * trace;               // dQ / d lambda
    const double slope = trace * trace - 2.0 * square, by_nu = lambda.value * slope;  // dQ / d nu
    const Vector6 by_m = 2.0 * lambda.value * (shape * m + nu.value * trace * ones);
    // lambda and nu by m: through t L
    const Vector6 m_lambda = g.t * lambda.first * (to_metric_ * d_lambda), m_nu = g.t * nu.first * (to_metric_ * d_nu);
    energy += weight * lambda.value * by_lambda;
    gradient += weight * (by_m + by_lambda * m_lambda + by_nu * m_nu);
    if (!with_tangent) continue;
    const Vector6 m_by_lambda = by_m / lambda.value;                        // d2Q / dm dlambda
    const Vector6 m_by_nu = 2.0 * lambda.value * (trace * ones - 2.0 * m);  // d2Q / dm dnu
    const Matrix6 mixed =
        m_by_lambda * m_lambda.transpose() + m_by_nu * m_nu.transpose() + slope * m_lambda * m_nu.transpose();
    hessian += weight * (mixed + mixed.transpose());
    hessian.topLeftCorner<3, 3>().array() += weight * 2.0 * lambda.value * nu.value;
    hessian.diagonal().array() += weight * 2.0 * lambda.value * shape;
    const double back = weight * g.t * g.t;
    for (std::size_t i = 0; i < element.centres.size(); ++i) {  // I / r - d d^T / r^3
      const Vector6 d = g.t * y - element.centres[i];
      const double square_r = d.squaredNorm() + tip * tip;
      const Vector2& w = given.weights[i];
      const double c = back * (by_lambda * lambda.first * w[0] + by_nu * nu.first * w[1]) / std::sqrt(square_r);
      of_y.diagonal().array() += c;
      of_y.noalias() -= (c / square_r) * d * d.transpose();
    }
    if (lambda.second != 0.0) of_y += back * by_lambda * lambda.second * d_lambda * d_lambda.transpose();
    if (nu.second != 0.0) of_y += back * by_nu * nu.second * d_nu * d_nu.transpose();
  }
  if (with_tangent) hessian += to_metric_ * of_y * to_metric_;
  out.energy = energy;
  const double half = std::sqrt(0.5);
  Matrix3 T;
  T << gradient[0], half * gradient[3], half * gradient[4],  //
      half * gradient[3], gradient[1], half * gradient[5],   //
      half * gradient[4], half * gradient[5], gradient[2];
  set_strain_stress(polar, T, with_tangent ? &hessian : nullptr, out);
}

SmallStrainModuli SampledLaw::small_strain(int e) const {
  const Vector2 p = interpolated(e, Strain6::Zero());
  return moduli_of({p[0], p[0] * p[1]});
}

// ---- from fits

namespace {

/// One element's samples in the coordinates of the norm.
struct ElementSamples {
  std::vector<Strain6> strains, y;
  std::vector<Vector2> p;    // (lambda, nu)
  std::vector<double> size;  // |y|
};

/// Values of the basis, c first and then the weights with their sum taken away: N x centres.
MatrixX basis(const std::vector<Strain6>& points, const std::vector<Strain6>& centres) {
  const auto kernel = [](const Strain6& a, const Strain6& b) { return std::sqrt((a - b).squaredNorm() + tip * tip); };
  MatrixX B(Eigen::Index(points.size()), Eigen::Index(centres.size()));
  for (std::size_t i = 0; i < points.size(); ++i) {
    B(Eigen::Index(i), 0) = 1.0;
    for (std::size_t c = 1; c < centres.size(); ++c)
      B(Eigen::Index(i), Eigen::Index(c)) = kernel(points[i], centres[c]) - kernel(points[i], centres[0]);
  }
  return B;
}

struct Selection {
  StrainSamples samples;
  std::vector<double> square_error;  // summed over the element's samples, with 1, 2, ... in the basis
};

Selection select(const ElementSamples& s, const BasisOptions& options) {
  const std::size_t n = s.y.size();
  // Zero strain first: the mean of the smallest strains, a fifth of all, by how much each tells.
  std::vector<std::size_t> order(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = i;
  std::ranges::sort(order, {}, [&](std::size_t i) { return s.size[i]; });
  Vector2 start = Vector2::Zero();
  double told = 0.0;
  for (std::size_t k = 0; k < std::max<std::size_t>(1, n / 5); ++k) {
    const double weight = s.size[order[k]] + 1e-12;
    start += weight * s.p[order[k]];
    told += weight;
  }
  start /= told;
  std::vector<Strain6> points = s.y;
  points.push_back(Strain6::Zero());
  MatrixX values(Eigen::Index(n + 1), 2);
  VectorX weight{Eigen::Index(n + 1)};
  const double largest = std::max(*std::ranges::max_element(s.size), 1e-12);
  double greatest_stress = 0.0;
  Selection selection;
  selection.samples.least = selection.samples.most = start;
  for (std::size_t i = 0; i < n; ++i) {
    values.row(Eigen::Index(i)) = s.p[i].transpose();
    weight[Eigen::Index(i)] = s.size[i];
    greatest_stress = std::max(greatest_stress, s.size[i] * s.p[i][0]);
    if (s.size[i] < 0.05 * largest) continue;  // hardly strained: says little, bounds nothing
    selection.samples.least = selection.samples.least.cwiseMin(s.p[i]);
    selection.samples.most = selection.samples.most.cwiseMax(s.p[i]);
  }
  values.row(Eigen::Index(n)) = start.transpose();
  weight[Eigen::Index(n)] = 0.3 * largest;
  std::vector<Strain6> centres = {Strain6::Zero()}, strains = {Strain6::Zero()};
  std::vector<bool> is_taken(n, false);
  MatrixX coefficients;
  for (;;) {
    const MatrixX B = basis(points, centres);
    // A trace of ridge keeps weights small where samples nearly coincide.
    const Eigen::Index m = B.cols();
    MatrixX system(B.rows() + m, m), right(B.rows() + m, 2);
    system << weight.asDiagonal() * B, MatrixX::Zero(m, m);
    right << weight.asDiagonal() * values, MatrixX::Zero(m, 2);
    for (Eigen::Index k = 1; k < m; ++k) system(B.rows() + k, k) = 0.02 * largest * largest;
    coefficients = system.colPivHouseholderQr().solve(right);
    const MatrixX error = B * coefficients - values;
    std::size_t worst = n;
    double worst_error = options.tolerance * greatest_stress, sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vector2 d = error.row(Eigen::Index(i)).transpose();
      const double stress = s.size[i] * std::hypot(d[0], s.p[i][0] * d[1]);
      sum += stress * stress / (greatest_stress * greatest_stress + 1e-300);
      if (!is_taken[i] && stress > worst_error) worst = i, worst_error = stress;
    }
    selection.square_error.push_back(sum);
    if (worst == n || int(centres.size()) == options.max_samples) break;
    is_taken[worst] = true;
    centres.push_back(s.y[worst]);
    strains.push_back(s.strains[worst]);
  }
  selection.samples.constant = coefficients.row(0).transpose();
  selection.samples.strains = std::move(strains);
  Vector2 sum = Vector2::Zero();
  selection.samples.weights.emplace_back(Vector2::Zero());
  for (Eigen::Index k = 1; k < coefficients.rows(); ++k) {
    selection.samples.weights.push_back(coefficients.row(k).transpose());
    sum += selection.samples.weights.back();
  }
  selection.samples.weights[0] = -sum;
  return selection;
}

}  // namespace

SampledMaterial sample_material(const std::vector<MaterialSample>& samples, const BasisOptions& options) {
  if (samples.empty()) throw std::invalid_argument("a sampled material needs samples");
  const int count = int(samples[0].p.size());
  double metric_nu = 0.0;
  for (const MaterialSample& sample : samples)
    for (const LambdaAlpha& p : sample.p) metric_nu += p.alpha / p.lambda / double(count) / double(samples.size());
  const Matrix6 to_metric = metric_root(metric_nu);
  std::vector<Selection> selections{std::size_t(count)};
  tbb::parallel_for(0, count, [&](int e) {
    ElementSamples own;
    for (const MaterialSample& sample : samples) {
      own.strains.emplace_back(sample.strains.row(e).transpose());
      own.y.emplace_back(to_metric * mandel(own.strains.back()));
      own.size.push_back(own.y.back().norm());
      const LambdaAlpha& p = sample.p[std::size_t(e)];
      own.p.emplace_back(p.lambda, p.alpha / p.lambda);
    }
    selections[std::size_t(e)] = select(own, options);
  });
  SampledMaterial material;
  std::vector<StrainSamples> elements;
  for (std::size_t size = 0; size < std::size_t(options.max_samples); ++size) {
    double sum = 0.0;
    for (const Selection& s : selections) sum += s.square_error[std::min(size, s.square_error.size() - 1)];
    material.error_by_size.push_back(std::sqrt(sum / double(count) / double(samples.size())));
  }
  for (Selection& s : selections) {
    material.mean_samples += double(s.samples.strains.size()) / double(count);
    elements.push_back(std::move(s.samples));
  }
  material.law = std::make_shared<SampledLaw>(std::move(elements), metric_nu);
  return material;
}

}  // namespace pliant
