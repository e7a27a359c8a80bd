#include "estimation/press_objective.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimation/grip_trial.hpp"
#include "estimation/indentation_trial.hpp"

namespace pliant {

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

namespace {

/// Residuals of one kind of measurement.
struct Residuals {
  double squares = 0.0, over_noise_squares = 0.0, count = 0.0, greatest = 0.0;

  void add(double square, double noise, double coordinates, double measured) {
    squares += square, count += coordinates;
    over_noise_squares += noise > 0.0 ? square / (noise * noise) : std::numeric_limits<double>::infinity();
    greatest = std::max(greatest, std::abs(measured));
  }
  /// @param of_each  numbers of a measurement whose size is told: three of a marker's displacement
  void conclude(const std::string& what, double of_each, std::vector<Agreement>& agreements) const {
    if (count > 0.0 && greatest > 0.0)
      agreements.push_back(
          {what, std::sqrt(over_noise_squares / count), std::sqrt(of_each * squares / count) / greatest});
  }
};

double own_scatter(const std::vector<TestedSpecimen>& specimens) {
  double squares = 0.0, count = 0.0;
  for (const TestedSpecimen& specimen : specimens)
    for (const int i : specimen.presses)
      squares += std::pow(marker_noise(specimen.scene->presses[std::size_t(i)]), 2), count += 1.0;
  return count > 0.0 ? std::sqrt(squares / count) : 0.0;
}

/// Goes through the frames of a specimen's curves and grips.
void add_tests(const StaticTests& tests, std::vector<FrameFit>::const_iterator& frame, Residuals& gripped,
               Residuals& forces, std::vector<Agreement>& agreements) {
  for (const ObservedIndentation& test : tests.indentations) {
    if (!is_fitted(test.role)) continue;
    Residuals curve;
    for (std::size_t d = 0; d < test.curve.depths.size(); ++d, ++frame)
      curve.add(2.0 * frame->cost * std::pow(test.curve.stds[d], 2), test.curve.stds[d], 1.0, test.curve.forces[d]);
    curve.conclude("the force of " + test.name, 1.0, agreements);
  }
  for (const ObservedGrip& test : tests.grips) {
    if (!is_fitted(test.role)) continue;
    const double numbers = test.seen.trace(), own = frame->track_sum_squares;
    if (frame->tracks > 0) gripped.add(own, test.markers_std, numbers * frame->tracks, test.displacement.norm());
    const double of_markers = frame->tracks > 0 ? own / (test.markers_std * test.markers_std) : 0.0;
    if (test.has_force)
      forces.add((2.0 * frame->cost - of_markers) * test.force_std * test.force_std, test.force_std, 1.0, test.force);
    ++frame;
  }
  for (const ObservedCurve& curve : tests.curves) {
    if (!is_fitted(curve.role)) continue;
    const double over_noise = std::sqrt(2.0 * frame->cost / double(curve.test.stress.size()));
    double squares = 0.0;
    for (const double s : curve.test.std) squares += s * s;
    const double std = std::sqrt(squares / double(curve.test.std.size()));
    agreements.push_back(
        {"the stress of " + curve.test.name, over_noise, over_noise * std / curve.test.greatest_stress()});
    ++frame;
  }
}

}  // namespace

std::vector<Agreement> agreements_of(const std::vector<TestedSpecimen>& specimens, const CostEvaluation& evaluation,
                                     double marker_noise) {
  std::vector<Agreement> agreements;
  if (!evaluation.succeeded) return agreements;
  auto frame = evaluation.frames.begin();  // in the order of the objective's trials
  Residuals pressed, gripped, forces;
  const double noise = marker_noise > 0.0 ? marker_noise : own_scatter(specimens);
  for (const TestedSpecimen& specimen : specimens)
    for (const int i : specimen.presses) {
      // Each over its own greatest: a light press tells of the material as a heavy one does.
      const double own = specimen.scene->presses[std::size_t(i)].greatest_displacement;
      if (own > 0.0) pressed.add(frame->track_sum_squares / (own * own), noise / own, 3.0 * frame->tracks, 1.0);
      ++frame;
    }
  pressed.conclude("the markers under presses", 3.0, agreements);
  for (const TestedSpecimen& specimen : specimens)
    add_tests(specimen.scene->static_tests(), frame, gripped, forces, agreements);
  gripped.conclude("the markers between grips", 3.0, agreements);
  forces.conclude("the forces of grips", 1.0, agreements);
  return agreements;
}

PressObjective::PressObjective(const std::vector<TestedSpecimen>& specimens, const LawLayout& layout,
                               ParameterSet parameters, const PressTrialOptions& options, const Placements& begin)
    : objective_(std::vector<std::unique_ptr<Trial>>{}, ParameterSet{}) {
  std::vector<std::unique_ptr<Trial>> all;
  const auto add = [&](std::unique_ptr<Trial> trial) {
    if (auto* curve = dynamic_cast<CurveTrial*>(trial.get())) curves_.push_back(curve);
    if (auto* at_rest = dynamic_cast<EquilibriumTrial*>(trial.get())) {
      if (at_rest_.size() < begin.size()) at_rest->begin_from(begin[at_rest_.size()]);
      at_rest_.push_back(at_rest);
    }
    all.push_back(std::move(trial));
  };
  for (std::size_t s = 0; s < specimens.size(); ++s) {
    const TestedSpecimen& specimen = specimens[s];
    materials_.push_back(std::make_shared<PressedMaterial>(specimen.scene->body, layout));
    for (const int press : specimen.presses) {
      const Placement* from = nullptr;  // noise that grows with displacement goes by it from the first
      if (at_rest_.size() < begin.size() && begin[at_rest_.size()].front().nodes.size() > 0)
        from = &begin[at_rest_.size()].front();
      auto trial = std::make_unique<PressTrial>(specimen.scene, press, materials_.back(), parameters.reference(),
                                                options, int(s), from);
      trials_.push_back(trial.get());
      at_rest_.push_back(trial.get());
      all.push_back(std::move(trial));
    }
  }
  for (std::size_t s = 0; s < specimens.size(); ++s)
    for (std::unique_ptr<Trial>& test : static_test_trials(specimens[s].scene, materials_[s], parameters, int(s)))
      add(std::move(test));
  objective_ = Objective(std::move(all), std::move(parameters));
}

void PressObjective::set_form(std::shared_ptr<const Body> body, const LawLayout& layout, ParameterSet parameters) {
  materials_.front()->set_form(std::move(body), layout);
  for (std::size_t s = 1; s < materials_.size(); ++s) materials_[s]->set_form(materials_[s]->shared_body(), layout);
  for (CurveTrial* curve : curves_) curve->set_layout(layout, parameters);
  objective_.set_parameters(std::move(parameters));
}

void PressObjective::set_options(const PressTrialOptions& options) {
  for (PressTrial* trial : trials_) trial->set_options(options);
}

PressObjective::Placements PressObjective::placements() const {
  Placements all;
  for (const EquilibriumTrial* trial : at_rest_) all.push_back(trial->placements());
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
