#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "model/model.hpp"
#include "model/result.hpp"
#include "motion/simulation.hpp"
#include "situation/situation.hpp"

namespace pliant {

/// What a simulated situation leaves behind.
struct SituationFiles {
  std::filesystem::path folder;
  bool ply = false;                                 ///< `surface/*.ply`: the surface in every frame
  bool pictures = false;                            ///< `pictures/*.png`: every frame drawn
  std::filesystem::path video;                      ///< the pictures as a video, made by ffmpeg; empty: none
  int width = 1280, height = 720;                   ///< of a picture [pixels], even
  double azimuth_deg = 34.0, elevation_deg = 20.0;  ///< from where it is seen [degrees]
};

/// What was simulated and written.
struct WrittenMotion {
  RolloutSummary summary;
  std::optional<DeformationResult> strained;  ///< of the object itself, in all its frames
};

/// Simulates a model in its own situation and writes `trajectory.pvd` with `frames/*.vtu` and `fields.html`
/// (docs/formats.md, section 5).
/// @param progress  frames done and their total; false stops
/// The summary says why it ended early, if it did. Throws InputError where files cannot be written.
WrittenMotion write_simulation(const Model& model, const std::filesystem::path& folder,
                               const std::function<bool(int done, int total)>& progress = {});

/// Simulates a model in a situation and writes `trajectory.pvd` with `frames/*.vtu`, `fields.html`, the surfaces of all
/// frames in `surface.trajectory` (docs/formats.md), and what else is asked for; copies of the object in folders
/// `copy_1`, ...
/// @param progress  what is done, how much of it and the whole; false stops
/// The summary says why it ended early, if it did. Throws InputError where files cannot be written, or where there
/// shall be a video and no ffmpeg is installed: before anything is simulated.
WrittenMotion write_situation(const Model& model, const Situation& situation, const SituationFiles& files,
                              const std::function<bool(const char* what, int done, int total)>& progress = {});

}  // namespace pliant
