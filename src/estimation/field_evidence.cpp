#include "estimation/field_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/dense.hpp"
#include "estimation/bounded_step.hpp"

namespace pliant {

MatrixX field_precision(const std::vector<Vector3>& points, double length, double deviation) {
  const auto n = Eigen::Index(points.size());
  if (n < 2) return MatrixX::Zero(n, n);
  const auto distance = [&](Eigen::Index i, Eigen::Index j) {
    return (points[std::size_t(i)] - points[std::size_t(j)]).norm();
  };
  MatrixX covariance(n - 1, n - 1);  // of ln E less that at the first point
  for (Eigen::Index i = 1; i < n; ++i)
    for (Eigen::Index j = 1; j < n; ++j)
      covariance(i - 1, j - 1) =
          0.5 * deviation * deviation / length * (distance(i, 0) + distance(j, 0) - distance(i, j));
  MatrixX ratios(n - 1, n);
  ratios << VectorX::Constant(n - 1, -1.0), MatrixX::Identity(n - 1, n - 1);
  return ratios.transpose() * solve_symmetric(covariance, ratios);
}

namespace {

/// What a field can have that a coarser one cannot: rows over the unconstrained estimate, and their prior covariance.
struct Contrasts {
  MatrixX rows, prior;
};
std::optional<Contrasts> contrasts_beyond(const ParameterSet& parameters, Eigen::Index dimension,
                                          const MatrixX& carried) {
  const std::vector<Eigen::Index> moduli = parameters.joint_coordinates();
  if (Eigen::Index(moduli.size()) != carried.rows() || carried.rows() <= carried.cols()) return std::nullopt;
  const MatrixX own = orthogonal_complement(carried);
  MatrixX rows = MatrixX::Zero(own.rows(), dimension);
  rows(Eigen::all, moduli) = own;
  const MatrixX covariance = pseudo_inverse(parameters.joint_precision());  // of contrasts
  return Contrasts{std::move(rows), own * covariance * own.transpose()};
}

/// ln N(d; 0, V + prior) - ln N(d; 0, V).
double log_ratio_of_normals(const VectorX& d, const MatrixX& V, const MatrixX& prior) {
  const MatrixX both = V + prior;
  return 0.5 *
         (d.dot(solve_symmetric(V, d)) - d.dot(solve_symmetric(both, d)) + log_determinant(V) - log_determinant(both));
}

}  // namespace

double log_bayes_factor(const CostEvaluation& evaluation, const ParameterSet& parameters, const VectorX& p,
                        const MatrixX& carried) {
  const std::optional<Contrasts> contrasts = contrasts_beyond(parameters, p.size(), carried);
  return contrasts ? log_bayes_factor(evaluation, parameters, p, contrasts->rows, contrasts->prior) : 0.0;
}

double log_bayes_factor(const CostEvaluation& evaluation, const ParameterSet& parameters, const VectorX& p,
                        const MatrixX& contrasts, const MatrixX& prior) {
  // The field's prior belongs to the hypotheses, not to the estimate; a trace of it stays for where nothing is seen.
  constexpr double trace = 1e-4;
  MatrixX H = evaluation.gauss_newton;
  VectorX g = evaluation.gradient;
  if (const MatrixX& precision = parameters.joint_precision(); precision.size() > 0) {
    const std::vector<Eigen::Index> rows = parameters.joint_coordinates();
    H(rows, rows) -= (1.0 - trace) * precision;
    g(rows) -= (1.0 - trace) * precision * p(rows);
  }
  // What a bound holds cannot make up for what a field would change; what only lies on one may leave it with the field.
  auto [step, held] = step_within_bounds(parameters, p, g, H);
  const VectorX d = contrasts * (p + step);
  const double fall = -step.dot(g + 0.5 * H * step);
  std::erase_if(held, [&](Eigen::Index i) { return !contrasts.col(i).isZero(0.0); });
  for (const Eigen::Index i : held) {
    H.row(i).setZero(), H.col(i).setZero();
    H(i, i) = 1.0;
  }
  const VectorX scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();  // pulls and dampings differ by 1e10
  MatrixX inverse = scale.asDiagonal() *
                    solve_symmetric(MatrixX(scale.asDiagonal() * H * scale.asDiagonal()),
                                    MatrixX(MatrixX::Identity(H.rows(), H.cols()))) *
                    scale.asDiagonal();
  for (const Eigen::Index i : held) inverse(i, i) = 0.0;
  const MatrixX by_gradient = contrasts * inverse;

  const double explained = 0.5 * evaluation.independent_observations();         // the cost of residuals that are noise
  const double left = std::max(evaluation.cost - fall, 0.0) / evaluation.cost;  // after the step
  const double noise = std::max(1.0, left * evaluation.cost / explained);
  VectorX mean = VectorX::Zero(g.size());
  for (const FrameFit& frame : evaluation.frames) mean += frame.gradient / double(evaluation.frames.size());
  const MatrixX V = noise * by_gradient * contrasts.transpose() +
                    left * by_gradient * gradient_scatter(evaluation, mean) * by_gradient.transpose();
  return log_ratio_of_normals(d, V, prior);
}

double log_bayes_factor(const Uncertainty& uncertainty, const ParameterSet& parameters, const VectorX& p,
                        const MatrixX& carried) {
  const std::optional<Contrasts> contrasts = contrasts_beyond(parameters, p.size(), carried);
  if (!contrasts) return 0.0;
  const MatrixX by_interval =
      contrasts->rows *
      (uncertainty.high.array() / (normal_90 * uncertainty.std.array().max(1e-300))).matrix().asDiagonal();
  return log_ratio_of_normals(contrasts->rows * p, by_interval * uncertainty.covariance * by_interval.transpose(),
                              contrasts->prior);
}

MatrixX gradient_scatter(const CostEvaluation& evaluation, const VectorX& mean) {
  const auto& frames = evaluation.frames;
  const int count = int(frames.size());
  const int lags = std::min(count - 1, int(std::ceil(std::sqrt(double(count)))));
  const Eigen::Index n = evaluation.gauss_newton.rows();
  const VectorX centre = mean.size() > 0 ? mean : VectorX::Zero(n);
  MatrixX scatter = MatrixX::Zero(n, n);
  for (int lag = 0; lag <= lags; ++lag) {
    const double weight = lag == 0 ? 1.0 : 1.0 - double(lag) / (lags + 1);
    for (int f = lag; f < count; ++f) {
      const MatrixX outer = (frames[f].gradient - centre) * (frames[f - lag].gradient - centre).transpose();
      scatter += weight * (lag == 0 ? outer : MatrixX(outer + outer.transpose()));
    }
  }
  return scatter;
}

}  // namespace pliant
