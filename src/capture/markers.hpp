#pragma once

#include <filesystem>
#include <map>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"

namespace pliant {

/// Positions [m] by marker id.
using MarkerPositions = std::map<int, Vector3>;

/// Reads a CSV file with the header `id,x,y,z`.
/// Throws InputError with the line for a wrong header, a number that is not finite, or an id that appears twice.
MarkerPositions read_markers(const std::filesystem::path& path);

/// Reads a CSV file with the header `frame,id,x,y,z`: positions by frame; rows may be missing.
std::map<int, MarkerPositions> read_marker_track(const std::filesystem::path& path);

/// Writes the same formats; whole or not at all.
void write_markers(const std::filesystem::path& path, const MarkerPositions& markers);
void write_marker_track(const std::filesystem::path& path, const std::map<int, MarkerPositions>& track);

}  // namespace pliant
