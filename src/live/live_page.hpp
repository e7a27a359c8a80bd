#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "live/live_data.hpp"
#include "simulation/model_simulation.hpp"

namespace pliant {

/// What was recorded, for a page: times of its frames [s], the first being the start, and the points seen in each [m].
struct LiveRecording {
  std::vector<double> times;
  std::vector<std::vector<Vector3>> points;
};

/// Everything that a page needs to move a model.
/// Throws InputError for a model whose law no page knows yet.
LiveData live_data(const Model& model);

/// A page in which the object can be pulled, poked and blown at: one file that needs neither server nor network. It
/// holds the simulation as WebAssembly, the object, and what was recorded of it.
/// @param samples  of the posterior, parameters of `live_blocks`
std::string live_page(const Model& model, const LiveRecording& recording = {},
                      const std::vector<VectorX>& samples = {});

}  // namespace pliant
