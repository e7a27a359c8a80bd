#include "imports/time_list.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include "base/error.hpp"
#include "base/files.hpp"
#include "base/median.hpp"
#include "imports/image_sequence.hpp"
#include "imports/table.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr TimeUnit units[] = {{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}, {"ns", 1e-9}};
constexpr double shortest_period = 1e-3;  // [s] of frames, where nothing but the steps tells their unit
constexpr double other_rate = 0.2;        // relative, by which two statements of a rate differ

// Seconds of a time of the day such as 12:30:05.016, or of a date and time with a T between them.
std::optional<double> time_of_day(std::string_view text) {
  if (const auto date = text.find('T'); date != std::string_view::npos) text.remove_prefix(date + 1);
  if (text.ends_with('Z')) text.remove_suffix(1);
  double seconds = 0.0;
  for (int part = 0; part < 3; ++part) {
    double value = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed);
    const bool is_last = end == text.data() + text.size();
    if (error != std::errc() || is_last != (part == 2) || (!is_last && *end != ':')) return std::nullopt;
    seconds = 60.0 * seconds + value;
    text.remove_prefix(std::size_t(end - text.data()) + (is_last ? 0 : 1));
  }
  return seconds;
}

std::optional<double> stamp_of(const std::string& cell) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error == std::errc() && end == cell.data() + cell.size() && std::isfinite(value)) return value;
  return time_of_day(cell);
}

std::vector<double> steps_of(const std::vector<double>& stamps) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(stamps[i] - stamps[i - 1]);
  return steps;
}

bool are_whole(const std::vector<double>& stamps) {
  return std::ranges::all_of(stamps, [](double t) { return t == std::floor(t); });
}

// Whether stamps number the frames: whole numbers that mostly grow by one.
bool count_frames(const std::vector<double>& stamps) {
  const std::vector<double> steps = steps_of(stamps);
  return are_whole(stamps) && (steps.empty() || median(steps) == 1.0) &&
         std::ranges::all_of(steps, [](double d) { return d >= 1.0; });
}

bool may_be_times(const std::vector<double>& stamps) {
  const std::vector<double> steps = steps_of(stamps);
  return stamps.back() > stamps.front() && std::ranges::all_of(steps, [](double d) { return d >= 0.0; }) &&
         !count_frames(stamps);
}

// A column of numbers, and what its title says.
struct StampColumn {
  ColumnTitle title;
  std::vector<double> stamps;
};

// Cells of a heading, with a unit in brackets that stands apart joined to its title.
std::vector<std::string> titles_of(const std::vector<std::string>& cells) {
  std::vector<std::string> titles;
  for (const std::string& cell : cells)
    if (!titles.empty() && (cell.starts_with('[') || cell.starts_with('(')))
      titles.back() += cell;
    else
      titles.push_back(cell);
  return titles;
}

// Columns of numbers in all lines but the heading.
std::vector<StampColumn> columns_of(const fs::path& file) {
  std::string heading;
  std::vector<NumberRow> rows = read_rows(file, &heading);
  std::vector<std::string> titles;
  if (!rows.empty() &&
      std::ranges::none_of(rows.front().cells, [](const auto& c) { return stamp_of(c).has_value(); })) {
    titles = titles_of(rows.front().cells);
    rows.erase(rows.begin());
  } else if (!heading.empty()) {
    titles = titles_of(row_of(heading).cells);
  }
  if (rows.empty()) refuse(file, "no time", "a time for each frame, a line each");
  std::size_t width = rows.front().cells.size();
  for (const NumberRow& row : rows) width = std::min(width, row.cells.size());
  std::vector<StampColumn> columns;
  for (std::size_t c = 0; c < width; ++c) {
    StampColumn column;
    if (c < titles.size()) column.title = title_with_unit(titles[c]);
    for (const NumberRow& row : rows)
      if (const auto stamp = stamp_of(row.cells[c])) column.stamps.push_back(*stamp);
    if (column.stamps.size() == rows.size()) columns.push_back(std::move(column));
  }
  if (columns.empty())
    for (const NumberRow& row : rows)
      if (!stamp_of(row.cells.front()))
        throw InputError(Problem{{file, row.line}, "\"" + row.cells.front().substr(0, 60) + "\"", "a time", ""});
  return columns;
}

// Seconds, and nanoseconds beyond them, in two columns.
std::optional<std::vector<double>> seconds_and_nanoseconds(const std::vector<StampColumn>& columns) {
  for (std::size_t c = 1; c < columns.size(); ++c) {
    const std::vector<double>&seconds = columns[c - 1].stamps, &beyond = columns[c].stamps;
    const bool are_parts = are_whole(seconds) && are_whole(beyond) && std::ranges::max(beyond) > 1e6 &&
                           std::ranges::all_of(beyond, [](double ns) { return ns >= 0.0 && ns < 1e9; });
    if (!are_parts) continue;
    std::vector<double> both;
    for (std::size_t i = 0; i < seconds.size(); ++i) both.push_back(seconds[i] - seconds[0] + 1e-9 * beyond[i]);
    // a count of frames before nanoseconds would grow by a second a frame
    if (!count_frames(seconds) && std::ranges::is_sorted(both)) return both;
  }
  return std::nullopt;
}

}  // namespace

std::optional<TimeUnit> time_unit(std::string_view name) {
  static const std::map<std::string_view, int> names = {
      {"s", 0},      {"sec", 0},          {"secs", 0},         {"second", 0},   {"seconds", 0},
      {"ms", 1},     {"msec", 1},         {"millis", 1},       {"us", 2},       {"usec", 2},
      {"micros", 2}, {"milliseconds", 1}, {"microseconds", 2}, {"ns", 3},       {"nsec", 3},
      {"nanos", 3},  {"nanoseconds", 3},  {"\xC2\xB5s", 2},    {"\xCE\xBCs", 2}};
  const auto found = names.find(name);
  return found == names.end() ? std::nullopt : std::optional(units[found->second]);
}

ColumnTitle title_with_unit(const std::string& cell) {
  ColumnTitle title = column_title(cell);
  const auto underscore = title.name.rfind('_');
  if (title.unit.empty() && underscore != std::string::npos && time_unit(title.name.substr(underscore + 1))) {
    title.unit = title.name.substr(underscore + 1);
    title.name.resize(underscore);
  }
  return title;
}

bool says_time(const ColumnTitle& title) {
  return title.name == "t" || title.name.find("time") != std::string::npos ||
         title.name.find("stamp") != std::string::npos || title.name == "zeit";
}

std::vector<double> in_seconds(std::vector<double> stamps, std::optional<TimeUnit> said, std::optional<double> rate,
                               const ImportOptions& options, const fs::path& file, std::vector<std::string>& notes) {
  if (stamps.size() < 2) return std::vector<double>(stamps.size(), 0.0);
  std::vector<double> growing;
  for (const double step : steps_of(stamps))
    if (step > 0.0) growing.push_back(step);
  if (growing.empty()) refuse(file, "times that do not grow", "a time for each frame", "give --rate, frames a second");
  const double step = median(growing);
  TimeUnit unit = said.value_or(units[0]);
  if (options.time_unit) {
    unit = *time_unit(*options.time_unit);
  } else if (!said) {
    const auto fits = [&](const TimeUnit& u) {
      const double period = step * u.seconds;
      return rate ? std::abs(std::log(period * *rate)) : std::abs(std::log(period / std::sqrt(shortest_period)));
    };
    if (step > shortest_period || rate) unit = *std::ranges::min_element(units, {}, fits);
    if (const double period = step * unit.seconds; !rate && period > 2.0)
      refuse(file, fmt::format("times {:.4g} apart (median)", step), "times of frames in s, ms, us or ns",
             "say with --time-unit which it is, or give --rate, frames a second");
    if (unit.seconds != 1.0)
      notes.push_back(
          fmt::format("times are taken for {}: {:.4g} between images is {:.4g} Hz (--time-unit says otherwise)",
                      unit.name, step, 1.0 / (step * unit.seconds)));
  }
  const double found = 1.0 / (step * unit.seconds);
  if (rate && std::abs(found / *rate - 1.0) > other_rate)
    notes.push_back(fmt::format(
        "times are {:.4g} Hz and the camera's file says {:.4g} Hz: the times are taken (--rate says otherwise)", found,
        *rate));
  const double first = stamps.front();
  for (double& stamp : stamps) stamp = (stamp - first) * unit.seconds;
  return stamps;
}

std::vector<double> read_time_list(const fs::path& file, std::optional<double> rate, const ImportOptions& options,
                                   std::vector<std::string>& notes) {
  const std::vector<StampColumn> columns = columns_of(file);
  const StampColumn* best = nullptr;
  for (const StampColumn& column : columns)
    if (!best && says_time(column.title)) best = &column;
  if (!best)
    if (auto both = seconds_and_nanoseconds(columns)) return *both;
  const auto fraction_and_step = [](const StampColumn& c) {
    return std::pair(!are_whole(c.stamps), median(steps_of(c.stamps)));
  };
  for (const StampColumn& column : columns)
    if ((!best || !says_time(best->title)) && may_be_times(column.stamps) &&
        (!best || fraction_and_step(*best) < fraction_and_step(column)))
      best = &column;
  if (columns.front().stamps.size() < 2) best = &columns.front();
  if (!best || (count_frames(best->stamps) && best->title.unit.empty() && best->stamps.size() > 1))
    refuse(file,
           columns.empty() || !count_frames(columns.front().stamps) ? "no column of times that grow"
                                                                    : "numbers of frames, and no times",
           "a time for each frame, a line each", "give --rate, frames a second, in the place of this file");
  return in_seconds(best->stamps, time_unit(best->title.unit), rate, options, file, notes);
}

}  // namespace pliant
