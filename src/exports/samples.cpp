#include "exports/samples.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "base/error.hpp"

namespace pliant {

namespace {

constexpr std::array names = {"youngs_modulus", "poissons_ratio", "mass_damping", "stiffness_damping"};
constexpr double least_ratio = -1.0, greatest_ratio = 0.5;  // Poisson's

/// To where a parameter has no bounds, and back.
double unbounded(std::size_t k, double value) {
  return k == 1 ? std::log((value - least_ratio) / (greatest_ratio - value)) : std::log(value);
}
double bounded(std::size_t k, double x) {
  return k == 1 ? least_ratio + (greatest_ratio - least_ratio) / (1.0 + std::exp(-x)) : std::exp(x);
}

/// A value and its interval, for a normal number.
struct Quantiles {
  double value = 0.0, low = 0.0, high = 0.0;
  bool varies = false;

  double at(std::size_t k, double z) const {
    constexpr double of_90_percent = 1.6449;
    if (!varies) return value;
    const double end = unbounded(k, z < 0.0 ? low : high), middle = unbounded(k, value);
    return bounded(k, middle + std::abs(z) / of_90_percent * (end - middle));
  }
};

Quantiles quantiles_of(const Result& result, std::size_t k) {
  const ParameterResult* p = result.find(names[k]);
  Quantiles q;
  if (!p || !std::holds_alternative<double>(p->value)) return q;
  q.value = std::get<double>(p->value);
  if (!p->estimated || !p->interval_90) return q;
  std::tie(q.low, q.high) = *p->interval_90;
  const double tiny = 1e-6 * q.high;  // of a damping whose interval begins at nothing
  if (k >= 2) q.low = std::max(q.low, tiny), q.value = std::max(q.value, tiny);
  q.varies = q.low < q.value && q.value < q.high && (k != 1 || (q.low > least_ratio && q.high < greatest_ratio));
  return q;
}

/// Of the numbers that are drawn, by name.
MatrixX correlations_of(const Result& result) {
  const auto n = Eigen::Index(names.size());
  MatrixX correlations = MatrixX::Identity(n, n);
  const auto number = [](const std::string& name) { return std::ranges::find(names, name) - names.begin(); };
  for (const CorrelationResult& c : result.identifiability) {
    const auto a = number(c.parameters.first), b = number(c.parameters.second);
    if (a < n && b < n) correlations(a, b) = correlations(b, a) = c.correlation;
  }
  return correlations;
}

}  // namespace

std::vector<DrawnMaterial> posterior_samples(const Result& result, int count, unsigned seed) {
  std::array<Quantiles, names.size()> quantiles;
  for (std::size_t k = 0; k < names.size(); ++k) quantiles[k] = quantiles_of(result, k);
  if (!quantiles[0].varies)
    throw InputError({{},
                      "the result states no interval of Young's modulus",
                      "a fit that came to its end and estimated it",
                      "go on with `pliant fit ... --resume`"});
  // Rounded correlations may make a matrix that is not quite one of correlations.
  const MatrixX correlations = 0.999 * correlations_of(result) + 0.001 * MatrixX::Identity(4, 4);
  const Eigen::LLT<MatrixX> factor(correlations);
  if (factor.info() != Eigen::Success)
    throw InputError({{}, "the result's correlations contradict each other", "those that `pliant fit` wrote", ""});
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<DrawnMaterial> samples;
  for (int i = 0; i < count; ++i) {
    VectorX z(correlations.rows());
    for (double& value : z) value = normal(random);
    z = (factor.matrixL() * z).eval();
    const auto at = [&](std::size_t k) { return quantiles[k].at(k, z[Eigen::Index(k)]); };
    samples.push_back({at(0), at(1), at(2), at(3)});
  }
  return samples;
}

Model with_material(Model model, const DrawnMaterial& sample) {
  const double ratio = sample.youngs_modulus / model.youngs_modulus;
  model.youngs_modulus = sample.youngs_modulus;
  for (double& modulus : model.volume.youngs_modulus) modulus *= ratio;
  model.poissons_ratio = sample.poissons_ratio;
  std::ranges::fill(model.volume.poissons_ratio, sample.poissons_ratio);
  model.mass_damping = sample.mass_damping, model.stiffness_damping = sample.stiffness_damping;
  return model;
}

}  // namespace pliant
