#include "geometry/ply.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <optional>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

enum class Scalar { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64 };
enum class Encoding { Text, LittleEndian, BigEndian };

struct Layout {
  Scalar count_type = Scalar::UInt8;  // of a list
  Scalar type = Scalar::Float32;
};

struct Header {
  Encoding encoding = Encoding::Text;
  PlyFile file;
  std::vector<std::vector<Layout>> layouts;  // [element][property]
  std::size_t body = 0;                      // first byte behind end_header
  int lines = 0;
};

std::optional<Scalar> scalar_named(std::string_view name) {
  static constexpr std::pair<std::string_view, Scalar> names[] = {
      {"char", Scalar::Int8},      {"int8", Scalar::Int8},       {"uchar", Scalar::UInt8},
      {"uint8", Scalar::UInt8},    {"short", Scalar::Int16},     {"int16", Scalar::Int16},
      {"ushort", Scalar::UInt16},  {"uint16", Scalar::UInt16},   {"int", Scalar::Int32},
      {"int32", Scalar::Int32},    {"uint", Scalar::UInt32},     {"uint32", Scalar::UInt32},
      {"float", Scalar::Float32},  {"float32", Scalar::Float32}, {"double", Scalar::Float64},
      {"float64", Scalar::Float64}};
  for (const auto& [known, scalar] : names)
    if (known == name) return scalar;
  return std::nullopt;
}

std::size_t size_of(Scalar scalar) {
  switch (scalar) {
    case Scalar::Int8:
    case Scalar::UInt8:
      return 1;
    case Scalar::Int16:
    case Scalar::UInt16:
      return 2;
    case Scalar::Float64:
      return 8;
    default:
      return 4;
  }
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (std::size_t at = 0; at < line.size();) {
    const std::size_t begin = line.find_first_not_of(" \t\r", at);
    if (begin == std::string_view::npos) break;
    const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    at = end;
  }
  return words;
}

std::optional<double> number_in(std::string_view word) {
  double value = 0.0;
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

std::string in_quotes(std::string_view text) {
  return "\"" + std::string(text.substr(0, 60)) + (text.size() > 60 ? "…\"" : "\"");
}

class Reader {
 public:
  Reader(const fs::path& path, std::string_view content) : path_(path), content_(content) {}

  PlyFile read() {
    read_header();
    for (std::size_t e = 0; e < header_.file.elements.size(); ++e) read_element(e);
    return std::move(header_.file);
  }

 private:
  [[noreturn]] void fail(std::string found, std::string expected, std::string advice = "") const {
    throw InputError({{path_, line_, 0}, std::move(found), std::move(expected), std::move(advice)});
  }

  [[noreturn]] void fail_short(const PlyElement& element, std::size_t row) const {
    throw InputError(
        {{path_, line_, 0},
         "the file ends in " + element.name + " " + std::to_string(row) + " of " + std::to_string(element.count),
         std::to_string(element.count) + " rows of " + in_quotes(element.name) + ", as its header says",
         "the file was cut short; write or copy it again"});
  }

  std::optional<std::string_view> next_line() {
    if (at_ >= content_.size()) return std::nullopt;
    const std::size_t end = std::min(content_.find('\n', at_), content_.size());
    const std::string_view line = content_.substr(at_, end - at_);
    at_ = std::min(end + 1, content_.size());
    ++line_;
    return line;
  }

  void read_header() {
    if (content_.empty()) fail("the file is empty", "a PLY file");
    const auto magic = next_line();
    if (words_of(*magic) != std::vector<std::string_view>{"ply"})
      fail("the file begins with " + in_quotes(printable(*magic)), "the line \"ply\"", "check that this is a PLY file");
    bool has_format = false;
    for (auto line = next_line(); line; line = next_line()) {
      const auto words = words_of(*line);
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "end_header") {
        if (!has_format) fail("the header names no format", "a line like \"format binary_little_endian 1.0\"");
        return;
      }
      if (words[0] == "format") {
        read_format(words);
        has_format = true;
      } else if (words[0] == "element") {
        read_element_declaration(words);
      } else if (words[0] == "property") {
        read_property_declaration(words);
      } else {
        fail("the header line " + in_quotes(printable(*line)), "format, element, property, comment or end_header");
      }
    }
    fail("the file ends inside its header", "the line \"end_header\"",
         "the file was cut short; write or copy it again");
  }

  static std::string printable(std::string_view text) {
    std::string result(text.substr(0, 64));
    for (char& c : result)
      if (static_cast<unsigned char>(c) < 32 || static_cast<unsigned char>(c) > 126) c = '?';
    return result;
  }

  void read_format(const std::vector<std::string_view>& words) {
    const std::string_view name = words.size() > 1 ? words[1] : "";
    if (name == "ascii")
      header_.encoding = Encoding::Text;
    else if (name == "binary_little_endian")
      header_.encoding = Encoding::LittleEndian;
    else if (name == "binary_big_endian")
      header_.encoding = Encoding::BigEndian;
    else
      fail("format " + in_quotes(name), "ascii, binary_little_endian or binary_big_endian");
  }

  void read_element_declaration(const std::vector<std::string_view>& words) {
    const auto count = words.size() == 3 ? number_in(words[2]) : std::nullopt;
    if (!count || *count < 0 || *count != std::floor(*count) || *count > 4e9)
      fail("an element line without a count", "a line like \"element vertex 1200\"");
    // Each row takes a byte at least: a larger count is a broken header, and must not become a huge allocation.
    if (*count > double(content_.size()))
      fail("the header promises " + std::string(words[2]) + " rows of " + in_quotes(words[1]) + " in a file of " +
               std::to_string(content_.size()) + " bytes",
           "", "the file was cut short or its header is wrong");
    header_.file.elements.push_back({std::string(words[1]), std::size_t(*count), {}});
    header_.layouts.emplace_back();
  }

  void read_property_declaration(const std::vector<std::string_view>& words) {
    if (header_.file.elements.empty()) fail("a property before any element", "an element line first");
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (!is_list && words.size() != 3) fail("a property line of " + std::to_string(words.size()) + " words", property_);
    const auto count_type = is_list ? scalar_named(words[2]) : std::optional(Scalar::UInt8);
    const auto type = scalar_named(words[is_list ? 3 : 1]);
    if (!count_type || !type)
      fail("the type " + in_quotes(words[is_list ? (count_type ? 3 : 2) : 1]),
           "char, uchar, short, ushort, int, uint, float or double");
    header_.file.elements.back().properties.push_back({std::string(words.back()), is_list, {}, {}});
    header_.layouts.back().push_back({*count_type, *type});
  }

  void read_element(std::size_t e) {
    PlyElement& element = header_.file.elements[e];
    if (element.properties.empty()) return;
    const std::size_t most_rows = (content_.size() - at_) / row_bytes(e);
    for (PlyProperty& property : element.properties) {
      property.values.reserve(std::min(element.count, most_rows));
      if (property.is_list) property.offsets.push_back(0);
    }
    const bool text = header_.encoding == Encoding::Text;
    if (!text) line_ = 0;
    for (std::size_t row = 0; row < element.count; ++row)
      for (std::size_t p = 0; p < element.properties.size(); ++p)
        read_value(element, row, element.properties[p], header_.layouts[e][p]);
  }

  /// The least that a row takes: of text a character a value, of lists their lengths.
  std::size_t row_bytes(std::size_t e) const {
    std::size_t bytes = 0;
    for (std::size_t p = 0; p < header_.layouts[e].size(); ++p) {
      const Layout& layout = header_.layouts[e][p];
      const bool is_list = header_.file.elements[e].properties[p].is_list;
      bytes += header_.encoding == Encoding::Text ? 1 : size_of(is_list ? layout.count_type : layout.type);
    }
    return bytes;
  }

  void read_value(const PlyElement& element, std::size_t row, PlyProperty& property, const Layout& layout) {
    if (!property.is_list) {
      property.values.push_back(read_scalar(element, row, layout.type));
      return;
    }
    const double count = read_scalar(element, row, layout.count_type);
    if (!(count >= 0) || count != std::floor(count))
      fail(element.name + " " + std::to_string(row) + " has a list of length " + std::to_string(count),
           "a whole number");
    if (count > double(content_.size() - at_)) fail_short(element, row);
    for (std::size_t i = 0; i < std::size_t(count); ++i)
      property.values.push_back(read_scalar(element, row, layout.type));
    property.offsets.push_back(property.values.size());
  }

  double read_scalar(const PlyElement& element, std::size_t row, Scalar type) {
    return header_.encoding == Encoding::Text ? read_word(element, row) : read_binary(element, row, type);
  }

  double read_word(const PlyElement& element, std::size_t row) {
    constexpr std::string_view space = " \t\r\n";
    while (at_ < content_.size() && space.find(content_[at_]) != std::string_view::npos) {
      if (content_[at_] == '\n') ++line_;
      ++at_;
    }
    if (at_ >= content_.size()) fail_short(element, row);
    const std::size_t end = std::min(content_.find_first_of(space, at_), content_.size());
    const std::string_view word = content_.substr(at_, end - at_);
    at_ = end;
    const auto value = number_in(word);
    // In the body the current line has not been ended yet: it is one beyond the lines counted.
    if (!value) {
      ++line_;
      fail(in_quotes(printable(word)) + " in " + element.name + " " + std::to_string(row), "a number");
    }
    return *value;
  }

  double read_binary(const PlyElement& element, std::size_t row, Scalar type) {
    const std::size_t size = size_of(type);
    if (content_.size() - at_ < size) fail_short(element, row);
    unsigned char bytes[8];
    std::memcpy(bytes, content_.data() + at_, size);
    at_ += size;
    const bool file_is_little = header_.encoding == Encoding::LittleEndian;
    if (file_is_little != (std::endian::native == std::endian::little)) std::reverse(bytes, bytes + size);
    switch (type) {
      case Scalar::Int8:
        return as<std::int8_t>(bytes);
      case Scalar::UInt8:
        return as<std::uint8_t>(bytes);
      case Scalar::Int16:
        return as<std::int16_t>(bytes);
      case Scalar::UInt16:
        return as<std::uint16_t>(bytes);
      case Scalar::Int32:
        return as<std::int32_t>(bytes);
      case Scalar::UInt32:
        return as<std::uint32_t>(bytes);
      case Scalar::Float32:
        return as<float>(bytes);
      case Scalar::Float64:
        break;
    }
    return as<double>(bytes);
  }

  template <class T>
  static double as(const unsigned char* bytes) {
    T value;
    std::memcpy(&value, bytes, sizeof value);
    return double(value);
  }

  static constexpr const char* property_ = "\"property float x\" or \"property list uchar int vertex_indices\"";

  const fs::path& path_;
  std::string_view content_;
  std::size_t at_ = 0;
  int line_ = 0;
  Header header_;
};

template <class Range>
auto* find_named(Range& range, std::string_view name) {
  const auto found = std::ranges::find(range, name, [](const auto& item) -> std::string_view { return item.name; });
  return found == range.end() ? nullptr : &*found;
}

}  // namespace

const PlyProperty* PlyElement::property(std::string_view wanted) const { return find_named(properties, wanted); }
const PlyElement* PlyFile::element(std::string_view wanted) const { return find_named(elements, wanted); }

PlyFile read_ply(const fs::path& path) {
  const std::string content = read_file(path);
  return Reader(path, content).read();
}

std::vector<Eigen::Vector3d> ply_points(const PlyFile& ply, const fs::path& path) {
  const PlyElement* vertex = ply.element("vertex");
  if (!vertex) throw InputError({{path}, "the file has no element \"vertex\"", "points with x, y and z", ""});
  const PlyProperty* columns[3];
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, char('x' + axis));
    columns[axis] = vertex->property(name);
    if (!columns[axis] || columns[axis]->is_list)
      throw InputError({{path}, "the vertices have no property \"" + name + "\"", "x, y and z", ""});
  }
  std::vector<Eigen::Vector3d> points(vertex->count);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (int axis = 0; axis < 3; ++axis) points[i][axis] = columns[axis]->values[i];
    if (!points[i].allFinite())
      throw InputError({{path},
                        "vertex " + std::to_string(i) + " is not finite",
                        "numbers of metres",
                        "remove such points when the file is written"});
  }
  return points;
}

}  // namespace pliant
