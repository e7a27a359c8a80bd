#include "elasticity/sampled_law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "base/dense.hpp"
#include "base/parallel.hpp"
#include "elasticity/polar.hpp"

namespace pliant {

namespace {

using Vector2 = Eigen::Vector2d;
using Columns6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;

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

/// Stress of `SampledLaw`, dW/de in Mandel's components, at a strain m.
/// @param by_lambda, by_nu  6 x (1 + centres): its derivatives by what is added to lambda (nu): constant, then weights
Strain6 path_stress(const StrainSamples& s, const std::vector<Strain6>& centres, const Matrix6& L, const Strain6& m,
                    Columns6& by_lambda, Columns6& by_nu) {
  const auto count = Eigen::Index(centres.size());
  by_lambda.setZero(6, 1 + count);
  by_nu.setZero(6, 1 + count);
  const Strain6 y = L * m;
  const double square = m.squaredNorm(), trace = m.head<3>().sum(), slope = trace * trace - 2.0 * square;
  Strain6 ones = Strain6::Zero();
  ones.head<3>().setOnes();
  Strain6 stress = Strain6::Zero();
  VectorX kernel(1 + count);
  Columns6 along(6, 1 + count);  // t L d kernel / dy
  kernel[0] = 1.0;
  along.col(0).setZero();
  for (const GaussPoint& g : path) {
    Vector2 value = s.constant;
    Strain6 m_lambda = Strain6::Zero(), m_nu = Strain6::Zero();
    for (Eigen::Index i = 0; i < count; ++i) {
      const Strain6 d = g.t * y - centres[std::size_t(i)];
      kernel[i + 1] = std::sqrt(d.squaredNorm() + tip * tip);
      const Strain6 back = L * d;
      along.col(i + 1) = g.t / kernel[i + 1] * back;
      const Vector2& w = s.weights[std::size_t(i)];
      value += w * kernel[i + 1];
      m_lambda += w[0] * along.col(i + 1);
      m_nu += w[1] * along.col(i + 1);
    }
    const Bounded lambda = bounded_lambda(s, value[0]), nu = bounded_nu(s, value[1]);
    const double weight = g.weight * g.t, of_lambda = (1.0 - 2.0 * nu.value) * square + nu.value * trace * trace;
    const Strain6 linear = 2.0 * ((1.0 - 2.0 * nu.value) * m + nu.value * trace * ones),
                  turning = 2.0 * (trace * ones - 2.0 * m);
    stress +=
        weight * (lambda.value * linear + of_lambda * lambda.first * m_lambda + lambda.value * slope * nu.first * m_nu);
    by_lambda +=
        weight *
        ((lambda.first * linear + of_lambda * lambda.second * m_lambda + lambda.first * slope * nu.first * m_nu) *
             kernel.transpose() +
         of_lambda * lambda.first * along);
    by_nu += weight * ((lambda.value * nu.first * turning + slope * nu.first * lambda.first * m_lambda +
                        lambda.value * slope * nu.second * m_nu) *
                           kernel.transpose() +
                       lambda.value * slope * nu.first * along);
  }
  return stress;
}

/// Weights with which the energy's own stress comes closest to the samples', by Levenberg-Marquardt from those that
/// interpolate p: where stiffness depends on the direction of strains, the energy's stress is not E(p(e)) e.
class StressFit {
 public:
  StressFit(const ElementSamples& samples, const Matrix6& to_metric, double ridge, double greatest_stress,
            StrainSamples& law)
      : samples_(samples), L_(to_metric), ridge_(ridge), unit_(greatest_stress), law_(law) {
    for (const Strain6& strain : law.strains) centres_.push_back(L_ * mandel(strain));
    for (std::size_t i = 0; i < samples.strains.size(); ++i) {
      const Strain6 m = mandel(samples.strains[i]);
      Strain6 stress = samples.p[i][0] * (1.0 - 2.0 * samples.p[i][1]) * m;
      stress.head<3>().array() += samples.p[i][0] * samples.p[i][1] * m.head<3>().sum();
      strains_.push_back(m);
      stresses_.push_back(stress);
    }
    start_ = interpolated_at_rest();
  }

  /// Returns the sum of the squares of stresses' errors that are left, relative to the greatest stress of a sample.
  double run() {
    VectorX residuals;
    MatrixX J;
    double cost = linearise(residuals, J), damping = 1e-3;
    for (int iteration = 0; iteration < 10; ++iteration) {
      MatrixX H = J.transpose() * J;
      H.diagonal() *= 1.0 + damping;
      const VectorX step = -solve_symmetric(H, VectorX(J.transpose() * residuals));
      const StrainSamples before = law_;
      add(step);
      VectorX next_residuals;
      MatrixX next_J;
      const double next = linearise(next_residuals, next_J);
      if (next < cost) {
        const bool is_done = cost - next < 1e-3 * cost;
        cost = next, residuals = std::move(next_residuals), J = std::move(next_J);
        damping *= 0.2;
        if (is_done) break;
      } else {
        law_ = before;
        damping = 10.0 * std::max(damping, 1e-3);
      }
    }
    double greatest = 0.0;
    for (const Strain6& stress : stresses_) greatest = std::max(greatest, stress.squaredNorm());
    return residuals.head(6 * Eigen::Index(strains_.size())).squaredNorm() * unit_ * unit_ / greatest;
  }

 private:
  Vector2 interpolated_at_rest() const {
    Vector2 p = law_.constant;
    for (std::size_t i = 0; i < centres_.size(); ++i)
      p += law_.weights[i] * std::sqrt(centres_[i].squaredNorm() + tip * tip);
    return p;
  }
  /// lambda's constant and weights but the first, then nu's times the stiffness at rest; weights sum to nothing.
  void add(const VectorX& step) {
    const Eigen::Index half = step.size() / 2;
    for (const int k : {0, 1}) {
      const double unit = k == 0 ? 1.0 : 1.0 / start_[0];
      law_.constant[k] += unit * step[k * half];
      for (Eigen::Index i = 1; i < half; ++i) {
        law_.weights[std::size_t(i)][k] += unit * step[k * half + i];
        law_.weights[0][k] -= unit * step[k * half + i];
      }
    }
  }
  /// Columns of constant and weights as `add` changes them.
  template <class Columns>
  static MatrixX tied(const Columns& of) {
    MatrixX columns(of.rows(), of.cols() - 1);
    columns.col(0) = of.col(0);
    columns.rightCols(columns.cols() - 1) = of.rightCols(of.cols() - 2).colwise() - of.col(1);
    return columns;
  }
  double linearise(VectorX& residuals, MatrixX& J) const {
    const auto count = Eigen::Index(strains_.size()), half = Eigen::Index(centres_.size());
    residuals.setZero(6 * count + 2 + 2 * half);
    J.setZero(residuals.size(), 2 * half);
    Columns6 by_lambda, by_nu;
    for (Eigen::Index i = 0; i < count; ++i) {
      const auto k = std::size_t(i);
      residuals.segment<6>(6 * i) =
          (path_stress(law_, centres_, L_, strains_[k], by_lambda, by_nu) - stresses_[k]) / unit_;
      J.block(6 * i, 0, 6, half) = tied(by_lambda) / unit_;
      J.block(6 * i, half, 6, half) = tied(by_nu) / (unit_ * start_[0]);
    }
    // At rest as the smallest strains say; and small weights where samples nearly coincide.
    const Vector2 off = interpolated_at_rest() - start_;
    MatrixX kernel(1, 1 + half);
    kernel(0, 0) = 1.0;
    for (Eigen::Index i = 0; i < half; ++i)
      kernel(0, 1 + i) = std::sqrt(centres_[std::size_t(i)].squaredNorm() + tip * tip);
    const double at_rest = 0.3 * largest() / unit_;
    residuals[6 * count] = at_rest * off[0], residuals[6 * count + 1] = at_rest * start_[0] * off[1];
    J.block(6 * count, 0, 1, half) = at_rest * tied(kernel);
    J.block(6 * count + 1, half, 1, half) = at_rest * tied(kernel);
    for (Eigen::Index i = 1; i < half; ++i)
      for (const int k : {0, 1}) {
        const Eigen::Index row = 6 * count + 2 + k * half + i;
        residuals[row] = ridge_ / unit_ * law_.weights[std::size_t(i)][k] * (k == 0 ? 1.0 : start_[0]);
        J(row, k * half + i) = ridge_ / unit_;
      }
    return residuals.squaredNorm();
  }
  double largest() const { return std::max(*std::ranges::max_element(samples_.size), 1e-12); }

  const ElementSamples& samples_;
  const Matrix6& L_;
  double ridge_, unit_;
  StrainSamples& law_;
  std::vector<Strain6> centres_, strains_, stresses_;
  Vector2 start_;
};

struct Selection {
  StrainSamples samples;
  double square_misfit = 0.0;        // of the energy's stress, summed over the element's samples
  std::vector<double> square_error;  // summed over the element's samples, with 1, 2, ... in the basis
};

Selection select(const ElementSamples& s, const Matrix6& to_metric, const BasisOptions& options) {
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
  constexpr double ridge = 0.02;
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
    for (Eigen::Index k = 1; k < m; ++k) system(B.rows() + k, k) = ridge * largest * largest;
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
  if (greatest_stress > 0.0)
    selection.square_misfit =
        StressFit(s, to_metric, ridge * largest * largest, greatest_stress, selection.samples).run();
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
  parallel_for(0, count, [&](int e) {
    ElementSamples own;
    for (const MaterialSample& sample : samples) {
      own.strains.emplace_back(sample.strains.row(e).transpose());
      own.y.emplace_back(to_metric * mandel(own.strains.back()));
      own.size.push_back(own.y.back().norm());
      const LambdaAlpha& p = sample.p[std::size_t(e)];
      own.p.emplace_back(p.lambda, p.alpha / p.lambda);
    }
    selections[std::size_t(e)] = select(own, to_metric, options);
  });
  SampledMaterial material;
  std::vector<StrainSamples> elements;
  for (std::size_t size = 0; size < std::size_t(options.max_samples); ++size) {
    double sum = 0.0;
    for (const Selection& s : selections) sum += s.square_error[std::min(size, s.square_error.size() - 1)];
    material.error_by_size.push_back(std::sqrt(sum / double(count) / double(samples.size())));
  }
  double misfit = 0.0;
  for (Selection& s : selections) {
    misfit += s.square_misfit;
    material.mean_samples += double(s.samples.strains.size()) / double(count);
    elements.push_back(std::move(s.samples));
  }
  material.stress_misfit = std::sqrt(misfit / double(count) / double(samples.size()));
  material.law = std::make_shared<SampledLaw>(std::move(elements), metric_nu);
  return material;
}

}  // namespace pliant
