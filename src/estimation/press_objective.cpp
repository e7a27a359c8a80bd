#include "estimation/press_objective.hpp"

#include <cmath>

#include "estimation/grip_trial.hpp"
#include "estimation/indentation_trial.hpp"

namespace pliant {

namespace {

std::vector<std::unique_ptr<PressTrial>> trials_of(const std::shared_ptr<const PressScene>& scene,
                                                   const std::vector<int>& presses,
                                                   const std::shared_ptr<PressedMaterial>& material,
                                                   const VectorX& reference, const PressTrialOptions& options,
                                                   const PressObjective::Placements& begin) {
  std::vector<std::unique_ptr<PressTrial>> trials;
  for (std::size_t i = 0; i < presses.size(); ++i) {
    const Placement* from = i < begin.size() && begin[i] ? &*begin[i] : nullptr;
    trials.push_back(std::make_unique<PressTrial>(scene, presses[i], material, reference, options, 0, from));
  }
  return trials;
}

std::vector<PressTrial*> pointers(const std::vector<std::unique_ptr<PressTrial>>& trials) {
  std::vector<PressTrial*> all;
  for (const auto& trial : trials) all.push_back(trial.get());
  return all;
}

std::vector<std::unique_ptr<Trial>> as_trials(std::vector<std::unique_ptr<PressTrial>> presses) {
  std::vector<std::unique_ptr<Trial>> trials;
  for (auto& press : presses) trials.push_back(std::move(press));
  return trials;
}

}  // namespace

std::vector<std::unique_ptr<Trial>> static_test_trials(const std::shared_ptr<const PressScene>& scene,
                                                       const std::shared_ptr<PressedMaterial>& material,
                                                       const ParameterSet& parameters, int recording) {
  constexpr double unused = 1.0;  // every point of a capture's curve states its standard deviation
  const StaticTests& tests = scene->static_tests();
  const VectorX& reference = parameters.reference();
  std::vector<std::unique_ptr<Trial>> trials;
  for (int i = 0; i < int(tests.indentations.size()); ++i)
    if (tests.indentations[std::size_t(i)].role == "fit")
      trials.push_back(std::make_unique<IndentationTrial>(scene, i, material, reference, recording));
  for (int i = 0; i < int(tests.grips.size()); ++i)
    if (tests.grips[std::size_t(i)].role == "fit")
      trials.push_back(std::make_unique<GripTrial>(scene, i, material, reference, recording));
  for (int i = 0; i < int(tests.curves.size()); ++i) {
    if (tests.curves[std::size_t(i)].role != "fit") continue;
    auto trial =
        std::make_unique<CurveTrial>(tests.curves[std::size_t(i)].test, i, material->layout(), unused, parameters);
    trial->set_recording(recording);
    trials.push_back(std::move(trial));
  }
  return trials;
}

PressObjective::PressObjective(const std::shared_ptr<const PressScene>& scene, const std::vector<int>& presses,
                               const LawLayout& layout, ParameterSet parameters, const PressTrialOptions& options,
                               const Placements& begin)
    : material_(std::make_shared<PressedMaterial>(scene->body, layout)),
      objective_(std::vector<std::unique_ptr<Trial>>{}, ParameterSet{}) {
  auto trials = trials_of(scene, presses, material_, parameters.reference(), options, begin);
  trials_ = pointers(trials);
  std::vector<std::unique_ptr<Trial>> all = as_trials(std::move(trials));
  for (std::unique_ptr<Trial>& test : static_test_trials(scene, material_, parameters, 0)) {
    if (auto* curve = dynamic_cast<CurveTrial*>(test.get())) curves_.push_back(curve);
    all.push_back(std::move(test));
  }
  objective_ = Objective(std::move(all), std::move(parameters));
}

void PressObjective::set_form(std::shared_ptr<const Body> body, const LawLayout& layout, ParameterSet parameters) {
  material_->set_form(std::move(body), layout);
  for (CurveTrial* curve : curves_) curve->set_layout(layout, parameters);
  objective_.set_parameters(std::move(parameters));
}

void PressObjective::set_options(const PressTrialOptions& options) {
  for (PressTrial* trial : trials_) trial->set_options(options);
}

PressObjective::Placements PressObjective::placements() const {
  Placements all;
  for (const PressTrial* trial : trials_) all.push_back(trial->placement());
  return all;
}

std::vector<double> PressObjective::residuals() const {
  std::vector<double> all;
  for (const PressTrial* trial : trials_) {
    const Points& r = trial->residuals();
    all.insert(all.end(), r.data(), r.data() + r.size());
  }
  return all;
}

MarkerNoise PressObjective::own_noise(double least) const {
  const std::vector<double> all = residuals();
  std::vector<double> weights, displacements;
  for (const PressTrial* trial : trials_) {
    for (std::size_t k = 0; k < 3 * trial->seen().rest.size(); ++k) weights.push_back(trial->seen().weight(k));
    for (const double moved : trial->displacements()) displacements.insert(displacements.end(), 3, moved);
  }
  return robust_noise(all, weights, displacements, least);
}

double PressObjective::typical_deviation() const {
  double logs = 0.0, count = 0.0;
  for (const PressTrial* trial : trials_) {
    logs += trial->deviations().array().log().sum();
    count += double(trial->deviations().size());
  }
  return count > 0.0 ? std::exp(logs / count) : 0.0;
}

double PressObjective::weighed_squares() const {
  const double typical = typical_deviation();
  double sum = 0.0;
  for (const PressTrial* trial : trials_)
    sum += (trial->residuals().array() * typical / trial->deviations().array()).square().sum();
  return sum;
}

}  // namespace pliant
