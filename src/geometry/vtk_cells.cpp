// VTK's unstructured grids: legacy files, text or binary, and XML files.
#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <map>

#include "base/files.hpp"
#include "geometry/raw_cells.hpp"
#include "geometry/text_tokens.hpp"
#include "geometry/vtk_xml.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little);

template <class T>
double value_at(const char* bytes, bool big_endian) {
  char raw[sizeof(T)];
  std::memcpy(raw, bytes, sizeof(T));
  if (big_endian) std::reverse(raw, raw + sizeof(T));
  T value;
  std::memcpy(&value, raw, sizeof(T));
  return double(value);
}

struct NumberType {
  std::size_t size;
  double (*value_at)(const char* bytes, bool big_endian);
};

template <class T>
constexpr NumberType number_type = {sizeof(T), value_at<T>};

const std::map<std::string, NumberType> number_types = {
    {"Float64", number_type<double>},     {"Float32", number_type<float>},
    {"Int64", number_type<std::int64_t>}, {"UInt64", number_type<std::uint64_t>},
    {"Int32", number_type<std::int32_t>}, {"UInt32", number_type<std::uint32_t>},
    {"Int16", number_type<std::int16_t>}, {"UInt16", number_type<std::uint16_t>},
    {"Int8", number_type<std::int8_t>},   {"UInt8", number_type<std::uint8_t>}};

/// Points and cells from what both formats give: the cells' ends in the connectivity, and their types.
class Assembler {
 public:
  explicit Assembler(fs::path path) : path_(std::move(path)) {}

  RawCells cells;

  void add_points(const VtkValues& values) {
    for (std::size_t i = 0; i + 2 < values.of.size(); i += 3) {
      cells.nodes.emplace_back(values.of[i], values.of[i + 1], values.of[i + 2]);
      cells.node_lines.push_back(values.line(i));
      if (!cells.nodes.back().allFinite())
        throw InputError({{path_, values.line(i), 0},
                          "point " + std::to_string(i / 3) + " is not finite",
                          "three finite numbers",
                          "export the mesh again"});
    }
  }
  void add_cell(std::size_t number, double type, const VtkValues& connectivity, std::size_t begin, std::size_t end) {
    const Place place{path_, begin < end ? connectivity.line(begin) : 0, 0};
    const VtkKind kind = vtk_kind(type, place);
    const std::string label = "cell " + std::to_string(number);
    if (kind.nodes > 0 && end - begin != std::size_t(kind.nodes))
      throw InputError({place, label + ", a " + kind.name + ", has " + std::to_string(end - begin) + " points",
                        std::to_string(kind.nodes), "export the mesh again"});
    RawCells::Cell cell{kind.kind, kind.name, place.line, {}};
    for (std::size_t i = begin; i < end; ++i) {
      const double point = connectivity.of[i];
      if (!(point >= 0.0 && point < double(cells.nodes.size()) && point == std::floor(point)))
        throw InputError({{path_, connectivity.line(i), 0},
                          label + " names point " + text_of_number(point),
                          "0 to " + text_of_number(double(cells.nodes.size()) - 1.0),
                          "export the mesh again"});
      cell.nodes.push_back(int(point));
    }
    reorder_from_vtk(cell);
    cells.cells.push_back(std::move(cell));
  }

 private:
  fs::path path_;
};

class LegacyReader {
 public:
  LegacyReader(const std::string& content, const fs::path& path) : text_(content, path), path_(path), result_(path) {}

  RawCells read() {
    const std::string heading(text_.rest_of_line());
    if (!heading.starts_with("# vtk DataFile Version "))
      throw InputError({{path_, 1, 1},
                        "\"" + heading.substr(0, 40) + "\"",
                        "\"# vtk DataFile Version ...\"",
                        "check that this is a legacy VTK file"});
    has_offsets_ = heading.size() > 23 && heading[23] >= '5';
    text_.rest_of_line();  // a title
    const std::string coding(text_.word("ASCII or BINARY"));
    if (coding != "ASCII" && coding != "BINARY") text_.fail_word(coding, "ASCII or BINARY");
    is_binary_ = coding == "BINARY";
    if (const auto word = text_.word("DATASET"); word != "DATASET") text_.fail_word(word, "DATASET");
    if (const auto word = text_.word("UNSTRUCTURED_GRID"); word != "UNSTRUCTURED_GRID")
      text_.fail_word(word, "UNSTRUCTURED_GRID: the cells of a volume");
    while (types_.empty() || ends_.empty()) read_part();
    if (types_.size() != ends_.size())
      throw InputError({{path_},
                        std::to_string(types_.size()) + " cell types of " + std::to_string(ends_.size()) + " cells",
                        "one a cell",
                        "export the mesh again"});
    for (std::size_t c = 0; c < ends_.size(); ++c)
      result_.add_cell(c, types_[c], connectivity_, ends_[c].first, ends_[c].second);
    return std::move(result_.cells);
  }

 private:
  void read_part() {
    const std::string part(text_.word("POINTS, CELLS and CELL_TYPES"));
    if (part == "METADATA") {
      skip_metadata();
    } else if (part == "FIELD") {
      skip_fields();
    } else if (part == "POINTS") {
      const std::size_t count = text_.count("the number of points");
      const std::string type = xml_type(std::string(text_.word("the points' type")));
      result_.add_points(values(3 * count, type, "the points"));
    } else if (part == "CELLS") {
      const std::size_t count = text_.count("the number of cells"), size = text_.count("the size of the list of cells");
      has_offsets_ ? read_offsets(count, size) : read_cells(count, size);
      if (ends_.empty()) text_.fail_at("no cells", "tetrahedra");
    } else if (part == "CELL_TYPES") {
      types_ = values(text_.count("the number of cells"), "Int32", "the cells' types").of;
      if (types_.empty()) text_.fail_at("no cells", "tetrahedra");
    } else {
      text_.fail_word(part, "POINTS, CELLS or CELL_TYPES");
    }
  }
  /// Arrays about the whole data set, like its time.
  void skip_fields() {
    text_.word("the field's name");
    const std::size_t arrays = text_.count("the number of arrays");
    for (std::size_t a = 0; a < arrays; ++a) {
      if (text_.word("an array's name") == "METADATA") skip_metadata(), text_.word("an array's name");
      const std::size_t components = text_.count("the number of components"), rows = text_.count("the number of rows");
      const std::string type(text_.word("the numbers' type"));
      if (components > 0 && rows > text_.most_count() / components)
        text_.fail_at("an array of " + std::to_string(rows) + " rows", "what the file can hold");
      if (type == "string")
        skip_strings(components * rows);
      else
        values(components * rows, xml_type(type), "an array");
    }
  }
  /// Text has a line each. Binary ones have their length before them: of 1, 2, 4 or 8 bytes by the two highest bits.
  void skip_strings(std::size_t count) {
    text_.rest_of_line();
    for (std::size_t i = 0; i < count; ++i) {
      if (!is_binary_) {
        text_.rest_of_line();
        continue;
      }
      const auto first = static_cast<unsigned char>(text_.bytes(1, "a text").front());
      std::size_t length = first & 0x3FU;
      for (const char byte : text_.bytes((1U << (3U - (first >> 6U))) - 1U, "a text"))
        length = length << 8U | static_cast<unsigned char>(byte);
      text_.bytes(length, "a text");
    }
  }
  void skip_metadata() {  // as far as the next empty line
    text_.rest_of_line();
    while (text_.rest_of_line().find_first_not_of(" \r\t") != std::string_view::npos) {
    }
  }
  void read_cells(std::size_t count, std::size_t size) {
    connectivity_ = values(size, "Int32", "the cells");
    std::size_t at = 0;
    for (std::size_t c = 0; c < count; ++c) {
      if (at >= size || !(connectivity_.of[at] >= 0.0 && double(at) + connectivity_.of[at] < double(size)))
        throw InputError({{path_, connectivity_.line(std::min(at, size - 1)), 0},
                          "cell " + std::to_string(c) + " runs over the end of the list of cells",
                          "a list of " + std::to_string(size) + " numbers for " + std::to_string(count) + " cells",
                          "export the mesh again"});
      const auto nodes = std::size_t(connectivity_.of[at]);
      ends_.emplace_back(at + 1, at + 1 + nodes);
      at += 1 + nodes;
    }
  }
  /// Version 5: one more offset than cells.
  void read_offsets(std::size_t count, std::size_t size) {
    const auto list = [&](const char* name, std::size_t length) {
      if (const auto word = text_.word(name); word != name) text_.fail_word(word, name);
      const std::string type = xml_type(std::string(text_.word("the numbers' type")));
      return values(length, type, name);
    };
    const VtkValues offsets = list("OFFSETS", count);
    connectivity_ = list("CONNECTIVITY", size);
    for (std::size_t c = 0; c + 1 < offsets.of.size(); ++c) {
      if (!(offsets.of[c] >= 0.0 && offsets.of[c] <= offsets.of[c + 1] && offsets.of[c + 1] <= double(size)))
        throw InputError({{path_, offsets.line(c), 0},
                          "offsets of cell " + std::to_string(c) + " that do not ascend",
                          "offsets from 0 to " + std::to_string(size),
                          "export the mesh again"});
      ends_.emplace_back(std::size_t(offsets.of[c]), std::size_t(offsets.of[c + 1]));
    }
  }
  std::string xml_type(const std::string& legacy) {
    static const std::map<std::string, std::string> names = {{"double", "Float64"},
                                                             {"float", "Float32"},
                                                             {"int", "Int32"},
                                                             {"unsigned_int", "UInt32"},
                                                             {"long", "Int64"},
                                                             {"unsigned_long", "UInt64"},
                                                             {"vtktypeint64", "Int64"},
                                                             {"vtktypeint32", "Int32"},
                                                             {"vtktypeuint64", "UInt64"},
                                                             {"short", "Int16"},
                                                             {"unsigned_short", "UInt16"},
                                                             {"char", "Int8"},
                                                             {"signed_char", "Int8"},
                                                             {"unsigned_char", "UInt8"},
                                                             {"vtkIdType", "Int32"}};
    const auto found = names.find(legacy);
    if (found == names.end()) text_.fail_word(legacy, "a type like float or double");
    return found->second;
  }
  VtkValues values(std::size_t count, const std::string& type, const char* what) {
    VtkValues values;
    if (is_binary_) {
      text_.rest_of_line();
      values.of = *vtk_values(text_.bytes(count * number_types.at(type).size, what), type, true);
      return values;
    }
    const std::string expected = "a number of " + std::string(what);
    for (std::size_t i = 0; i < count; ++i) {
      values.of.push_back(text_.number<double>(expected.c_str()));
      values.lines.push_back(text_.place().line);
    }
    return values;
  }

  TextTokens text_;
  fs::path path_;
  bool is_binary_ = false, has_offsets_ = false;
  Assembler result_;
  VtkValues connectivity_;
  std::vector<std::pair<std::size_t, std::size_t>> ends_;  // of each cell in the connectivity
  std::vector<double> types_;
};

/// The cells of an XML file's pieces.
class XmlReader {
 public:
  explicit XmlReader(const fs::path& path) : file_(path, "UnstructuredGrid"), result_(path) {}

  RawCells read() {
    const pugi::xml_node grid = file_.data_set(), piece = grid.child("Piece");
    if (!piece || piece.next_sibling("Piece")) file_.fail(file_.line_of(grid), "no piece, or several", "one <Piece>");
    const std::size_t points = count(piece, "NumberOfPoints"), cells = count(piece, "NumberOfCells");
    result_.add_points(file_.values(piece.child("Points").child("DataArray"), 3 * points, "points"));
    const VtkValues offsets = cell_array(piece, "offsets", cells), types = cell_array(piece, "types", cells);
    double last = 0.0;
    for (std::size_t c = 0; c < cells; ++c) {
      if (!(offsets.of[c] >= last && offsets.of[c] < 2e9))
        file_.fail(offsets.line(c), "the offset of cell " + std::to_string(c) + " is below the one before",
                   "ascending ones");
      last = offsets.of[c];
    }
    const VtkValues connectivity = cell_array(piece, "connectivity", std::size_t(last));
    for (std::size_t c = 0; c < cells; ++c)
      result_.add_cell(c, types.of[c], connectivity, c == 0 ? 0 : std::size_t(offsets.of[c - 1]),
                       std::size_t(offsets.of[c]));
    return std::move(result_.cells);
  }

 private:
  std::size_t count(pugi::xml_node piece, const char* name) const {
    const long long value = piece.attribute(name).as_llong(-1);
    if (value < 0 || value > 1'000'000'000)
      file_.fail(file_.line_of(piece), std::string("no sensible ") + name, "a count");
    return std::size_t(value);
  }
  VtkValues cell_array(pugi::xml_node piece, const char* name, std::size_t length) const {
    return file_.values(piece.child("Cells").find_child_by_attribute("DataArray", "Name", name), length, name);
  }

  VtkXmlFile file_;
  Assembler result_;
};

}  // namespace

std::optional<std::size_t> vtk_number_size(const std::string& type) {
  const auto found = number_types.find(type);
  return found == number_types.end() ? std::nullopt : std::optional(found->second.size);
}

std::optional<std::vector<double>> vtk_values(std::string_view bytes, const std::string& type, bool big_endian) {
  const auto found = number_types.find(type);
  if (found == number_types.end()) return std::nullopt;
  const auto [size, value_at] = found->second;
  std::vector<double> values;
  for (std::size_t i = 0; i + size <= bytes.size(); i += size) values.push_back(value_at(bytes.data() + i, big_endian));
  return values;
}

VtkKind vtk_kind(double type, const Place& place) {
  static const std::map<double, VtkKind> kinds = {{1, {RawCell::Flat, 1, "vertex"}},
                                                  {2, {RawCell::Flat, 0, "poly-vertex"}},
                                                  {3, {RawCell::Flat, 2, "line"}},
                                                  {4, {RawCell::Flat, 0, "poly-line"}},
                                                  {5, {RawCell::Flat, 3, "triangle"}},
                                                  {6, {RawCell::Flat, 0, "triangle strip"}},
                                                  {7, {RawCell::Flat, 0, "polygon"}},
                                                  {8, {RawCell::Flat, 4, "pixel"}},
                                                  {9, {RawCell::Flat, 4, "quadrangle"}},
                                                  {10, {RawCell::Tetrahedron, 4, "tetrahedron"}},
                                                  {11, {RawCell::OtherSolid, 8, "voxel"}},
                                                  {12, {RawCell::OtherSolid, 8, "hexahedron"}},
                                                  {13, {RawCell::OtherSolid, 6, "wedge"}},
                                                  {14, {RawCell::OtherSolid, 5, "pyramid"}},
                                                  {21, {RawCell::Flat, 3, "quadratic edge"}},
                                                  {22, {RawCell::Flat, 6, "quadratic triangle"}},
                                                  {23, {RawCell::Flat, 8, "quadratic quadrangle"}},
                                                  {24, {RawCell::QuadraticTetrahedron, 10, "quadratic tetrahedron"}}};
  const auto found = kinds.find(type);
  if (found == kinds.end())
    throw InputError({place, "a cell of VTK's type " + text_of_number(type), "tetrahedra (10 or, quadratic, 24)",
                      "export the mesh as tetrahedra"});
  return found->second;
}

void reorder_from_vtk(RawCells::Cell& cell) {
  if (cell.kind != RawCell::QuadraticTetrahedron) return;
  const int m12 = cell.nodes[5], m02 = cell.nodes[6], m03 = cell.nodes[7];
  cell.nodes[5] = m02, cell.nodes[6] = m03, cell.nodes[7] = m12;
}

RawCells read_legacy_vtk(const fs::path& path) {
  const std::string content = read_file(path);
  return LegacyReader(content, path).read();
}

RawCells read_xml_vtk(const fs::path& path) { return XmlReader(path).read(); }

}  // namespace pliant
