#pragma once

#include <filesystem>
#include <functional>

#include "capture/capture.hpp"
#include "capture/observe.hpp"
#include "tracking/tracker.hpp"

namespace pliant {

/// A track's motion as states: velocities are differences to the frame before.
std::vector<State> states_of(const Track& track);

/// Where points of the scan [m] were in each frame of the recording, frame_count x (n x 3); NaN where nothing was
/// tracked.
std::vector<Points> follow(const Track& track, const std::vector<Vector3>& rest, int frame_count);

/// The figures of a track as JSON, format "track/1" (docs/formats.md).
std::string to_json(const Track& track, const Capture& capture);

/// Writes a track's folder: `trajectory.pvd` with `frames/*.vtu` (displacement, velocity, strain and stress with the
/// material of theta), `track.json`, `track.csv`, a picture of each frame's points over the surface in `pictures/`, and
/// `track.html`.
/// @param with_pictures  false: figures and motion alone
/// @param progress       may be empty
void write_track(const std::filesystem::path& folder, const Capture& capture,
                 const std::vector<ObservedFrame>& observed, const Track& track, const MotionBlocks& blocks,
                 const VectorX& theta, bool with_pictures = true,
                 const std::function<void(const char*, int, int)>& progress = {});

}  // namespace pliant
