#include "estimation/press_sampling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "base/parallel.hpp"
#include "estimation/judgement.hpp"

namespace pliant {

namespace {

/// No marker is followed closer than this share of a press' greatest displacement: the last of a misfit is bought by
/// wild fields.
constexpr double least_share = 5e-4;

double displacement(const ObservedPress& seen, const Points& placed, std::size_t m) {
  const Vector3 now = placed.rows() > 0 ? Vector3(placed.row(Eigen::Index(m)).transpose()) : seen.loaded[m];
  return (now - seen.rest[m]).norm();
}

/// The stresses that lie a share of the way from those of the law before to those of a sample.
void lead_back(MaterialSample& sample, const MaterialLaw& before, double share) {
  const MatrixX stresses = stresses_of(before, sample.strains);
  if (stresses.allFinite()) sample.stresses = stresses + share * (sample.stresses - stresses);
}

}  // namespace

PressSampling::PressSampling(std::shared_ptr<const PressScene> scene, std::vector<int> presses,
                             const BasisOptions& basis, bool is_given, State state)
    : scene_(std::move(scene)),
      presses_(std::move(presses)),
      basis_(basis),
      is_given_(is_given),
      state_(std::move(state)),
      smoothness_(*scene_->body) {
  LocalResiduals local;
  for (const int press : presses_) local.add(scene_->presses[std::size_t(press)]);
  local_ = robust_noise(local.residuals, local.weights, local.displacements, least_noise());
}

double PressSampling::least_noise() const { return 1e-6 * scene_->body->size(); }

std::optional<SampledMaterial> PressSampling::material_of(const std::shared_ptr<const TabulatedLaw>& shared,
                                                          const std::vector<PressSample>& samples) const {
  std::vector<MaterialSample> usable;
  for (const PressSample& s : samples)
    if (s.succeeded) usable.push_back(s.sample);
  if (usable.empty()) return std::nullopt;
  return sample_material(shared, usable, basis_);
}

PressSampling::Pressed PressSampling::pressed(int press, const std::shared_ptr<const MaterialLaw>& law,
                                              double modulus) const {
  Pressed result;
  PressedBody body(*scene_, press, law, modulus);
  result.strains = MatrixX::Zero(scene_->body->element_count(), 6);
  result.succeeded = body.solve().converged;
  if (!result.succeeded) return result;
  body.equilibrium().elasticity().evaluate(body.placement().nodes, false);
  result.strains = body.equilibrium().elasticity().strains();
  result.points = body.points();
  return result;
}

std::vector<PressSampling::Pressed> PressSampling::all_pressed(const std::shared_ptr<const MaterialLaw>& law) const {
  const double modulus = mean_modulus(*scene_->body, *law);
  std::vector<Pressed> all(presses_.size());
  parallel_for(std::size_t(0), all.size(), [&](std::size_t i) { all[i] = pressed(presses_[i], law, modulus); });
  return all;
}

/// What the round is about, with its presses and their noise.
std::shared_ptr<const MaterialLaw> PressSampling::before(const std::shared_ptr<const TabulatedLaw>& law) {
  if (before_) return before_;
  before_ = law;
  if (const std::optional<SampledMaterial> last = material(law)) before_ = last->law;
  placed_ = all_pressed(before_);
  noise_ = own_noise(placed_);
  return before_;
}

MarkerNoise PressSampling::own_noise(const std::vector<Pressed>& presses) const {
  std::vector<double> residuals, weights, displacements;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (!presses[i].succeeded) continue;
    const ObservedPress& seen = scene_->presses[std::size_t(presses_[i])];
    for (std::size_t m = 0; m < seen.rest.size(); ++m) {
      const double moved = displacement(seen, presses[i].points, m);
      for (Eigen::Index d = 0; d < 3; ++d) {
        residuals.push_back(presses[i].points(Eigen::Index(m), d) - seen.loaded[m][d]);
        weights.push_back(seen.weight(3 * m + std::size_t(d)));
        displacements.push_back(moved);
      }
    }
  }
  return robust_noise(residuals, weights, displacements, least_noise());
}

double PressSampling::cost_of(const std::vector<Pressed>& presses, const MarkerNoise& noise) const {
  constexpr double c = judgement.press_outlier;
  double cost = 0.0;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    if (!presses[i].succeeded) return std::numeric_limits<double>::infinity();
    const ObservedPress& seen = scene_->presses[std::size_t(presses_[i])];
    const double least = least_share * seen.greatest_displacement;
    for (std::size_t m = 0; m < seen.rest.size(); ++m) {
      const double moved = displacement(seen, {}, m);
      for (Eigen::Index d = 0; d < 3; ++d) {
        const double deviation = std::max(least, noise.deviation(seen.weight(3 * m + std::size_t(d)), moved));
        const double r = (presses[i].points(Eigen::Index(m), d) - seen.loaded[m][d]) / deviation;
        cost += c * c * (std::sqrt(1.0 + r * r / (c * c)) - 1.0);
      }
    }
  }
  return cost;
}

std::vector<PressSample> PressSampling::sample(std::size_t count, const std::shared_ptr<const TabulatedLaw>& law,
                                               const MarkerNoise& noise, int iterations) {
  const std::shared_ptr<const MaterialLaw> about = before(law);
  const std::size_t begin = state_.under.size(), end = std::min(begin + count, presses_.size());
  std::vector<PressSample> part(end - begin);
  parallel_for(begin, end, [&](std::size_t i) {
    const ObservedPress& seen = scene_->presses[std::size_t(presses_[i])];
    SampleFitOptions options;
    options.max_iterations = iterations;
    options.is_scale_known = is_given_;
    options.deviations.resize(3 * Eigen::Index(seen.rest.size()));
    for (Eigen::Index k = 0; k < options.deviations.size(); ++k) {
      const double moved = displacement(seen, placed_[i].points, std::size_t(k / 3)),
                   weight = seen.weight(std::size_t(k));
      double& deviation = options.deviations[k];
      deviation = noise.deviation(weight, moved);
      // The misfit of a law is no noise: what markers show by themselves is, or a better law's misfit, where that is
      // less.
      if (!is_given_)
        deviation = std::max(least_share * seen.greatest_displacement,
                             std::min({deviation, local_.deviation(weight, moved), noise_.deviation(weight, moved)}));
    }
    part[i - begin] = fit_sample(*scene_, presses_[i], about, placed_[i].strains, smoothness_, options);
  });
  state_.under.insert(state_.under.end(), part.begin(), part.end());
  return part;
}

PressSampling::Round PressSampling::conclude(const std::shared_ptr<const TabulatedLaw>& law, const MarkerNoise& noise) {
  const std::shared_ptr<const MaterialLaw> about = before(law);
  Round round;
  round.cost_before = round.cost = cost_of(placed_, noise);
  for (const double share : {1.0, 0.5, 0.25}) {
    std::vector<PressSample> led = state_.under;
    for (std::size_t i = 0; i < led.size() && share < 1.0; ++i)
      if (led[i].succeeded) lead_back(led[i].sample, *about, share);
    const std::optional<SampledMaterial> material = material_of(law, led);
    if (!material) break;
    const double cost = cost_of(all_pressed(material->law), noise);
    if (!(cost < round.cost_before)) continue;
    round.is_kept = true, round.cost = cost;
    state_.kept = std::move(led);
    break;
  }
  state_.under.clear();
  before_.reset();
  return round;
}

}  // namespace pliant
