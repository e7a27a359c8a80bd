#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "imports/recording.hpp"

namespace pliant {

/// PNG and PGM files of a folder, in the order of the numbers in their names; empty where it has none, or is none.
std::vector<std::filesystem::path> image_files(const std::filesystem::path& folder);

/// A stream of image files, all of the camera's size, with the last number in each name. Throws InputError where there
/// is none.
DepthStream stream_of_files(const PinholeCamera& camera, double depth_scale, std::vector<std::filesystem::path> files,
                            const std::filesystem::path& folder);

/// A line of a text file: cells parted by white space and commas, or by white space and semicolons where it has any,
/// in which a comma stands for the point.
struct NumberRow {
  int line = 0;  ///< from 1
  std::vector<std::string> cells;
};
NumberRow row_of(std::string_view text, int line = 0);

/// Lines of a text file but those that begin with #.
/// @param heading  becomes the last of those before the first row, where there is one
std::vector<NumberRow> read_rows(const std::filesystem::path& file, std::string* heading = nullptr);

/// Cell `i` of a row as a finite number. Throws InputError that names the line.
double number_at(const NumberRow& row, std::size_t i, const std::filesystem::path& file, const char* what);

/// A pose that moved along: nearest rotation between two poses by spherical interpolation, and the shift between them.
/// @param times  [s] of `poses`, growing; as many, one at least
/// @return       the pose at `time`; the first or last one outside
RigidMotion pose_at(const std::vector<double>& times, const std::vector<RigidMotion>& poses, double time);

/// The name of a file or folder without its ending, for reports.
std::string source_name(const std::filesystem::path& source);

}  // namespace pliant
