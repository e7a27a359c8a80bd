#pragma once

#include <filesystem>
#include <functional>
#include <memory>

#include "elasticity/body_fields.hpp"
#include "model/vtu.hpp"
#include "motion/simulation.hpp"

namespace pliant {

/// Cells of a file for elements of a body.
VtuCell vtu_cell(ElementKind kind);

/// A state as cells with displacement and velocity at its points and all fields of its cells; names and units are
/// those of docs/formats.md, section 2.
/// @param fields  of the body in that state
VtuGrid frame_grid(const Body& body, const State& state, const BodyFields& fields);

/// Writes `trajectory.pvd` and `frames/*.vtu` (`frame_grid`).
/// @param progress  frames done and their total; false stops
/// @param on_frame  called with each frame, its state and its fields
/// Returns the steps taken and why the simulation ended early, if it did.
RolloutSummary write_trajectory(const std::filesystem::path& folder, std::shared_ptr<const Body> body,
                                const SimulationOptions& options, const VectorX& theta,
                                const std::function<bool(int, int)>& progress = {},
                                const std::function<void(int, const State&, const BodyFields&)>& on_frame = {});

}  // namespace pliant
