#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "live/live_data.hpp"
#include "simulation/model_simulation.hpp"

namespace pliant {

/// What was recorded, for a page: frames of a motion, or presses.
struct LiveRecording {
  std::vector<double> times;                   ///< of frames [s], the first being the start
  std::vector<LiveTest> presses;               ///< of an object that is pressed, in the place of `times`
  std::vector<std::vector<Vector3>> points;    ///< seen in each frame, or under each press [m]
  std::optional<double> greatest_strain = {};  ///< of the object while it was recorded [-], but for a hundredth of it
};

/// Everything that a page needs to move or press a model. What is held, at rest and of a material law is pressed:
/// nothing is known of its damping. All else moves.
LiveData live_data(const Model& model);
/// Whether a page knows all that a model meets: no obstacle beside planes, nothing on which it slides.
bool is_known_to_pages(const Model& model);

/// A page in which the object can be pulled, poked and blown at: one file that needs neither server nor network. It
/// holds the simulation as WebAssembly, the object, and what was recorded of it.
/// @param data  of the model, with samples of the posterior where there are any
std::string live_page(const Model& model, LiveData data, const LiveRecording& recording);
/// The same without samples.
std::string live_page(const Model& model, const LiveRecording& recording = {});

}  // namespace pliant
