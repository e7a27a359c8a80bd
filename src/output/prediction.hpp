#pragma once

#include <string>
#include <vector>

#include "capture/markers.hpp"
#include "model/result.hpp"
#include "output/fit_output.hpp"

namespace pliant {

/// Where a simulation has the markers that a capture follows.
struct MarkerPrediction {
  std::vector<std::string> ids;  ///< those of all [[markers]] blocks, one after the other
  std::vector<Points> frames;    ///< by frame of the capture, one row a marker [m]; NaN before start_frame
  RolloutSummary summary;
};

/// Throws InputError where the capture follows no markers, or two blocks share an id.
MarkerPrediction predict_markers(const Capture& capture, const CaptureScene& scene);

/// The equilibrium of a model under gravity and each hung weight of a capture, beside what was seen there: markers,
/// else points of a cloud and of depth images, whose distance is that to the deformed surface. Sliding along the
/// surface does not show in the latter, nor what no sensor saw. One entry a load; where there are no figures it says
/// why. Throws InputError where a file of a load cannot be read.
std::vector<LoadError> predict_loads(const Capture& capture, const CaptureScene& scene);

/// What a prediction takes as a capture has it, though the capture does not know it and a fit would estimate it, for
/// people; empty: nothing.
std::string taken_as_known(const Capture& capture);

/// "load 2 (test): mean 0.61 mm (0.30 % of the object's size), max ..." for people.
std::string load_sentence(const LoadError& error);

}  // namespace pliant
