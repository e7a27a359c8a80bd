#include "photos/force_log.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/csv.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

void subtract_zero(ForceLog& log, double until) {
  const auto end = std::ranges::lower_bound(log.times, until);
  const auto count = end - log.times.begin();
  if (count == 0)
    throw InputError(Problem{{log.file},
                             "no sample before `zero_until`",
                             "samples from before anything was touched",
                             "the log begins at " + std::to_string(log.times.front()) + " s"});
  const double zero = std::accumulate(log.forces.begin(), log.forces.begin() + count, 0.0) / double(count);
  for (double& force : log.forces) force -= zero;
}

}  // namespace

ForceLog read_force_log(const fs::path& path, const ForceLogOptions& options) {
  ForceLog log{path, {}, {}};
  read_csv(path, "time,force", [&](CsvRow& row) {
    const auto time = row.number(0), force = row.number(1);
    if (!time || !force) return;
    if (!log.times.empty() && *time <= log.times.back())
      row.complain(0, "a time that is not after the one before", "times that rise", "sort the log by time");
    log.times.push_back(*time);
    log.forces.push_back(options.scale * *force);
  });
  if (options.zero_until) subtract_zero(log, *options.zero_until);
  return log;
}

std::optional<MeasuredForce> force_at(const ForceLog& log, double time, double window, double greatest_gap) {
  const auto first = std::ranges::lower_bound(log.times, time - 0.5 * window) - log.times.begin();
  const auto last = std::ranges::upper_bound(log.times, time + 0.5 * window) - log.times.begin();
  if (const auto count = last - first; count > 0) {
    MeasuredForce out{0.0, 0.0, int(count)};
    for (auto i = first; i < last; ++i) out.force += log.forces[std::size_t(i)] / double(count);
    for (auto i = first; i < last; ++i) out.scatter += std::pow(log.forces[std::size_t(i)] - out.force, 2);
    out.scatter = count > 1 ? std::sqrt(out.scatter / double(count - 1)) : 0.0;
    return out;
  }
  if (first == 0 || first == long(log.times.size())) return std::nullopt;
  const std::size_t after = std::size_t(first), before = after - 1;
  const double gap = log.times[after] - log.times[before];
  if (gap > greatest_gap) return std::nullopt;
  const double share = (time - log.times[before]) / gap;
  return MeasuredForce{(1.0 - share) * log.forces[before] + share * log.forces[after], 0.0, 0};
}

std::map<int, double> read_photograph_times(const fs::path& path) {
  std::map<int, double> times;
  read_csv(path, "number,time", [&](CsvRow& row) {
    const auto number = row.index(0);
    const auto time = row.number(1);
    if (number && time && !times.emplace(*number, *time).second)
      row.complain(0, "photograph " + std::to_string(*number) + " a second time", "each number once");
  });
  return times;
}

}  // namespace pliant
