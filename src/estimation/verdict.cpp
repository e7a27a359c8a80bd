#include "estimation/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/median.hpp"
#include "estimation/judgement.hpp"

namespace pliant {

namespace {

/// Limits of the root mean square residual over the noise.
struct ResidualLimits {
  double overall;
  double for_a_while;  // over a tenth of the frames and three at least
};
constexpr ResidualLimits far_above_noise{judgement.residual, judgement.residual_for_a_while};
constexpr ResidualLimits above_noise{judgement.residual_of_part, judgement.residual_of_part_for_a_while};

/// Root mean square residual over the noise; 0 where there is neither.
double residual_over_noise(const CostEvaluation& evaluation) {
  double squares = 0.0, noise = 0.0;
  for (const FrameFit& f : evaluation.frames) squares += f.sum_squares, noise += f.sum_noise_squares;
  // Followed points have a noise in the cost alone.
  if (!(noise > 0.0)) squares = 2.0 * evaluation.cost, noise = evaluation.independent_observations();
  return noise > 0.0 ? std::sqrt(squares / noise) : 0.0;
}

void look_at_residuals(const CostEvaluation& evaluation, const ResidualLimits& limits, Verdict& verdict) {
  const double ratio = residual_over_noise(evaluation);
  if (ratio == 0.0) return;
  const auto unexplained = [&](std::string reason) {
    verdict.kind = Verdict::Kind::Unexplained;
    verdict.reasons.push_back(std::move(reason));
  };
  if (ratio > limits.overall)
    unexplained(
        fmt::format("The distances between what was seen and the simulated object are {:.1f} times the noise.", ratio));
  const bool sees_surface = std::ranges::any_of(evaluation.frames, [](const FrameFit& f) { return f.points > 0; });
  if (const double matched = evaluation.matched_fraction(); sees_surface && matched < judgement.least_matched)
    unexplained(fmt::format("{:.0f} % of the observed points lie too far from the simulated object to be matched.",
                            100.0 * (1.0 - matched)));
  const std::vector<double> over_time = residuals_over_noise(evaluation);
  const auto worst = std::ranges::max_element(over_time);
  if (verdict.kind == Verdict::Kind::Explained && worst != over_time.end() && *worst > limits.for_a_while)
    unexplained(fmt::format("About frame {} after the start the distances are {:.1f} times the noise.",
                            evaluation.frames[std::size_t(worst - over_time.begin())].frame, *worst));
}

/// Of control points the mean of ln E counts: a field has places that hardly bend, and what is stated there says so.
void look_at_moduli(const Uncertainty& uncertainty, const ParameterSet& parameters, Verdict& verdict) {
  const auto look_at = [&](const std::string& name, double std, double std_model) {
    if (!(std > judgement.poorly_known)) return;
    if (verdict.kind == Verdict::Kind::Explained) verdict.kind = Verdict::Kind::Undetermined;
    verdict.reasons.push_back(
        fmt::format("{} is known to {:.0f} % only{}.", name, 100.0 * std,
                    std_model > judgement.model_share ? ": other models of the same object differ by as much" : ""));
  };
  const std::vector<Eigen::Index> field = parameters.joint_coordinates();
  const std::vector<const Parameter*> of = parameters.coordinate_parameters();
  double std_model = 0.0;
  for (Eigen::Index i = 0; i < Eigen::Index(of.size()); ++i) {
    if (!is_modulus(*of[std::size_t(i)])) continue;
    if (std::ranges::count(field, i) > 0)
      std_model += uncertainty.std_model[i] / double(field.size());
    else
      look_at(of[std::size_t(i)]->name == "youngs_modulus" ? "Young's modulus" : of[std::size_t(i)]->name,
              uncertainty.std[i], uncertainty.std_model[i]);
  }
  if (field.empty()) return;
  const double variance = uncertainty.covariance(field, field).sum();
  look_at("The mean of Young's modulus", std::sqrt(variance) / double(field.size()), std_model);
}

}  // namespace

std::string name_of(Verdict::Kind kind) {
  return kind == Verdict::Kind::Explained     ? "explained"
         : kind == Verdict::Kind::Unexplained ? "unexplained"
                                              : "undetermined";
}

double misfit_of(const CostEvaluation& evaluation) {
  const double ratio = residual_over_noise(evaluation);
  const bool sees_surface = std::ranges::any_of(evaluation.frames, [](const FrameFit& f) { return f.points > 0; });
  return sees_surface ? ratio / std::min(1.0, evaluation.matched_fraction() / judgement.least_matched) : ratio;
}

bool is_explained(const CostEvaluation& evaluation) {
  Verdict verdict;
  if (std::ranges::none_of(evaluation.frames, [](const FrameFit& f) { return f.points > 0; })) return false;
  look_at_residuals(evaluation, above_noise, verdict);
  return verdict.kind == Verdict::Kind::Explained;
}

std::vector<double> residuals_over_noise(const CostEvaluation& evaluation) {
  std::vector<double> ratios;
  for (const FrameFit& f : evaluation.frames) {
    if (f.points == 0 || !(f.sum_noise_squares > 0.0)) return {};
    ratios.push_back(std::sqrt(f.sum_squares / f.sum_noise_squares));
  }
  const int window = std::max(3, int(ratios.size()) / 10);
  if (int(ratios.size()) < window) return ratios;
  std::vector<double> smooth;
  for (int i = 0; i < int(ratios.size()); ++i) {
    const int first = std::clamp(i - window / 2, 0, int(ratios.size()) - window);
    smooth.push_back(median(std::vector(ratios.begin() + first, ratios.begin() + first + window)));
  }
  return smooth;
}

Verdict verdict_of(const CostEvaluation& evaluation, const Uncertainty& uncertainty, const ParameterSet& parameters) {
  Verdict verdict;
  look_at_residuals(evaluation, far_above_noise, verdict);
  if (uncertainty.std.size() == parameters.dimension()) look_at_moduli(uncertainty, parameters, verdict);
  return verdict;
}

Verdict verdict_of(const std::vector<Agreement>& agreements, const Uncertainty& uncertainty,
                   const ParameterSet& parameters) {
  Verdict verdict;
  for (const Agreement& a : agreements) {
    if (!(a.over_noise > judgement.residual && a.relative > judgement.relative_residual)) continue;
    verdict.kind = Verdict::Kind::Unexplained;
    const std::string over_noise =
        std::isfinite(a.over_noise) ? fmt::format(", {:.1f} times the noise", a.over_noise) : "";
    verdict.reasons.push_back(fmt::format("The model misses {} by {:.0f} % of the greatest measured{}.", a.what,
                                          100.0 * a.relative, over_noise));
  }
  if (uncertainty.std.size() == parameters.dimension()) look_at_moduli(uncertainty, parameters, verdict);
  return verdict;
}

}  // namespace pliant
