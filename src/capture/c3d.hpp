#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"

namespace pliant {

/// What a C3D file says of markers: the trajectories of one motion capture.
struct C3dTrajectories {
  std::vector<std::string> labels;   ///< of each trajectory, without spaces around it; "" where the file has none
  std::vector<Points> frames;        ///< from the file's first frame, a row a trajectory [m]; NaN rows where not seen
  std::optional<double> frame_rate;  ///< [Hz]; nothing where the file states none
};

/// Reads a C3D file (The C3D File Format, user guide at c3d.org): little-endian (Intel) files with integer or
/// floating point samples. Units come from POINT:UNITS, which must be m, cm or mm. A sample is missing where its
/// residual is negative, where a coordinate is not finite, and where all three are zero. Analog data are skipped.
/// Throws InputError for every other file: cut short, another byte order, contradicting counts, no or unknown units.
C3dTrajectories read_c3d(const std::filesystem::path& path);

}  // namespace pliant
