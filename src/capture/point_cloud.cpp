#include "capture/point_cloud.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <ostream>
#include <sstream>
#include <string>
#include <string_view>

#include "base/files.hpp"
#include "geometry/ply.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(Place place, std::string found, std::string expected, std::string advice = "") {
  throw InputError(Problem{std::move(place), std::move(found), std::move(expected), std::move(advice)});
}

enum class PcdData { Ascii, Binary, Compressed };

/// Bytes that LZF packed: runs of up to 32 bytes as they are, and copies of up to 264 bytes from up to 8192 before.
/// Nothing where they are broken, or not so many as `size`. Source: liblzf's lzf_d.c for the layout.
std::optional<std::string> unpack_lzf(std::string_view packed, std::size_t size) {
  std::string bytes;
  auto next = [&, at = std::size_t(0)]() mutable -> int {
    return at < packed.size() ? int(static_cast<unsigned char>(packed[at++])) : -1;
  };
  for (int control = next(); control >= 0; control = next()) {
    if (control < 32) {
      for (int i = 0; i <= control; ++i) {
        const int byte = next();
        if (byte < 0) return std::nullopt;
        bytes += char(byte);
      }
    } else {
      int length = control >> 5;
      if (length == 7) length += std::max(next(), 0);
      const int low = next();
      const std::size_t back = (std::size_t(control & 31) << 8U | std::size_t(std::max(low, 0))) + 1;
      if (low < 0 || back > bytes.size()) return std::nullopt;
      for (int i = 0; i < length + 2; ++i) bytes += bytes[bytes.size() - back];
    }
    if (bytes.size() > size) return std::nullopt;
  }
  if (bytes.size() != size) return std::nullopt;
  return bytes;
}

struct PcdField {
  std::string name;
  std::size_t size = 4;
  char type = 'F';
  std::size_t count = 1;
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::size_t points = 0;
  PcdData data = PcdData::Ascii;
  std::size_t body = 0;  // first byte behind the line DATA
  int lines = 0;
};

class PcdReader {
 public:
  PcdReader(const fs::path& path, std::string_view content) : path_(path), content_(content) { read_header(); }

  const PcdHeader& header() const { return header_; }

  std::vector<Vector3> points() const {
    if (header_.points > content_.size()) fail_short(0);  // each takes a byte at least
    std::vector<Vector3> points(header_.points);
    if (header_.data == PcdData::Ascii)
      read_ascii(points);
    else
      header_.data == PcdData::Binary ? read_binary(points) : read_compressed(points);
    return points;
  }

 private:
  void read_header() {
    int& line_number = header_.lines;
    for (std::size_t at = 0; at < content_.size();) {
      const std::size_t end = content_.find('\n', at);
      if (end == std::string_view::npos) break;
      std::istringstream words{std::string(content_.substr(at, end - at))};
      at = end + 1;
      ++line_number;
      std::string keyword;
      words >> keyword;
      if (keyword == "DATA") {
        read_data_kind(words);
        header_.body = at;
        find_columns();
        return;
      }
      read_declaration(keyword, words);
    }
    fail({path_, line_number, 0}, "no line \"DATA\"", "a PCD file", "the file was cut short or is no PCD file");
  }

  void read_data_kind(std::istringstream& words) {
    std::string kind;
    words >> kind;
    if (kind != "ascii" && kind != "binary" && kind != "binary_compressed")
      fail({path_, header_.lines, 0}, "PCD data \"" + kind.substr(0, 40) + "\"", "ascii, binary or binary_compressed",
           "convert the file with pcl_convert_pcd_ascii_binary");
    header_.data = kind == "ascii" ? PcdData::Ascii : kind == "binary" ? PcdData::Binary : PcdData::Compressed;
  }

  void read_declaration(const std::string& keyword, std::istringstream& words) {
    if (keyword.starts_with('#') || keyword.empty() || keyword == "VERSION" || keyword == "VIEWPOINT") return;
    std::string word;
    std::size_t i = 0;
    if (keyword == "FIELDS") {
      while (words >> word) header_.fields.push_back({word});
    } else if (keyword == "SIZE" || keyword == "COUNT") {
      for (std::size_t value; i < header_.fields.size() && words >> value; ++i)
        (keyword == "SIZE" ? header_.fields[i].size : header_.fields[i].count) = value;
    } else if (keyword == "TYPE") {
      for (; i < header_.fields.size() && words >> word; ++i) header_.fields[i].type = word[0];
    } else if (keyword == "POINTS") {
      words >> header_.points;
    } else if (keyword != "WIDTH" && keyword != "HEIGHT") {
      std::string shown = keyword.substr(0, 20);
      for (char& c : shown)
        if (c < 32 || c > 126) c = '?';
      fail({path_, header_.lines, 0}, "the header line \"" + shown + "\"", "a PCD header (VERSION, FIELDS, SIZE, ...)");
    }
  }

  void find_columns() {
    std::size_t offset = 0, column = 0;
    std::array<bool, 3> found{};
    for (const PcdField& field : header_.fields) {
      if (field.size > 8 || field.count > content_.size())
        fail({path_},
             "the field " + field.name + " of " + std::to_string(field.count) + " numbers of " +
                 std::to_string(field.size) + " bytes",
             "numbers of 1, 2, 4 or 8 bytes that the file can hold", "the file was cut short or its header is wrong");
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (field.name == std::string(1, char('x' + axis))) {
          if (field.type != 'F' || (field.size != 4 && field.size != 8) || field.count != 1)
            fail({path_}, "the field " + field.name + " is not a floating point number", "TYPE F and SIZE 4 or 8");
          found[axis] = true;
          offsets_[axis] = offset;
          columns_[axis] = column;
          sizes_[axis] = field.size;
        }
      offset += field.size * field.count;
      column += field.count;
    }
    stride_ = offset;
    column_count_ = column;
    if (!found[0] || !found[1] || !found[2]) fail({path_, header_.lines, 0}, "no fields x, y and z", "FIELDS x y z");
  }

  [[noreturn]] void fail_short(std::size_t point) const {
    fail({path_}, "the file ends in point " + std::to_string(point) + " of " + std::to_string(header_.points),
         std::to_string(header_.points) + " points, as its header says",
         "the file was cut short; write or copy it again");
  }

  void read_binary(std::vector<Vector3>& points) const {
    const std::string_view body = content_.substr(header_.body);
    if (body.size() / stride_ < points.size()) fail_short(body.size() / stride_);
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        points[i][Eigen::Index(axis)] = number_at(body.data() + i * stride_ + offsets_[axis], sizes_[axis]);
  }

  /// Two sizes, and by LZF the values of all points field by field.
  void read_compressed(std::vector<Vector3>& points) const {
    const std::string_view body = content_.substr(header_.body);
    std::uint32_t packed = 0, size = 0;
    if (body.size() < 8) fail_short(0);
    std::memcpy(&packed, body.data(), 4), std::memcpy(&size, body.data() + 4, 4);
    if (packed > body.size() - 8) fail_short(0);
    const std::optional<std::string> bytes = unpack_lzf(body.substr(8, packed), size);
    if (!bytes || bytes->size() % stride_ != 0 || bytes->size() / stride_ != points.size())
      fail({path_}, bytes ? std::to_string(bytes->size()) + " bytes of points" : "compressed points that are broken",
           std::to_string(points.size()) + " points of " + std::to_string(stride_) + " bytes, as the header says",
           "write or copy the file again");
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis)
        points[i][Eigen::Index(axis)] =
            number_at(bytes->data() + offsets_[axis] * points.size() + i * sizes_[axis], sizes_[axis]);
  }

  static double number_at(const char* bytes, std::size_t size) {
    static_assert(std::endian::native == std::endian::little, "PCD data lie in the writer's byte order: little endian");
    double value;
    float narrow;
    if (size == 8)
      std::memcpy(&value, bytes, 8);
    else
      std::memcpy(&narrow, bytes, 4), value = double(narrow);
    return value;
  }

  void read_ascii(std::vector<Vector3>& points) const {
    const std::string_view body = content_.substr(header_.body);
    std::size_t at = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      for (std::size_t column = 0; column < column_count_; ++column) {
        at = body.find_first_not_of(" \t\r\n", at);
        if (at == std::string_view::npos) fail_short(i);
        const std::size_t end = std::min(body.find_first_of(" \t\r\n", at), body.size());
        for (std::size_t axis = 0; axis < 3; ++axis)
          if (columns_[axis] == column) points[i][Eigen::Index(axis)] = number_in(body.substr(at, end - at), i);
        at = end;
      }
  }

  double number_in(std::string_view word, std::size_t point) const {
    double value = 0.0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error == std::errc() && end == word.data() + word.size()) return value;
    fail({path_, header_.lines + 1 + int(point), 0},
         "\"" + std::string(word.substr(0, 40)) + "\" in point " + std::to_string(point), "a number");
  }

  const fs::path& path_;
  std::string_view content_;
  PcdHeader header_;
  std::array<std::size_t, 3> offsets_{}, columns_{}, sizes_{};
  std::size_t stride_ = 0, column_count_ = 0;
};

std::vector<Vector3> ply_positions(const fs::path& path) {
  const PlyFile ply = read_ply(path);
  const PlyElement* vertex = ply.element("vertex");
  const PlyProperty* columns[3] = {};
  for (int axis = 0; vertex && axis < 3; ++axis) columns[axis] = vertex->property(std::string(1, char('x' + axis)));
  for (const PlyProperty* column : columns)
    if (!column || column->is_list) fail({path}, "no vertices with x, y and z", "a point cloud");
  std::vector<Vector3> points(vertex->count);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {columns[0]->values[i], columns[1]->values[i], columns[2]->values[i]};
  return points;
}

[[noreturn]] void fail_ending(const fs::path& path) {
  fail({path}, "a point cloud with the ending \"" + path.extension().string() + "\"", ".ply or .pcd",
       "convert the file");
}

std::size_t ply_point_count(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || is_folder(path)) fail({path}, "the file cannot be read", "a point cloud", "check the path");
  std::string line;
  std::getline(stream, line);
  if (!line.starts_with("ply")) fail({path, 1, 0}, "the first line is not \"ply\"", "a PLY file");
  for (int number = 2; std::getline(stream, line) && number < 200; ++number) {
    std::istringstream words(line);
    std::string keyword, name;
    std::size_t count = 0;
    words >> keyword >> name >> count;
    if (keyword == "element" && name == "vertex") return count;
    if (keyword == "end_header") break;
  }
  fail({path}, "the header has no element \"vertex\"", "a point cloud");
}

}  // namespace

std::vector<Vector3> read_points(const fs::path& path) {
  std::vector<Vector3> points;
  if (ending_of(path) == ".ply") {
    points = ply_positions(path);
  } else if (ending_of(path) == ".pcd") {
    const std::string content = read_file(path);
    points = PcdReader(path, content).points();
  } else {
    fail_ending(path);
  }
  std::erase_if(points, [](const Vector3& point) { return !point.allFinite(); });
  if (points.empty())
    fail({path}, "the file has no finite point", "a point cloud", "leave out frames without points with `every`");
  return points;
}

std::size_t read_point_count(const fs::path& path) {
  if (ending_of(path) == ".ply") return ply_point_count(path);
  if (ending_of(path) != ".pcd") fail_ending(path);
  const std::string content = read_file(path);
  return PcdReader(path, content).header().points;
}

void write_points(const fs::path& path, std::span<const Vector3> points) {
  write_file(path, [&](std::ostream& stream) {
    stream << "ply\nformat binary_little_endian 1.0\nelement vertex " << points.size()
           << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    for (const Vector3& point : points) {
      const std::array<float, 3> xyz = {float(point.x()), float(point.y()), float(point.z())};
      stream.write(reinterpret_cast<const char*>(xyz.data()), sizeof xyz);
    }
  });
}

}  // namespace pliant
