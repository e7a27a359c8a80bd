#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "base/error.hpp"
#include "geometry/camera.hpp"

namespace pliant {

/// Reads where a camera was at each frame: CSV with the header `frame,x,y,z,qx,qy,qz,qw`, the position [m] and the
/// rotation from the camera's axes to the world's as a quaternion, of any length but zero.
/// @param every  frames 0, every, 2 every, ... must have a row each; others may
/// @return       a pose for each frame; of a frame without an image that of the image before
/// Throws InputError with every problem: a wrong header, numbers that are not finite, a quaternion of zero, frames that
/// appear twice, are beyond the last, or are missing.
std::vector<RigidMotion> read_camera_poses(const std::filesystem::path& path, int frame_count, int every);

/// Writes the same format, a row for each pose; whole or not at all. Throws InputError where it cannot be written.
void write_camera_poses(const std::filesystem::path& path, std::span<const RigidMotion> poses);

}  // namespace pliant
