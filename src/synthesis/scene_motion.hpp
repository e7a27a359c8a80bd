#pragma once

#include <functional>

#include "synthesis/synthetic_scene.hpp"

namespace pliant {

/// Simulates a scene: its scan where it sags, its frames, and the equilibria of its loads, presses and force-depth
/// curves, all of one body.
/// @param on_progress  called with what is done and its total; false stops. May be empty
/// Throws std::runtime_error where something cannot be simulated, in words, InputError where a grip, a held region or a
/// probe meets nothing of the object.
SceneMotion simulate_scene(const SyntheticScene& scene, const std::function<bool(int, int)>& on_progress = {});

/// The body of a scene, with its field of moduli.
std::shared_ptr<const Body> body_of(const SyntheticScene& scene);

}  // namespace pliant
