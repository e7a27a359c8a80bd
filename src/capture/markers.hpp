#pragma once

#include <cmath>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"
#include "capture/capture.hpp"

namespace pliant {

/// Markers at one time, in the order of their file.
struct MarkerPositions {
  std::vector<std::string> ids;  ///< each once
  Points positions;              ///< m x 3 [m]
};

/// Markers followed through time, matched by id with where they are at rest.
struct MarkerSet {
  std::vector<std::string> ids;       ///< m, in the order of the file of rest positions
  Points rest;                        ///< m x 3 [m], on or in the object at rest
  std::vector<Points> frames;         ///< by frame of the capture, m x 3 [m]; NaN rows where a marker was not seen
  std::optional<double> frame_rate;   ///< [Hz] as the track's file states it; CSV files state none
  std::vector<std::string> left_out;  ///< labels of a C3D file's other trajectories

  int marker_count() const { return int(ids.size()); }
  /// Whether a marker was seen in a frame; both count from 0.
  bool is_seen(int frame, int marker) const { return !std::isnan(frames[std::size_t(frame)](marker, 0)); }
};

/// Reads a CSV file with the header `id,x,y,z` (docs/formats.md). Ids are text: "7" and "07" are two markers.
/// Throws InputError with every problem: a wrong header, a number that is not finite, an id that appears twice.
MarkerPositions read_marker_positions(const std::filesystem::path& path);

/// Reads the markers of a [[press]] or [[load]], both `id,x,y,z`: a set of one frame, the markers under load.
/// Throws InputError with every problem of both files, also for ids that are not among those at rest.
MarkerSet read_marker_pair(const std::filesystem::path& rest, const std::filesystem::path& under_load);

/// Reads the standard deviations of markers' coordinates [m], CSV with the header `id,sx,sy,sz`, in the order of `ids`
/// (m x 3); NaN rows where the file has none.
/// Throws InputError with every problem: what the CSV's reader finds, ids that are unknown or appear twice, numbers
/// that are not positive.
Points read_marker_deviations(const std::filesystem::path& path, std::span<const std::string> ids);

/// Reads the markers of a [[markers]] block. The track is CSV with the header `frame,id,x,y,z`, or C3D by the path's
/// ending: its first frame is frame 0 of the capture, its labels are the ids; each marker at rest must have one
/// trajectory there, and trajectories that no marker at rest names are left out.
/// @param frame_count  of the capture; the track may end earlier, not later
/// Throws InputError with every problem of both files: what the readers of the two formats find, ids that are unknown,
/// appear twice in a frame or have no trajectory, frames beyond the last.
MarkerSet read_markers(const MarkerTrack& files, int frame_count);

/// What of a track may be no motion: markers that trade places from one frame to the next, and such that jump by more
/// than a twentieth of all markers' extent, and a dozen times what they mostly move, where the others do not. A
/// sentence each, the first few.
/// @param begins_at_rest  the first frame shows the object about where `rest` has it; else traded names are told from
/// the
///                        second on
std::vector<std::string> marker_doubts(const MarkerSet& markers, bool begins_at_rest);

/// Standard deviation of a coordinate [m] that a track shows by itself, frame by frame: of third differences in time,
/// which leave little of a smooth motion, the median over all. Nothing where fewer than a dozen of them were seen.
std::optional<double> track_noise(const MarkerSet& markers);

/// Writes the same CSV formats; whole or not at all. Positions keep nine digits; rows of NaN are not written.
/// Throws std::invalid_argument for an id that is empty or has a comma, a quote or a line's end in it.
void write_marker_positions(const std::filesystem::path& path, const MarkerPositions& markers);
void write_marker_track(const std::filesystem::path& path, std::span<const std::string> ids,
                        std::span<const Points> frames);

}  // namespace pliant
