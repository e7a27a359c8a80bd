#include "estimation/uncertainty.hpp"

#include <algorithm>
#include <cmath>

#include "base/dense.hpp"
#include "estimation/alternative.hpp"
#include "estimation/field_evidence.hpp"
#include "estimation/judgement.hpp"

namespace pliant {

namespace {

/// Its deviations by name and whether the object meets obstacles: of ln E, nu, and of the dampings' unconstrained
/// numbers, a share of their values, or of what is usual where they are less than that.
struct Unmodelled {
  const char* name;
  double meeting_obstacles, free, tested;
};
constexpr Unmodelled unmodelled[] = {
    {"youngs_modulus", judgement.floor_youngs_modulus, judgement.free_floor_youngs_modulus,
     judgement.test_floor_youngs_modulus},
    {"poissons_ratio", judgement.floor_poissons_ratio, judgement.free_floor_poissons_ratio,
     judgement.test_floor_poissons_ratio},
    {"mass_damping", judgement.floor_mass_damping, judgement.free_floor_mass_damping, 0.0},
    {"stiffness_damping", judgement.floor_stiffness_damping, judgement.free_floor_stiffness_damping, 0.0}};

}  // namespace

MatrixX noise_covariance(const CostEvaluation& evaluation) {
  const MatrixX& H = evaluation.gauss_newton;
  const Eigen::Index n = H.rows();
  const MatrixX inverse = solve_symmetric(H, MatrixX(MatrixX::Identity(n, n)));
  MatrixX sandwich = inverse * gradient_scatter(evaluation) * inverse;
  // Fewer frames than parameters, or gradients that cancel by chance, must not make the estimate look sure.
  for (Eigen::Index i = 0; i < n; ++i) sandwich(i, i) = std::max(sandwich(i, i), 0.0);
  return sandwich + inverse;
}

FrameGroups frame_groups(const CostEvaluation& evaluation, int recordings) {
  constexpr int parts = int(judgement.parts_of_motion.value), fewest = 2;  // frames of each
  FrameGroups groups;
  groups.of.assign(evaluation.frames.size(), -1);
  groups.cause = recordings < 3 ? "what parts of the motion differ by" : "what the recordings differ by";
  for (int r = 0; r < recordings; ++r) {
    std::vector<std::size_t> own;
    for (std::size_t i = 0; i < evaluation.frames.size(); ++i)
      if (evaluation.frames[i].recording == r) own.push_back(i);
    const int of_this = recordings < 3 ? parts : 1;
    if (recordings < 3 && int(own.size()) < parts * fewest) continue;
    for (std::size_t k = 0; k < own.size(); ++k)
      groups.of[own[k]] = groups.count + int(k * std::size_t(of_this) / own.size());
    groups.count += of_this;
  }
  return groups;
}

std::optional<MatrixX> covariance_between(const CostEvaluation& evaluation, const FrameGroups& groups) {
  constexpr double shared = 1e-6;  // of a coordinate's curvature, in the other groups: else it is one's own
  if (groups.count < 3) return std::nullopt;
  const MatrixX& H = evaluation.gauss_newton;
  const Eigen::Index n = H.rows();
  MatrixX without = MatrixX::Zero(n, groups.count);  // the estimates of all but one, from that of all
  for (int r = 0; r < groups.count; ++r) {
    MatrixX others = H;
    VectorX pull = VectorX::Zero(n);
    for (std::size_t i = 0; i < evaluation.frames.size(); ++i)
      if (groups.of[i] == r) others -= evaluation.frames[i].gauss_newton, pull += evaluation.frames[i].gradient;
    std::vector<Eigen::Index> kept;
    for (Eigen::Index i = 0; i < n; ++i)
      if (others(i, i) > shared * H(i, i)) kept.push_back(i);
    if (kept.empty()) continue;
    const VectorX scale = others.diagonal()(kept).cwiseSqrt().cwiseInverse();
    const MatrixX scaled = scale.asDiagonal() * others(kept, kept) * scale.asDiagonal();
    // Farther than a few steps lead the linear model says nothing: the other parts may hardly know a number.
    without.col(r)(kept) = scale.cwiseProduct(solve_symmetric(scaled, VectorX(scale.cwiseProduct(pull(kept)))))
                               .cwiseMax(-largest_shift)
                               .cwiseMin(largest_shift);
  }
  const MatrixX about_mean = without.colwise() - without.rowwise().mean();
  return MatrixX((groups.count - 1.0) / groups.count * about_mean * about_mean.transpose());
}

double t_quantile_90(double v) {
  constexpr double two = 2.9199856, three = 2.3533634;  // degrees of freedom, below which the expansion is not used
  if (v < 3.0) return three + (two - three) * (1.0 / v - 1.0 / 3.0) / (1.0 / 2.0 - 1.0 / 3.0);
  const double z = normal_90, z3 = z * z * z, z5 = z3 * z * z;
  return z + (z3 + z) / (4.0 * v) + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * v * v) +
         (3.0 * z5 * z * z + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * v * v * v);
}

Uncertainty uncertainty_of(const CostEvaluation& evaluation, const std::vector<ModelShift>& shifts,
                           const VectorX& floor, int recordings) {
  const Eigen::Index n = evaluation.gauss_newton.rows();
  Uncertainty u;
  u.covariance = noise_covariance(evaluation);
  VectorX of_noise = u.covariance.diagonal().cwiseMax(0.0), of_groups = VectorX::Zero(n);  // variances
  const FrameGroups groups = frame_groups(evaluation, recordings);
  if (const std::optional<MatrixX> between = covariance_between(evaluation, groups)) {
    const VectorX of_curvature =
        solve_symmetric(evaluation.gauss_newton, MatrixX(MatrixX::Identity(n, n))).diagonal().cwiseMax(0.0);
    for (Eigen::Index i = 0; i < n; ++i) {
      // Frames of one group err together: what noise they seemed to have beyond their sensor's is counted here.
      if ((*between)(i, i) <= of_noise[i]) continue;
      u.covariance(i, i) = (*between)(i, i);
      of_noise[i] = of_curvature[i];
      of_groups[i] = (*between)(i, i) - of_curvature[i];
    }
  }
  u.std_noise = of_noise.cwiseSqrt();
  u.budget.push_back({"noise", u.std_noise});
  VectorX of_models = VectorX::Zero(n);  // variances
  const double freedom_of_noise = std::max(3.0, double(evaluation.frames.size()) / 4.0);
  VectorX weighed = u.std_noise.array().pow(4) / freedom_of_noise;  // Welch and Satterthwaite's denominators
  const auto add = [&](const std::string& cause, const VectorX& variance, double freedom) {
    of_models += variance;
    weighed.array() += variance.array().square() / freedom;
    auto share = std::ranges::find(u.budget, cause, &UncertaintyShare::cause);
    if (share == u.budget.end()) share = u.budget.insert(u.budget.end(), {cause, VectorX::Zero(n)});
    share->std = (share->std.array().square() + variance.array()).sqrt();
  };
  for (const ModelShift& s : shifts) {
    u.covariance += s.shift * s.shift.transpose();
    add(s.cause, s.shift.cwiseAbs2(), judgement.freedom_of_alternative);
  }
  if (floor.size() > 0) {
    u.covariance.diagonal() += floor.cwiseAbs2();
    add("law and damping", floor.cwiseAbs2(), judgement.freedom_of_floor);
  }
  if (n > 0 && of_groups.maxCoeff() > 0.0) add(groups.cause, of_groups, groups.count - 1.0);
  u.std_model = of_models.cwiseSqrt();
  u.std = u.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  u.low.resize(n), u.high.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double freedom = weighed[i] > 0.0 ? std::pow(u.std[i], 4) / weighed[i] : 1e3;
    u.high[i] = t_quantile_90(std::max(2.0, freedom)) * u.std[i];
    u.low[i] = -u.high[i];
  }
  return u;
}

VectorX unmodelled_std(const ParameterSet& parameters, const VectorX& theta, MeasuredAs object) {
  VectorX floor = VectorX::Zero(parameters.dimension());
  const std::vector<const Parameter*> of = parameters.coordinate_parameters();
  for (std::size_t i = 0; i < of.size(); ++i) {
    const std::string base = of[i]->name.substr(0, of[i]->name.find('@'));
    for (const Unmodelled& u : unmodelled)
      if (base == u.name || base.starts_with(std::string(u.name) + "_"))
        floor[Eigen::Index(i)] = object == MeasuredAs::MeetingObstacles ? u.meeting_obstacles
                                 : object == MeasuredAs::Free           ? u.free
                                                                        : u.tested;
    if (of[i]->transform != Transform::LogitHalf) continue;
    const double nu = theta[of[i]->at];  // whose logit ln(2 nu / (1 - 2 nu)) has the derivative 1 / (nu (1 - 2 nu))
    floor[Eigen::Index(i)] /= std::max(1e-3, nu * (1.0 - 2.0 * nu));
  }
  return floor;
}

VectorX gauss_newton_shift(const CostEvaluation& evaluation, double most) {
  const VectorX scale = evaluation.gauss_newton.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixX H = scale.asDiagonal() * evaluation.gauss_newton * scale.asDiagonal();
  const VectorX g = scale.cwiseProduct(evaluation.gradient);
  return (-scale.cwiseProduct(solve_symmetric(H, g))).cwiseMax(-most).cwiseMin(most);
}

MatrixX shifts_of_given(const MatrixX& gauss_newton, const std::vector<Eigen::Index>& estimated,
                        const std::vector<Eigen::Index>& given) {
  const MatrixX H = gauss_newton(estimated, estimated), across = gauss_newton(estimated, given);
  const VectorX scale = H.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixX scaled = scale.asDiagonal() * H * scale.asDiagonal();
  MatrixX shifts = -(scale.asDiagonal() * solve_symmetric(scaled, MatrixX(scale.asDiagonal() * across)));
  for (Eigen::Index k = 0; k < shifts.cols(); ++k) {
    const Eigen::Index g = given[std::size_t(k)];
    const double left = gauss_newton(g, g) + across.col(k).dot(shifts.col(k));
    shifts.col(k) *= left > 0.0 ? 1.0 / std::sqrt(left) : 0.0;
  }
  return shifts;
}

}  // namespace pliant
