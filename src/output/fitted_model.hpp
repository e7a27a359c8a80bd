#pragma once

#include "elasticity/element_moduli.hpp"
#include "estimation/fit.hpp"
#include "model/model.hpp"

namespace pliant {

/// Covariance of ln E of the first recording's control moduli; zero where one is not estimated, empty where nothing is
/// known.
MatrixX log_modulus_covariance(const FitOutcome& outcome);

/// Young's modulus over the object of the first recording, with deviations.
ModulusStatistics modulus_statistics(const FitOutcome& outcome);

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

}  // namespace pliant
