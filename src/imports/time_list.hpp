#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "imports/recording.hpp"
#include "imports/table.hpp"

namespace pliant {

/// A unit of time and how many seconds it is.
struct TimeUnit {
  std::string_view name;
  double seconds = 1.0;
};

/// "s", "ms", "us" or "ns", and how else people write them ("sec", "msec", "µs"). Nothing: it is no unit of time.
std::optional<TimeUnit> time_unit(std::string_view name);

/// A column's title with its unit in brackets or behind an underscore ("time_ms").
ColumnTitle title_with_unit(const std::string& cell);
/// Whether a column of that title holds times: t, time, timestamp, Zeit, ...
bool says_time(const ColumnTitle& title);

/// Time stamps of frames, in seconds from the first. Where neither the user (`ImportOptions::time_unit`) nor `said`
/// tells their unit, it is the one in which the median step is nearest to the period of `rate`, or, without a rate, at
/// most a second and more than a millisecond (seconds below that); a note says so where that is not seconds.
/// @param said  the unit that stands beside the stamps, if one does
/// @param rate  [Hz] that the camera's file tells, if it does
/// Throws InputError that names the file where the stamps do not grow at all, or are too far apart in every unit.
std::vector<double> in_seconds(std::vector<double> stamps, std::optional<TimeUnit> said, std::optional<double> rate,
                               const ImportOptions& options, const std::filesystem::path& file,
                               std::vector<std::string>& notes);

/// Times of frames [s] from the first, as recorders write them into a text file, a frame a line: among the cells of a
/// line the one whose title says time, or the one that is no count of frames; seconds and nanoseconds in two cells;
/// times of the day (12:30:05.016). Titles may stand in a line above, or in a comment (#), with a unit in brackets or
/// behind an underscore.
/// @param rate  [Hz] that the camera's file tells, if it does
/// Throws InputError that names the file and the line: no number, nothing but counts of frames, and as `in_seconds`.
std::vector<double> read_time_list(const std::filesystem::path& file, std::optional<double> rate,
                                   const ImportOptions& options, std::vector<std::string>& notes);

}  // namespace pliant
