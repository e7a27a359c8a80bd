#pragma once

#include <filesystem>
#include <functional>

#include "elasticity/body_fields.hpp"
#include "estimation/fit.hpp"
#include "model/model.hpp"
#include "model/result.hpp"

namespace pliant {

/// The model of a law that was fitted to presses, in their capture's scene.
Model make_model(const Capture& capture, const LawOutcome& outcome);

/// How a material predicts a capture's presses, in their order.
std::vector<StaticError> press_errors(const PressScene& scene, const std::vector<PressPrediction>& predictions);
/// A model's own mesh and material under a capture's presses. Throws InputError for a model of hexahedra.
std::vector<StaticError> predict_presses(const Model& model, const Capture& capture);
/// A model's own mesh and material under a capture's force-depth curves, grips and stress-strain curves. Throws
/// InputError for a model of hexahedra that is to be indented or gripped.
std::vector<CurvePrediction> predict_curves(const Model& model, const Capture& capture);
/// "press 3 (test): 1.2 mm rms, 6.1 % of the greatest displacement".
std::string press_sentence(const StaticError& press);

/// Writes what a fit leaves of its presses: presses.csv, presses.pvd with a deformed mesh for each press, and of a
/// sampled material basis.csv.
/// @param on_press  called with the number of each press that has an equilibrium, from 0, its nodes [m] and its fields
void write_presses(const std::filesystem::path& folder, const LawOutcome& outcome,
                   const std::function<void(const char*, int, int)>& progress = {},
                   const std::function<void(int, const Points&, const BodyFields&)>& on_press = {});

}  // namespace pliant
