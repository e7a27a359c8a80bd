#include "imports/image_sequence.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Names in the order of people: runs of digits count as numbers.
bool comes_before(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    while (i < a.size() && a[i] == '0') ++i;
    while (j < b.size() && b[j] == '0') ++j;
    const std::size_t from_a = i, from_b = j;
    while (i < a.size() && is_digit(a[i])) ++i;
    while (j < b.size() && is_digit(b[j])) ++j;
    if (i - from_a != j - from_b) return i - from_a < j - from_b;
    if (const int order = a.compare(from_a, i - from_a, b, from_b, j - from_b)) return order < 0;
  }
  return a.size() - i < b.size() - j;
}

std::optional<long long> last_number(const std::string& name) {
  const auto end = std::find_if(name.rbegin(), name.rend(), is_digit).base();
  const auto begin = std::find_if_not(std::make_reverse_iterator(end), name.rend(), is_digit).base();
  long long number = 0;
  const auto [after, error] =
      std::from_chars(name.data() + (begin - name.begin()), name.data() + (end - name.begin()), number);
  return begin != end && error == std::errc() ? std::optional(number) : std::nullopt;
}

}  // namespace

std::vector<fs::path> image_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (const std::string ending = ending_of(entry.path()); ending == ".png" || ending == ".pgm")
      files.push_back(entry.path());
  }
  std::ranges::sort(files, [](const fs::path& a, const fs::path& b) {
    return comes_before(a.filename().string(), b.filename().string());
  });
  return files;
}

DepthStream stream_of_files(const PinholeCamera& camera, double depth_scale, std::vector<fs::path> files,
                            const fs::path& folder) {
  if (files.empty()) refuse(folder, "no depth image", "16-bit PNG or PGM files");
  DepthStream stream;
  stream.camera = camera;
  stream.depth_scale = depth_scale;
  stream.image_count = int(files.size());
  for (const fs::path& file : files)
    if (const auto number = last_number(file.stem().string())) stream.numbers.push_back(*number);
  if (stream.numbers.size() != files.size()) stream.numbers.clear();
  stream.read = [files = std::move(files), camera](int i) { return read_raw_depth(files[std::size_t(i)], camera); };
  return stream;
}

NumberRow row_of(std::string_view text, int line) {
  NumberRow row{line, {}};
  const bool has_semicolons = text.find(';') != std::string_view::npos;
  std::string cell;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    const char c = i < text.size() ? text[i] : '\n';
    const bool parts = c == ';' || (c == ',' && !has_semicolons) || std::isspace(static_cast<unsigned char>(c));
    if (!parts) {
      cell += c == ',' ? '.' : c;
    } else if (!cell.empty()) {
      row.cells.push_back(std::move(cell));
      cell.clear();
    }
  }
  return row;
}

std::vector<NumberRow> read_rows(const fs::path& file, std::string* heading) {
  const std::string content = read_file(file);
  std::vector<NumberRow> rows;
  int line = 0;
  for (std::size_t at = 0; at < content.size();) {
    const std::size_t end = std::min(content.find('\n', at), content.size());
    const std::string_view text = std::string_view(content).substr(at, end - at);
    NumberRow row = row_of(text, ++line);
    if (!row.cells.empty() && row.cells.front()[0] != '#')
      rows.push_back(std::move(row));
    else if (heading && !row.cells.empty() && rows.empty())
      *heading = text.substr(text.find('#') + 1);
    at = end + 1;
  }
  return rows;
}

double number_at(const NumberRow& row, std::size_t i, const fs::path& file, const char* what) {
  double value = 0.0;
  if (i < row.cells.size()) {
    const std::string& text = row.cells[i];
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error == std::errc() && end == text.data() + text.size() && std::isfinite(value)) return value;
  }
  throw InputError(Problem{{file, row.line},
                           i < row.cells.size() ? "\"" + row.cells[i].substr(0, 60) + "\""
                                                : "a line of " + std::to_string(row.cells.size()) + " cells",
                           what,
                           ""});
}

RigidMotion pose_at(const std::vector<double>& times, const std::vector<RigidMotion>& poses, double time) {
  const std::size_t after = std::size_t(std::ranges::upper_bound(times, time) - times.begin());
  if (after == 0) return poses.front();
  if (after == times.size()) return poses.back();
  const double share = (time - times[after - 1]) / (times[after] - times[after - 1]);
  const Eigen::Quaterniond a(poses[after - 1].rotation), b(poses[after].rotation);
  return {a.slerp(share, b).normalized().toRotationMatrix(),
          (1.0 - share) * poses[after - 1].translation + share * poses[after].translation};
}

std::string source_name(const fs::path& source) {
  const fs::path whole = fs::absolute(source).lexically_normal();
  const fs::path last = whole.has_filename() ? whole.filename() : whole.parent_path().filename();
  return is_folder(source) ? last.string() : last.stem().string();
}

}  // namespace pliant
