// Markers of motion capture: C3D, and CSV with a row a marker (frame,id,x,y,z in metres) or a row a frame (columns
// NAME_x, NAME_y, NAME_z with a unit behind them, and a column of times).
#include <algorithm>
#include <cmath>
#include <map>

#include "base/files.hpp"
#include "base/median.hpp"
#include "base/plausible_size.hpp"
#include "capture/frame_numbers.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/table.hpp"
#include "imports/time_list.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr int most_marker_frames = 10000000;

// Frames that show no marker take room as well.
std::vector<Points> unseen_frames(int count, std::size_t markers, const fs::path& file) {
  require_plausible_size(fs::file_size(file), std::size_t(count) * (sizeof(Points) + markers * sizeof(Vector3)), {file},
                         std::to_string(count) + " frames of markers");
  return std::vector<Points>(std::size_t(count), Points::Constant(Eigen::Index(markers), 3, not_a_number));
}

// A column of a coordinate: "tip1_x_m", "tip1_x (mm)", "tip1 X".
struct MarkerColumn {
  std::string marker;
  int axis = 0;
  double unit = 1.0;
};

std::optional<MarkerColumn> marker_column(const std::string& cell, double usual_unit) {
  const auto open = cell.find_first_of("([");
  std::string name = cell.substr(0, open);
  std::string unit = open == std::string::npos ? "" : column_title(cell).unit;
  while (!name.empty() && name.back() == ' ') name.pop_back();
  for (const char* ending : {"_mm", "_cm", "_m"})
    if (unit.empty() && name.ends_with(ending)) {
      unit = ending + 1;
      name.resize(name.size() - unit.size() - 1);
    }
  if (name.size() < 3) return std::nullopt;
  const char axis = name.back(), before = name[name.size() - 2];
  const auto index = std::string_view("xyzXYZ").find(axis);
  if (index == std::string_view::npos || (before != '_' && before != ' ' && before != '.' && before != ':'))
    return std::nullopt;
  const auto scale = unit.empty() ? std::optional(usual_unit) : length_unit(unit);
  if (!scale) return std::nullopt;
  return MarkerColumn{name.substr(0, name.size() - 2), int(index % 3), *scale};
}

bool is_long_header(const std::vector<std::string>& cells) {
  return cells == std::vector<std::string>{"frame", "id", "x", "y", "z"};
}

C3dTrajectories long_markers(const TextTable& table) {
  C3dTrajectories result;
  std::map<std::string, Eigen::Index> index;
  struct Row {
    int frame;
    Eigen::Index marker;
    Vector3 at;
  };
  std::vector<Row> rows;
  int last = 0;
  for (std::size_t line = 1; line < table.lines.size(); ++line) {
    const std::vector<std::string>& cells = table.lines[line];
    if (std::ranges::all_of(cells, [](const std::string& c) { return c.empty(); })) continue;
    const auto frame = table_number(table, line, 0), x = table_number(table, line, 2);
    const auto y = table_number(table, line, 3), z = table_number(table, line, 4);
    if (!frame || !x || !y || !z || *frame < 0 || *frame > most_marker_frames || *frame != std::floor(*frame))
      throw InputError(Problem{{table.file, int(line) + 1}, "a line that is no marker's", "frame,id,x,y,z", ""});
    const auto [it, is_new] = index.try_emplace(cells[1], Eigen::Index(index.size()));
    if (is_new) result.labels.push_back(cells[1]);
    rows.push_back({int(*frame), it->second, {*x, *y, *z}});
    last = std::max(last, rows.back().frame);
  }
  if (rows.empty()) refuse(table.file, "no marker", "frame,id,x,y,z a line");
  result.frames = unseen_frames(last + 1, index.size(), table.file);
  for (const Row& row : rows) result.frames[std::size_t(row.frame)].row(row.marker) = row.at;
  return result;
}

// Frames at times that are whole periods apart, to a tenth of one: those that are missing show no marker.
void place_in_time(const std::vector<double>& times, const fs::path& file, C3dTrajectories& result,
                   std::vector<std::string>& notes) {
  constexpr double uneven = 0.1;
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  if (steps.empty() || !(std::ranges::min(steps) > 0.0))
    refuse(file, "times that do not grow", "a time for each frame", "give --rate, frames a second");
  double step = median(steps);
  std::vector<int> periods;
  for (int round = 0; round < 2; ++round) {  // the mean over all is more exact than one rounded step
    periods.assign(1, 0);
    for (std::size_t i = 1; i < times.size(); ++i) periods.push_back(int(std::lround((times[i] - times[0]) / step)));
    if (periods.back() > 0) step = (times.back() - times.front()) / periods.back();
  }
  for (std::size_t i = 1; i < times.size(); ++i)
    if (periods[i] <= periods[i - 1] || std::abs(times[i] - times.front() - step * periods[i]) > uneven * step)
      refuse(file,
             "times that are not even: line " + std::to_string(i + 2) + " is off by more than a tenth of the step",
             "a constant frame rate", "give --rate, frames a second, where it was constant");
  result.frame_rate = 1.0 / step;
  if (periods.back() + 1 == int(periods.size())) return;
  notes.push_back(note_of_gaps(periods, "the column of times"));
  if (periods.back() > most_marker_frames)
    refuse(file, "a gap of more than ten million frames", "times of one recording");
  std::vector<Points> all = unseen_frames(periods.back() + 1, result.labels.size(), file);
  for (std::size_t i = 0; i < periods.size(); ++i) all[std::size_t(periods[i])] = std::move(result.frames[i]);
  result.frames = std::move(all);
}

C3dTrajectories wide_markers(const TextTable& table, const ImportOptions& options, std::vector<std::string>& notes) {
  C3dTrajectories result;
  std::vector<std::pair<std::size_t, MarkerColumn>> columns;
  std::map<std::string, Eigen::Index> index;
  std::optional<std::size_t> time;
  ColumnTitle time_title;
  for (std::size_t i = 0; i < table.lines[0].size(); ++i) {
    ColumnTitle title = title_with_unit(table.lines[0][i]);
    if (!time && says_time(title)) {
      time = i, time_title = std::move(title);
    } else if (const auto column = marker_column(table.lines[0][i], 0.0)) {
      if (column->unit == 0.0)
        throw InputError(Problem{{table.file, 1},
                                 "the column \"" + table.lines[0][i] + "\" without a unit",
                                 "m, cm or mm, as in tip_x_mm or \"tip_x (mm)\"",
                                 "write the unit behind each title"});
      columns.emplace_back(i, *column);
      if (index.try_emplace(column->marker, Eigen::Index(index.size())).second) result.labels.push_back(column->marker);
    }
  }
  if (columns.size() != 3 * index.size())
    refuse(table.file, std::to_string(columns.size()) + " columns of " + std::to_string(index.size()) + " markers",
           "x, y and z of each");
  std::vector<double> times;
  for (std::size_t line = 1; line < table.lines.size(); ++line) {
    if (std::ranges::all_of(table.lines[line], [](const std::string& c) { return c.empty(); })) continue;
    Points frame = Points::Constant(Eigen::Index(index.size()), 3, not_a_number);
    for (const auto& [at, column] : columns) {
      const auto value = table_number(table, line, at);
      const bool is_missing = at >= table.lines[line].size() || table.lines[line][at].empty() ||
                              table.lines[line][at] == "NaN" || table.lines[line][at] == "nan";
      if (!value && !is_missing)
        throw InputError(Problem{{table.file, int(line) + 1},
                                 "\"" + table.lines[line][at].substr(0, 40) + "\"",
                                 "a number, or an empty cell where the marker was not seen",
                                 ""});
      if (value) frame(index[column.marker], column.axis) = *value * column.unit;
    }
    for (Eigen::Index i = 0; i < frame.rows(); ++i)
      if (!frame.row(i).allFinite()) frame.row(i).setConstant(not_a_number);
    result.frames.push_back(frame);
    if (time) times.push_back(table_number(table, line, *time).value_or(not_a_number));
  }
  if (result.frames.empty()) refuse(table.file, "no frame", "a line for each frame");
  if (time && !options.frame_rate) {
    if (const auto bad = std::ranges::find_if_not(times, [](double t) { return std::isfinite(t); }); bad != times.end())
      refuse(table.file, "a line without a time: that of frame " + std::to_string(bad - times.begin()),
             "a time for each");
    times = in_seconds(std::move(times), time_unit(time_title.unit), {}, options, table.file, notes);
    place_in_time(times, table.file, result, notes);
  }
  return result;
}

bool is_marker_header(const std::vector<std::string>& cells) {
  if (is_long_header(cells)) return true;
  const auto count =
      std::ranges::count_if(cells, [](const std::string& c) { return marker_column(c, 1.0).has_value(); });
  return count >= 3 && count % 3 == 0;
}

}  // namespace

bool is_c3d(const fs::path& source) { return source.extension() == ".c3d" || source.extension() == ".C3D"; }

ImportedRecording read_c3d_markers(const fs::path& source, const ImportOptions& options) {
  ImportedRecording recording;
  recording.name = source_name(source);
  recording.markers = read_c3d(source);
  if (options.frame_rate) recording.markers->frame_rate = options.frame_rate;
  return recording;
}

bool is_marker_csv(const fs::path& source) {
  if (!is_file(source) || source.extension() != ".csv") return false;
  try {
    const TextTable table = read_table(source);
    return !table.lines.empty() && is_marker_header(table.lines[0]);
  } catch (const InputError&) {
    return false;
  }
}

ImportedRecording read_marker_csv(const fs::path& source, const ImportOptions& options) {
  const TextTable table = read_table(source);
  if (table.lines.empty() || !is_marker_header(table.lines[0]))
    refuse(source, "a first line that names no markers", "frame,id,x,y,z, or columns NAME_x_m, NAME_y_m, NAME_z_m");
  ImportedRecording recording;
  recording.name = source_name(source);
  recording.markers =
      is_long_header(table.lines[0]) ? long_markers(table) : wide_markers(table, options, recording.notes);
  if (options.frame_rate) recording.markers->frame_rate = options.frame_rate;
  return recording;
}

}  // namespace pliant
