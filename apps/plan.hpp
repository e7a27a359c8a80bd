#pragma once

#include <filesystem>

namespace pliant::apps {

/// Says what a recording would tell before it is made: records a scene (docs/scene.md) synthetically, fits that from
/// the assumed values, and prints the 90 % intervals that the fit states, with what contributes most to each.
/// @param out  folder for the synthetic recording and `plan.json`; empty: nothing is kept
/// Throws InputError where the scene or its recording is of no use, Interrupted.
void plan(const std::filesystem::path& scene, const std::filesystem::path& out);

}  // namespace pliant::apps
