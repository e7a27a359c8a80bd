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

/// The model of a material whose numbers are given, in a capture's scene; its surface and mesh are free of load.
Model make_model(const Capture& capture, const Discretisation& discretisation, const VectorX& theta,
                 const ModulusStatistics& modulus, double cells);

/// Body, scene and parameters that a model describes.
struct ModelScene {
  std::shared_ptr<const SignedDistance> distance;
  std::shared_ptr<const Body> body;
  SimulationOptions simulation;
  VectorX theta;
};
ModelScene make_scene(const Model& model);
/// The body of a model of tetrahedra, with each element's modulus.
std::shared_ptr<const Body> model_body(const Model& model);

/// A model's material in a capture's situation, on a grid as fine as the model's.
/// Throws InputError where the capture has no moving object.
struct CaptureScene {
  Discretisation discretisation;
  ParameterLayout layout;
  VectorX theta;
};
CaptureScene make_scene(const Model& model, const Capture& capture);

/// A state as cells with displacement, velocity, strain and stress (at the elements' middles, turned into the world).
/// @param elasticity  of the body, with its parameters set; it is left linearised about the state
VtuGrid frame_grid(const Body& body, const State& state, Elasticity& elasticity);

/// A capture's planes where a parameter vector has them.
std::vector<Plane> planes_at(const Capture& capture, const MotionBlocks& blocks, const VectorX& theta);

/// Writes `trajectory.pvd` and `frames/*.vtu`: displacement, velocity, strain and stress of each frame.
/// @param progress  frames done and their total; false stops
/// Returns the steps taken and why the simulation ended early, if it did.
RolloutSummary write_trajectory(const std::filesystem::path& folder, std::shared_ptr<const Body> body,
                                const SimulationOptions& options, const VectorX& theta,
                                const std::function<bool(int, int)>& progress = {});

/// Distances of observed points to a simulated surface, frame by frame.
struct SurfaceErrors {
  ErrorResult error;
  struct Frame {
    int frame = 0;
    double rms = 0.0, noise = 0.0;  ///< [m]
    int points = 0;
  };
  std::vector<Frame> frames;
};
SurfaceErrors surface_errors(const CostEvaluation& evaluation);

/// Writes the whole output folder of a fit (docs/formats.md, section 2) but for its log.
/// @param result  of `make_result`, with what else is known
void write_fit_output(const std::filesystem::path& folder, const std::vector<RecordedCapture>& recordings,
                      const FitOutcome& outcome, const Result& result, const RunFacts& facts,
                      const std::function<void(const char*, int, int)>& progress = {});

}  // namespace pliant
