#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "capture/markers.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "output/fit_output.hpp"
#include "output/prediction.hpp"
#include "output/press_output.hpp"
#include "scan/scan_pose.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

struct Arguments {
  std::string model, capture, out, markers;
};

using Observations = std::shared_ptr<std::vector<FrameObservations>>;

/// Compares the motion with what was seen. False where it cannot be simulated.
bool evaluate_frames(const Capture& capture, const CaptureScene& scene, const Observations& seen, Evaluation& result) {
  ObjectiveOptions objective_options;
  objective_options.outlier_scale = 0.05 * object_size(capture.scene);
  objective_options.last_frame =
      scene.discretisation.simulation.times.empty() ? 0 : int(scene.discretisation.simulation.times.size()) - 1;
  Objective objective(scene.discretisation.mismatch, scene.discretisation.body, scene.discretisation.simulation, seen,
                      ParameterSet(scene.layout, {}, scene.theta), objective_options);
  const CostEvaluation evaluation = objective.evaluate(VectorX(0));
  if (!evaluation.succeeded) {
    std::cerr << "pliant: the simulation stopped: " << evaluation.failure << "\n";
    return false;
  }
  result.error = surface_errors(evaluation);
  return true;
}

int run(const Arguments& arguments) {
  const Model model = load_model(arguments.model);
  const std::optional<DeformationResult> recorded = recorded_strain_range(arguments.model);
  Capture capture = read_capture(arguments.capture);
  ObserveOptions options;
  options.max_points_per_frame = 1000;
  const auto observed =
      observe_placed(capture, options, [](int done, int total) { show_progress("read", done, total); });
  stop_if_interrupted();
  const auto seen =
      std::make_shared<std::vector<FrameObservations>>(frame_observations(capture, observed, tracked_points(capture)));
  Evaluation result;
  bool converged = true;
  if (!capture.presses.empty()) {
    result.presses = predict_presses(model, capture);
    for (const StaticError& press : result.presses) {
      std::cerr << press_sentence(press) << "\n";
      converged = converged && press.marker_rms;
    }
  }
  if (has_static_tests(capture)) result.curves = predict_curves(model, capture);
  std::optional<DeformationResult> strained;
  for (const CurvePrediction& curve : result.curves) {
    std::cerr << curve_sentence(curve) << "\n";
    converged = converged && curve.failure.empty();
    strained = wider(strained, curve.strained);
  }
  if (seen->empty() && capture.loads.empty() && capture.presses.empty() && !has_static_tests(capture))
    throw InputError({{capture.file}, "no frame shows any point of the object", "depth images, clouds or markers", ""});
  const bool has_frames = !seen->empty(), has_loads = !capture.loads.empty();
  std::optional<CaptureScene> scene;
  if (has_frames || has_loads || !arguments.markers.empty()) scene = make_scene(model, capture);
  if (const std::string guesses = taken_as_known(capture); has_frames && !guesses.empty())
    std::cerr << "pliant: " << guesses << "\n";
  if (has_frames && !evaluate_frames(capture, *scene, seen, result)) {
    converged = false;
    if (!has_loads && result.presses.empty() && result.curves.empty()) return NotConverged;
  }
  if (has_loads) result.loads = predict_loads(capture, *scene);
  for (const LoadError& load : result.loads) {
    std::cerr << load_sentence(load) << "\n";
    converged = converged && load.failure.empty();
  }
  std::cout << to_json(result) << "\n";
  if (!arguments.out.empty()) write_evaluation(arguments.out, result);
  if (!arguments.markers.empty()) {
    const MarkerPrediction prediction = predict_markers(capture, *scene);
    write_marker_track(arguments.markers, prediction.ids, prediction.frames);
  }
  say_if_extrapolated(recorded, strained);
  return converged ? Fine : NotConverged;
}

}  // namespace

void add_evaluate(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("evaluate", "Predict another recording with a fitted model, and say how well");
  command.option("model", arguments->model, "model.toml of a fit").required().type_name("MODEL");
  command.option("capture", arguments->capture, "recording of the same object").required().type_name("CAPTURE");
  command.option("-o,--out", arguments->out, "file for the figures (JSON)").type_name("FILE");
  command.option("--markers", arguments->markers, "file for the predicted tracks of the capture's markers (CSV)")
      .type_name("FILE");
  command.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace pliant::apps
