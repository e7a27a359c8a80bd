#include "estimation/start_objective.hpp"

#include "base/error.hpp"
#include "estimation/judgement.hpp"
#include "estimation/press_fit.hpp"
#include "estimation/recordings.hpp"

namespace pliant {

namespace {

StartObjective of_static_tests(const Capture& capture, const FitOptions& options) {
  std::vector<Vector3> control_points;
  const auto body =
      make_body_of(capture.scene, SignedDistance(), resolution_of_tests(capture, options), control_points);
  const auto scene = std::make_shared<PressScene>(make_press_scene(capture, body));
  std::vector<int> fitted;
  for (int i = 0; i < int(scene->presses.size()); ++i)
    if (scene->presses[std::size_t(i)].role == "fit") fitted.push_back(i);
  const int controls = body->modulus.controls;
  const bool is_neo_hookean = options.material == MaterialKind::NeoHookean;
  const int terms = is_neo_hookean || options.material == MaterialKind::Linear ? 0 : 1;
  const LawLayout layout({controls, terms, 1, false, is_neo_hookean ? ElasticLaw::NeoHookean : ElasticLaw::Corotated},
                         controls > 1 ? modulus_names(capture, controls) : std::vector<std::string>{});
  const ParameterSet parameters = law_parameters(layout, (fitted.empty() ? 1.0 : 2.0) * punch_modulus(*scene, 0.3));
  const double noise = options.marker_noise > 0.0 ? options.marker_noise : scene->noise;
  const auto objective = std::make_shared<PressObjective>(scene, fitted, layout, parameters,
                                                          PressTrialOptions{noise, judgement.press_outlier});
  return {{objective, &objective->cost()}, parameters.to_unconstrained(parameters.reference())};
}

}  // namespace

StartObjective start_objective(std::vector<RecordedCapture> recordings, const FitOptions& options,
                               std::shared_ptr<ProcessGroup> processes) {
  if (recordings.empty()) throw InputError({{}, "no recording was given", "one or several", ""});
  if (is_of_static_tests(recordings.front().capture)) return of_static_tests(recordings.front().capture, options);
  std::vector<std::string> notes;
  const Recordings all(std::move(recordings), options, notes);
  const Grid grid = all.grid(options.cells, options.steps);
  const ParameterSet& parameters = all.parameters();
  auto objective = std::make_shared<Objective>(
      all.objective(grid, parameters, {options.wide_band, [](const Recording& r) { return r.last_frame; }}, {},
                    std::move(processes)));
  return {std::move(objective), parameters.to_unconstrained(parameters.reference())};
}

}  // namespace pliant
