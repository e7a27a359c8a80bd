#pragma once

#include "estimation/press_fit.hpp"
#include "output/fit_output.hpp"

namespace pliant {

/// A fit of presses as the files tell it.
Result make_result(const Capture& capture, const PressFitOutcome& outcome, const RunFacts& facts);
Model make_model(const Capture& capture, const PressFitOutcome& outcome);

/// How a material predicts a capture's presses, in their order.
std::vector<StaticError> press_errors(const PressScene& scene, const std::vector<PressPrediction>& predictions);
/// A model's own mesh and material under a capture's presses. Throws InputError for a model of hexahedra.
std::vector<StaticError> predict_presses(const Model& model, const Capture& capture);
/// A model's own mesh and material under a capture's force-depth curves, grips and stress-strain curves. Throws
/// InputError for a model of hexahedra that is to be indented or gripped.
std::vector<CurvePrediction> predict_curves(const Model& model, const Capture& capture);
/// "press 3 (test): 1.2 mm rms, 6.1 % of the greatest displacement".
std::string press_sentence(const StaticError& press);

/// Writes the output folder of a fit of presses: result.json, the model, convergence.csv, presses.csv, presses.pvd with
/// a deformed mesh for each press, and report.html.
void write_press_output(const std::filesystem::path& folder, const Capture& capture, const PressFitOutcome& outcome,
                        const Result& result, const RunFacts& facts,
                        const std::function<void(const char*, int, int)>& progress = {});

}  // namespace pliant
