#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "model/vtu.hpp"
#include "motion/simulation.hpp"

namespace pliant {

/// Cells of a file for elements of a body.
VtuCell vtu_cell(ElementKind kind);

/// A state as cells with displacement, velocity, strain and stress (at the elements' middles, turned into the world).
/// @param elasticity  of the body, with its parameters set; it is left linearised about the state
VtuGrid frame_grid(const Body& body, const State& state, Elasticity& elasticity);

/// Writes `trajectory.pvd` and `frames/*.vtu`: displacement, velocity, strain and stress of each frame.
/// @param progress  frames done and their total; false stops
/// @param on_frame  called with each frame and its state
/// Returns the steps taken and why the simulation ended early, if it did.
RolloutSummary write_trajectory(const std::filesystem::path& folder, std::shared_ptr<const Body> body,
                                const SimulationOptions& options, const VectorX& theta,
                                const std::function<bool(int, int)>& progress = {},
                                const std::function<void(int, const State&)>& on_frame = {});

}  // namespace pliant
