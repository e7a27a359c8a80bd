#include "capture/markers.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <map>
#include <ostream>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include "base/csv.hpp"
#include "base/files.hpp"
#include "base/median.hpp"
#include "base/plausible_size.hpp"
#include "base/points.hpp"
#include "capture/c3d.hpp"
#include "scene/toml_table.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t most_problems = 20;  // told of one pair of files; the rest is counted
constexpr const char* header_of_positions = "id,x,y,z";
constexpr const char* header_of_deviations = "id,sx,sy,sz";
constexpr const char* header_of_track = "frame,id,x,y,z";

using Problems = std::vector<Problem>;
using Numbers = std::unordered_map<std::string, int>;  // of markers, by id

void throw_problems(Problems& problems, const fs::path& path) {
  if (problems.empty()) return;
  const std::size_t count = problems.size();
  problems.resize(std::min(count, most_problems));
  if (count > most_problems)
    problems.push_back(
        {{path}, std::to_string(count - most_problems) + " more problems", "none", "correct these first"});
  throw InputError(std::move(problems));
}

// Runs a reader; what it throws joins the problems.
template <class Read>
void gather(Problems& problems, const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    problems.insert(problems.end(), error.problems().begin(), error.problems().end());
  }
}

std::string in_quotes(const std::string& text) { return '"' + text.substr(0, 60) + '"'; }

std::string marker_named(const std::string& id) { return "marker " + in_quotes(id); }

Numbers numbers_of(const std::vector<std::string>& ids) {
  Numbers numbers;
  for (const std::string& id : ids) numbers.emplace(id, int(numbers.size()));
  return numbers;
}

// The cells x, y, z; nothing, with complaints, where one is no number.
std::optional<Vector3> position_in(CsvRow& row, std::size_t first) {
  const auto x = row.number(first), y = row.number(first + 1), z = row.number(first + 2);
  return x && y && z ? std::optional(Vector3(*x, *y, *z)) : std::nullopt;
}

// Rows of a file `id,x,y,z`, each id once. An id counts as there also where its position is broken.
MarkerPositions read_positions(const fs::path& path, Problems& problems, const char* header = header_of_positions) {
  MarkerPositions markers;
  std::vector<Vector3> positions;
  std::map<std::string, int> line_of;
  gather(problems, [&] {
    read_csv(path, header, problems, [&](CsvRow& row) {
      const auto id = row.text(0);
      const auto position = position_in(row, 1);
      if (!id) return;
      if (const auto [first, is_new] = line_of.emplace(*id, row.line()); !is_new) {
        row.complain(0, marker_named(*id) + " appears a second time", "each id once",
                     "it stands in line " + std::to_string(first->second) + " already");
        return;
      }
      markers.ids.push_back(*id);
      positions.push_back(position.value_or(Vector3::Zero()));
    });
  });
  markers.positions = to_points(positions);
  return markers;
}

// The markers at rest, and frames in which none is seen yet. Throws InputError for more frames than their file can
// mean.
MarkerSet begin_set(const fs::path& rest, const fs::path& seen, int frame_count, Problems& problems) {
  MarkerPositions markers = read_positions(rest, problems);
  MarkerSet set;
  set.ids = std::move(markers.ids);
  set.rest = std::move(markers.positions);
  std::error_code not_there;  // which the file's reader tells
  require_plausible_size(fs::file_size(seen, not_there),
                         std::size_t(frame_count) * (sizeof(Points) + set.ids.size() * sizeof(Vector3)), {seen},
                         std::to_string(frame_count) + " frames of markers");
  set.frames.assign(std::size_t(frame_count),
                    Points::Constant(set.rest.rows(), 3, std::numeric_limits<double>::quiet_NaN()));
  return set;
}

// Puts rows of one or many frames into a set; complains about ids that are unknown (once each) or come twice.
class Collector {
 public:
  Collector(MarkerSet& set, bool rest_is_sound) : set_(set), numbers_(numbers_of(set.ids)), knows_ids_(rest_is_sound) {}

  void add(CsvRow& row, int frame, std::size_t id_column) {
    const auto id = row.text(id_column);
    const auto position = position_in(row, id_column + 1);
    if (!id) return;
    const auto found = numbers_.find(*id);
    if (found == numbers_.end()) {
      if (knows_ids_ && unknown_.insert(*id).second)
        row.complain(id_column, marker_named(*id) + " is not among the markers at rest",
                     "ids as in the file of rest positions", "add its position at rest or remove its rows");
      return;
    }
    if (!seen_.insert({frame, found->second}).second)
      row.complain(id_column, marker_named(*id) + " appears a second time" + in_frame(frame), "each id once",
                   "remove one of the rows");
    else if (position)
      set_.frames[std::size_t(frame)].row(found->second) = *position;
  }

 private:
  std::string in_frame(int frame) const {
    return set_.frames.size() > 1 ? " in frame " + std::to_string(frame) : std::string();
  }

  MarkerSet& set_;
  Numbers numbers_;
  bool knows_ids_;
  std::set<std::string> unknown_;
  std::set<std::pair<int, int>> seen_;
};

void read_csv_track(const fs::path& path, MarkerSet& set, Problems& problems) {
  Collector collector(set, problems.empty());
  const int frame_count = int(set.frames.size());
  read_csv(path, header_of_track, problems, [&](CsvRow& row) {
    const auto frame = row.index(0);
    if (!frame) return;
    if (*frame < frame_count)
      collector.add(row, *frame, 1);
    else
      row.complain(0, "frame " + std::to_string(*frame), "0 to " + std::to_string(frame_count - 1),
                   "frames are counted from 0; correct `frame_count` or remove the rows");
  });
}

std::string known_labels(const std::set<std::string>& labels) {
  std::string text;
  for (const std::string& label : labels) {
    if (text.size() > 200) return text + ", ...";
    text += (text.empty() ? "" : ", ") + in_quotes(label);
  }
  return text.empty() ? "labels in POINT:LABELS" : "one of " + text;
}

// The trajectory of each marker at rest; -1, with a complaint, where it has none or several.
std::vector<int> match_labels(const fs::path& path, const std::vector<std::string>& ids,
                              const std::vector<std::string>& labels, Problems& problems) {
  std::set<std::string> known(labels.begin(), labels.end());
  known.erase("");
  std::vector<int> columns;
  for (const std::string& id : ids) {
    const auto found = std::ranges::find(labels, id);
    columns.push_back(found == labels.end() ? -1 : int(found - labels.begin()));
    if (found == labels.end()) {
      const std::string nearest = nearest_name(id, known);
      problems.push_back({{path},
                          "no trajectory with the label " + in_quotes(id),
                          known_labels(known),
                          nearest.empty()
                              ? "name the markers at rest as the trajectories are labelled"
                              : "did you mean " + in_quotes(nearest) + "? Ids of markers at rest are labels"});
    } else if (std::find(found + 1, labels.end(), id) != labels.end()) {
      problems.push_back({{path},
                          "several trajectories with the label " + in_quotes(id),
                          "one",
                          "join or rename them where they were recorded"});
    }
  }
  return columns;
}

void read_c3d_track(const fs::path& path, MarkerSet& set, Problems& problems) {
  const C3dTrajectories file = read_c3d(path);
  set.frame_rate = file.frame_rate;
  if (file.frames.size() > set.frames.size())
    problems.push_back({{path},
                        std::to_string(file.frames.size()) + " frames",
                        std::to_string(set.frames.size()) + " at most, the capture's frames",
                        "correct `frame_count`, or export those frames alone"});
  const std::size_t before = problems.size();
  const std::vector<int> columns = match_labels(path, set.ids, file.labels, problems);
  for (const std::string& label : file.labels)
    if (!label.empty() && std::ranges::find(set.ids, label) == set.ids.end()) set.left_out.push_back(label);
  if (problems.size() > before) return;
  for (std::size_t f = 0; f < std::min(file.frames.size(), set.frames.size()); ++f)
    for (std::size_t i = 0; i < columns.size(); ++i)
      set.frames[f].row(Eigen::Index(i)) = file.frames[f].row(columns[i]);
}

void write_row(std::ostream& stream, const std::string& id, const Eigen::RowVector3d& p) {
  if (id.empty() || id.find_first_of(",\"\n\r") != std::string::npos)
    throw std::invalid_argument("a marker's id must have no comma, quote or line's end: \"" + id + "\"");
  char text[96];
  std::snprintf(text, sizeof text, ",%.9g,%.9g,%.9g\n", p.x(), p.y(), p.z());
  stream << id << text;
}

}  // namespace

MarkerPositions read_marker_positions(const fs::path& path) {
  Problems problems;
  MarkerPositions markers = read_positions(path, problems);
  throw_problems(problems, path);
  return markers;
}

Points read_marker_deviations(const fs::path& path, std::span<const std::string> ids) {
  Problems problems;
  const MarkerPositions read = read_positions(path, problems, header_of_deviations);
  throw_problems(problems, path);
  Points deviations = Points::Constant(Eigen::Index(ids.size()), 3, std::numeric_limits<double>::quiet_NaN());
  const Numbers numbers = numbers_of({ids.begin(), ids.end()});
  for (std::size_t i = 0; i < read.ids.size(); ++i) {
    const auto row = read.positions.row(Eigen::Index(i));
    const auto found = numbers.find(read.ids[i]);
    if (found == numbers.end())
      problems.push_back({{path},
                          marker_named(read.ids[i]) + " is not among the markers at rest",
                          "ids as in the file of rest positions",
                          "remove its row"});
    else if (!(row.minCoeff() > 0.0))
      problems.push_back({{path},
                          marker_named(read.ids[i]) + " has a deviation that is not positive",
                          "three standard deviations [m], > 0",
                          "leave out the row of a marker whose deviation is not known"});
    else
      deviations.row(found->second) = row;
  }
  throw_problems(problems, path);
  return deviations;
}

MarkerSet read_marker_pair(const fs::path& rest, const fs::path& under_load) {
  Problems problems;
  MarkerSet set = begin_set(rest, under_load, 1, problems);
  Collector collector(set, problems.empty());
  gather(problems,
         [&] { read_csv(under_load, header_of_positions, problems, [&](CsvRow& row) { collector.add(row, 0, 0); }); });
  throw_problems(problems, under_load);
  return set;
}

MarkerSet read_markers(const MarkerTrack& files, int frame_count) {
  Problems problems;
  MarkerSet set = begin_set(files.rest, files.track, frame_count, problems);
  gather(problems, [&] {
    ending_of(files.track) == ".c3d" ? read_c3d_track(files.track, set, problems)
                                     : read_csv_track(files.track, set, problems);
  });
  throw_problems(problems, files.track);
  return set;
}

std::optional<double> track_noise(const MarkerSet& markers) {
  constexpr int least = 12;
  const double of_one = std::sqrt(20.0);  // 1, 3, 3, 1: the deviation of a third difference of independent readings
  std::vector<double> sizes;
  for (std::size_t f = 3; f < markers.frames.size(); ++f)
    for (Eigen::Index m = 0; m < markers.rest.rows(); ++m) {
      const auto at = [&](std::size_t back) -> Vector3 { return markers.frames[f - back].row(m).transpose(); };
      const Vector3 third = at(0) - 3.0 * at(1) + 3.0 * at(2) - at(3);
      for (int d = 0; d < 3; ++d)
        if (std::isfinite(third[d])) sizes.push_back(std::abs(third[d]) / of_one);
    }
  if (int(sizes.size()) < least) return std::nullopt;
  return median(std::move(sizes)) / 0.67449;  // of a normal deviation's median size
}

void write_marker_positions(const fs::path& path, const MarkerPositions& markers) {
  write_file(path, [&](std::ostream& stream) {
    stream << header_of_positions << '\n';
    for (std::size_t i = 0; i < markers.ids.size(); ++i)
      if (const auto row = Eigen::Index(i); markers.positions.row(row).allFinite())
        write_row(stream, markers.ids[i], markers.positions.row(row));
  });
}

void write_marker_track(const fs::path& path, std::span<const std::string> ids, std::span<const Points> frames) {
  write_file(path, [&](std::ostream& stream) {
    stream << header_of_track << '\n';
    for (std::size_t frame = 0; frame < frames.size(); ++frame)
      for (std::size_t i = 0; i < ids.size(); ++i) {
        const Eigen::RowVector3d position = frames[frame].row(Eigen::Index(i));
        if (!position.allFinite()) continue;
        stream << frame << ',';
        write_row(stream, ids[i], position);
      }
  });
}

}  // namespace pliant
