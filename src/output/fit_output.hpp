#pragma once

#include <filesystem>
#include <functional>

#include "capture/observe.hpp"
#include "elasticity/element_moduli.hpp"
#include "estimation/fit.hpp"
#include "model/model.hpp"
#include "model/result.hpp"

namespace pliant {

/// Facts about a run that a result records beside the estimate.
struct RunFacts {
  std::string version, commit;
  std::string capture_path;  ///< as the user named it
  double wall_seconds = 0.0;
};

/// The estimate as `result.json` tells it.
/// @param recordings  of the fit, in its order
Result make_result(const std::vector<RecordedCapture>& recordings, const FitOutcome& outcome, const RunFacts& facts);

/// The simulation-ready model of an estimate, in the scene of its first recording.
Model make_model(const Capture& capture, const FitOutcome& outcome);

/// The model of a material whose numbers are given, in a capture's scene; its surface and mesh are stress-free.
Model make_model(const Capture& capture, const Discretisation& discretisation, const VectorX& theta,
                 const ModulusStatistics& modulus, double cells);

/// A model's material in a capture's situation, on a grid as fine as the model's. Planes whose friction the capture
/// does not state rub as those of the model do. Throws InputError where the capture has no moving object.
struct CaptureScene {
  Discretisation discretisation;
  ParameterLayout layout;
  VectorX theta;
};
CaptureScene make_scene(const Model& model, const Capture& capture);

/// A capture's planes where a parameter vector has them.
std::vector<Plane> planes_at(const Capture& capture, const MotionBlocks& blocks, const VectorX& theta);

/// Distances of observed points to a simulated surface, frame by frame.
ErrorResult surface_errors(const CostEvaluation& evaluation);

/// Writes the whole output folder of a fit (docs/formats.md, section 2) but for its log.
/// @param result  of `make_result`, with what else is known
void write_fit_output(const std::filesystem::path& folder, const std::vector<RecordedCapture>& recordings,
                      const FitOutcome& outcome, const Result& result, const RunFacts& facts,
                      const std::function<void(const char*, int, int)>& progress = {});

}  // namespace pliant
