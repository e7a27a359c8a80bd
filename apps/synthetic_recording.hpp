#pragma once

#include <filesystem>

#include "synthesis/synthetic_scene.hpp"

namespace pliant::apps {

/// Simulates a scene and writes a recording of it, with its truth, into a folder.
/// Throws std::runtime_error where it cannot be simulated, InputError where a file cannot be written, Interrupted.
void write_recording(const std::filesystem::path& folder, const SyntheticScene& scene);

}  // namespace pliant::apps
