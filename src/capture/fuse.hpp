#pragma once

#include <filesystem>
#include <functional>

#include "capture/capture.hpp"

namespace pliant {

/// What fusing did.
struct FusedClouds {
  Capture capture;              ///< with one sequence of clouds in the place of depth cameras and clouds
  int every = 1;                ///< frames between clouds: of fewer where some have no point
  std::size_t points = 0;       ///< of all clouds
  double greatest_delay = 0.0;  ///< [s] between a frame and when a sensor took what its cloud has: of moving objects
};

/// Writes what all depth cameras and clouds of a capture saw of the object, cleaned as `observe` does, as one cloud a
/// frame (`clouds/000000.ply`, ...) and a load (`load/000.ply`, ...), and `capture.toml` with the other facts. An image
/// that a camera took later than its frame (`time_offset`) belongs to the frame whose time is nearest,
/// within half a frame.
/// @param progress  called with the number of frames done and their total; may be empty
/// Throws InputError where nothing is seen, a file cannot be read or written, or the scan's pose is unknown.
FusedClouds fuse_clouds(const std::filesystem::path& folder, const Capture& capture,
                        const std::function<void(int, int)>& progress = {});

}  // namespace pliant
