#include "estimation/press_objective.hpp"

namespace pliant {

namespace {

std::vector<std::unique_ptr<PressTrial>> trials_of(const std::shared_ptr<const PressScene>& scene,
                                                   const std::vector<int>& presses,
                                                   const std::shared_ptr<PressedMaterial>& material,
                                                   const VectorX& reference, const PressTrialOptions& options) {
  std::vector<std::unique_ptr<PressTrial>> trials;
  for (const int press : presses)
    trials.push_back(std::make_unique<PressTrial>(scene, press, material, reference, options));
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

PressObjective::PressObjective(std::shared_ptr<const PressScene> scene, const std::vector<int>& presses,
                               const LawLayout& layout, ParameterSet parameters, const PressTrialOptions& options)
    : material_(std::make_shared<PressedMaterial>(scene->body, layout)),
      objective_(std::vector<std::unique_ptr<Trial>>{}, ParameterSet{}) {
  auto trials = trials_of(scene, presses, material_, parameters.reference(), options);
  trials_ = pointers(trials);
  objective_ = Objective(as_trials(std::move(trials)), std::move(parameters));
}

void PressObjective::set_form(std::shared_ptr<const Body> body, const LawLayout& layout, ParameterSet parameters) {
  material_->set_form(std::move(body), layout);
  objective_.set_parameters(std::move(parameters));
}

void PressObjective::set_options(const PressTrialOptions& options) {
  for (PressTrial* trial : trials_) trial->set_options(options);
}

std::vector<double> PressObjective::residuals() const {
  std::vector<double> all;
  for (const PressTrial* trial : trials_) {
    const Points& r = trial->residuals();
    all.insert(all.end(), r.data(), r.data() + r.size());
  }
  return all;
}

}  // namespace pliant
