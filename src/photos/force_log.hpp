#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <vector>

#include "base/error.hpp"

namespace pliant {

/// What a force sensor recorded.
struct ForceLog {
  std::filesystem::path file;
  std::vector<double> times;   ///< [s], rising
  std::vector<double> forces;  ///< [N]
};

struct ForceLogOptions {
  double scale = 1.0;                ///< newtons of one unit of the log, not 0
  std::optional<double> zero_until;  ///< [s] until then nothing was touched: the mean before is subtracted
};

/// Reads CSV with the header `time,force`.
/// Throws InputError with every problem: no rows, times that do not rise, nothing before `zero_until`.
ForceLog read_force_log(const std::filesystem::path& path, const ForceLogOptions& options = {});

/// A force and how much it varied while it was measured.
struct MeasuredForce {
  double force = 0.0;    ///< [N] mean
  double scatter = 0.0;  ///< [N] standard deviation; 0 where one sample was taken
  int samples = 0;       ///< 0: interpolated between the two beside
};

/// Force at a time: the mean of the samples within half of `window` [s], else by interpolation between the two beside
/// where they are at most `greatest_gap` [s] apart, else nothing.
std::optional<MeasuredForce> force_at(const ForceLog& log, double time, double window, double greatest_gap);

/// Reads when photographs were taken: CSV with the header `number,time`, time [s] of the force log's clock.
/// Throws InputError with every problem; each number may stand there once.
std::map<int, double> read_photograph_times(const std::filesystem::path& path);

}  // namespace pliant
