#include "estimation/start_objective.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "estimation/judgement.hpp"
#include "estimation/recordings.hpp"
#include "estimation/specimens.hpp"

namespace pliant {

namespace {

StartObjective of_static_tests(const std::vector<RecordedCapture>& recordings, const FitOptions& options) {
  std::vector<const Capture*> captures;
  for (const RecordedCapture& r : recordings) captures.push_back(&r.capture);
  const std::vector<TestedSpecimen> specimens = specimens_of(captures, options);
  const PressScene& first = *specimens.front().scene;
  const int controls = first.body->modulus.controls;
  const bool is_neo_hookean = options.material == MaterialKind::NeoHookean;
  const int terms = is_neo_hookean || options.material == MaterialKind::Linear ? 0 : 1;
  const LawLayout layout({controls, terms, 1, false, is_neo_hookean ? ElasticLaw::NeoHookean : ElasticLaw::Corotated},
                         controls > 1 ? modulus_names(*captures.front(), controls) : std::vector<std::string>{});
  const ParameterSet parameters =
      law_parameters(layout, (specimens.front().presses.empty() ? 1.0 : 2.0) * punch_modulus(first, 0.3));
  const double noise = options.marker_noise > 0.0 ? options.marker_noise : first.noise;
  const auto objective = std::make_shared<PressObjective>(specimens, layout, parameters,
                                                          PressTrialOptions{noise, judgement.press_outlier});
  return {{objective, &objective->cost()}, parameters.to_unconstrained(parameters.reference())};
}

}  // namespace

StartObjective start_objective(std::vector<RecordedCapture> recordings, const FitOptions& options,
                               std::shared_ptr<ProcessGroup> processes) {
  if (recordings.empty()) throw InputError({{}, "no recording was given", "one or several", ""});
  if (std::ranges::all_of(recordings, is_of_static_tests, &RecordedCapture::capture))
    return of_static_tests(recordings, options);
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
