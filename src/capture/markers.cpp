#include "capture/markers.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <functional>
#include <ostream>
#include <string>
#include <string_view>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    cells.push_back(trimmed(line.substr(at, end - at)));
    at = end + 1;
  }
  return cells;
}

double number_in(std::string_view cell, const Place& place) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error == std::errc() && end == cell.data() + cell.size() && std::isfinite(value)) return value;
  throw InputError(Problem{place, "\"" + std::string(cell.substr(0, 40)) + "\"", "a finite number",
                           "leave out rows of markers that were not seen"});
}

int index_in(std::string_view cell, const Place& place) {
  const double value = number_in(cell, place);
  if (value == std::floor(value) && value >= 0 && value < 2e9) return int(value);
  throw InputError(Problem{place, "\"" + std::string(cell.substr(0, 40)) + "\"", "a whole number from 0", ""});
}

using Row = std::function<void(const std::vector<std::string_view>&, const Place&)>;

// Calls `row` for each line below the header, with as many cells as the header has.
void read_csv(const fs::path& path, std::string_view header, const Row& row) {
  const std::string content = read_file(path);
  const std::size_t columns = cells_of(header).size();
  int number = 0;
  for (std::size_t at = 0; at < content.size();) {
    const std::size_t end = std::min(content.find('\n', at), content.size());
    const std::string_view line = trimmed(std::string_view(content).substr(at, end - at));
    at = end + 1;
    const Place place{path, ++number, 1};
    const auto cells = cells_of(line);
    if (number == 1) {
      if (cells != cells_of(header))
        throw InputError(Problem{place, "the header \"" + std::string(line.substr(0, 60)) + "\"",
                                 "\"" + std::string(header) + "\"", "name the columns so, in this order"});
    } else if (!line.empty()) {
      if (cells.size() != columns)
        throw InputError(
            Problem{place, std::to_string(cells.size()) + " cells", std::to_string(columns) + " cells", ""});
      row(cells, place);
    }
  }
  if (number == 0)
    throw InputError(
        Problem{{path}, "the file is empty", "a CSV file with the header \"" + std::string(header) + "\"", ""});
}

void add_marker(MarkerPositions& markers, const std::vector<std::string_view>& cells, std::size_t first,
                const Place& place) {
  const int id = index_in(cells[first], place);
  const Vector3 position(number_in(cells[first + 1], place), number_in(cells[first + 2], place),
                         number_in(cells[first + 3], place));
  if (!markers.emplace(id, position).second)
    throw InputError(Problem{place, "marker " + std::to_string(id) + " appears a second time", "each id once", ""});
}

void write_cells(std::ostream& stream, int id, const Vector3& p) {
  char text[128];
  std::snprintf(text, sizeof text, "%d,%.9g,%.9g,%.9g\n", id, p.x(), p.y(), p.z());
  stream << text;
}

}  // namespace

MarkerPositions read_markers(const fs::path& path) {
  MarkerPositions markers;
  read_csv(path, "id,x,y,z", [&](const auto& cells, const Place& place) { add_marker(markers, cells, 0, place); });
  return markers;
}

std::map<int, MarkerPositions> read_marker_track(const fs::path& path) {
  std::map<int, MarkerPositions> track;
  read_csv(path, "frame,id,x,y,z", [&](const auto& cells, const Place& place) {
    add_marker(track[index_in(cells[0], place)], cells, 1, place);
  });
  return track;
}

void write_markers(const fs::path& path, const MarkerPositions& markers) {
  write_file(path, [&](std::ostream& stream) {
    stream << "id,x,y,z\n";
    for (const auto& [id, position] : markers) write_cells(stream, id, position);
  });
}

void write_marker_track(const fs::path& path, const std::map<int, MarkerPositions>& track) {
  write_file(path, [&](std::ostream& stream) {
    stream << "frame,id,x,y,z\n";
    for (const auto& [frame, markers] : track)
      for (const auto& [id, position] : markers) {
        stream << frame << ',';
        write_cells(stream, id, position);
      }
  });
}

}  // namespace pliant
