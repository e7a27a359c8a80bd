#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"

namespace pliant {

/// Reads x, y, z [m] from PLY (text, binary) or PCD (ascii, binary), by the path's ending; other columns are ignored.
/// Points that a sensor marks as missing (not finite, as in organised PCD files) are left out.
/// Throws InputError where the file is cut short, malformed, or has no finite point.
std::vector<Vector3> read_points(const std::filesystem::path& path);

/// Reads the header alone, enough to know that the file is a point cloud, and returns its number of points.
/// Throws InputError where it is not.
std::size_t read_point_count(const std::filesystem::path& path);

/// Writes points [m] as binary PLY in single precision; whole or not at all.
void write_points(const std::filesystem::path& path, std::span<const Vector3> points);

}  // namespace pliant
