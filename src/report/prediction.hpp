#pragma once

#include <string>
#include <vector>

#include "capture/markers.hpp"
#include "model/result.hpp"
#include "report/fit_output.hpp"

namespace pliant {

/// Where a simulation has the markers that a capture follows.
struct MarkerPrediction {
  std::vector<std::string> ids;  ///< those of all [[markers]] blocks, one after the other
  std::vector<Points> frames;    ///< by frame of the capture, one row a marker [m]; NaN before start_frame
  RolloutSummary summary;
};

/// Throws InputError where the capture follows no markers, or two blocks share an id.
MarkerPrediction predict_markers(const Capture& capture, const CaptureScene& scene);

/// The equilibrium of a model under gravity and each hung weight of a capture, beside the markers seen there. Loads
/// without markers are left out. Where no equilibrium is found, the figures are left out.
std::vector<StaticError> predict_loads(const Capture& capture, const CaptureScene& scene);

}  // namespace pliant
