#include "model/vtu.hpp"

#include <bit>
#include <cstdint>
#include <cstring>
#include <pugixml.hpp>
#include <span>
#include <sstream>
#include <stdexcept>

#include "base/base64.hpp"
#include "base/error.hpp"
#include "base/files.hpp"
#include "geometry/vtk_xml.hpp"

namespace pliant {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "arrays are written in the machine's own byte order");

namespace {

[[noreturn]] void fail(const fs::path& path, const std::string& found, const std::string& expected) {
  throw InputError({{path}, found, expected, "write the file again with pliant"});
}

// ---- writing

template <class T>
std::string encode(std::span<const T> values) {
  const uint64_t bytes = values.size_bytes();
  std::string raw(sizeof bytes + bytes, '\0');
  std::memcpy(raw.data(), &bytes, sizeof bytes);
  if (bytes > 0) std::memcpy(raw.data() + sizeof bytes, values.data(), bytes);
  return encode_base64(raw);
}

template <class T>
void append_array(pugi::xml_node parent, const char* type, const std::string& name, int components,
                  std::span<const T> values) {
  pugi::xml_node array = parent.append_child("DataArray");
  array.append_attribute("type") = type;
  array.append_attribute("Name") = name.c_str();
  if (components != 1) array.append_attribute("NumberOfComponents") = components;
  array.append_attribute("format") = "binary";
  array.text().set(encode(values).c_str());
}

void append_data(pugi::xml_node parent, const VtuArray& array, VtuPrecision precision) {
  if (precision == VtuPrecision::Double)
    return append_array<double>(parent, "Float64", array.name, array.components, array.values);
  const std::vector<float> single(array.values.begin(), array.values.end());
  append_array<float>(parent, "Float32", array.name, array.components, single);
}

void append_cells(pugi::xml_node piece, const VtuGrid& grid) {
  const int cells = grid.cell_count(), corners = corner_count(grid.kind);
  std::vector<int64_t> offsets(cells);
  for (int i = 0; i < cells; ++i) offsets[i] = int64_t(i + 1) * corners;
  const std::vector<int64_t> connectivity(grid.connectivity.begin(), grid.connectivity.end());
  const std::vector<uint8_t> types(cells, uint8_t(grid.kind));
  pugi::xml_node node = piece.append_child("Cells");
  append_array<int64_t>(node, "Int64", "connectivity", 1, connectivity);
  append_array<int64_t>(node, "Int64", "offsets", 1, offsets);
  append_array<uint8_t>(node, "UInt8", "types", 1, types);
}

void check_arrays(const std::vector<VtuArray>& arrays, int rows, const char* where) {
  for (const VtuArray& array : arrays) {
    const bool good_components =
        array.components == 1 || array.components == 3 || array.components == 6 || array.components == 9;
    if (!good_components || array.values.size() != size_t(rows) * array.components)
      throw std::invalid_argument(
          std::string("write_vtu: ") + where + " \"" + array.name + "\" has " + std::to_string(array.values.size()) +
          " values of " + std::to_string(array.components) + " components for " + std::to_string(rows) + " rows");
  }
}

void check(const VtuGrid& grid) {
  if (grid.connectivity.size() % corner_count(grid.kind) != 0)
    throw std::invalid_argument("write_vtu: the connectivity does not divide into cells");
  for (const int point : grid.connectivity)
    if (point < 0 || point >= grid.points.rows())
      throw std::invalid_argument("write_vtu: a cell names point " + std::to_string(point) + " of " +
                                  std::to_string(grid.points.rows()));
  check_arrays(grid.point_data, int(grid.points.rows()), "point data");
  check_arrays(grid.cell_data, grid.cell_count(), "cell data");
}

pugi::xml_node append_root(pugi::xml_document& document, const char* type) {
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  pugi::xml_node root = document.append_child("VTKFile");
  root.append_attribute("type") = type;
  root.append_attribute("version") = "1.0";
  root.append_attribute("byte_order") = "LittleEndian";
  root.append_attribute("header_type") = "UInt64";
  return root;
}

void save(const fs::path& path, const pugi::xml_document& document) {
  write_file(path, [&](std::ostream& stream) { document.save(stream, " "); });
}

// ---- reading

class GridReader {
 public:
  explicit GridReader(const fs::path& path) : path_(path), file_(path, "UnstructuredGrid") {}

  VtuGrid grid() const {
    if (!piece() || piece().next_sibling("Piece")) fail(path_, "not exactly one piece", "one piece");
    return grid(piece());
  }

 private:
  pugi::xml_node piece() const { return file_.data_set().child("Piece"); }
  VtuGrid grid(pugi::xml_node piece) const {
    VtuGrid grid;
    const int points = count(piece, "NumberOfPoints"), cells = count(piece, "NumberOfCells");
    const VtuArray positions = array(piece.child("Points").child("DataArray"), points);
    if (positions.components != 3) fail(path_, "points that are not of 3 components", "x y z");
    grid.points = Eigen::Map<const Points>(positions.values.data(), points, 3);
    read_cells(piece.child("Cells"), cells, grid);
    grid.point_data = arrays(piece.child("PointData"), points);
    grid.cell_data = arrays(piece.child("CellData"), cells);
    return grid;
  }

  int count(pugi::xml_node piece, const char* attribute) const {
    const long long value = piece.attribute(attribute).as_llong(-1);
    if (value < 0 || value > 1'000'000'000) fail(path_, std::string("no sensible ") + attribute, "a count");
    return int(value);
  }

  std::vector<VtuArray> arrays(pugi::xml_node parent, int rows) const {
    std::vector<VtuArray> result;
    for (const pugi::xml_node node : parent.children("DataArray")) result.push_back(array(node, rows));
    return result;
  }

  VtuArray array(pugi::xml_node node, int rows) const {
    VtuArray array{node.attribute("Name").value(), node.attribute("NumberOfComponents").as_int(1), {}};
    if (array.components < 1) fail(path_, "array \"" + array.name + "\" without components", "at least one");
    array.values = file_.values(node, std::size_t(rows) * std::size_t(array.components), '"' + array.name + '"').of;
    return array;
  }

  VtuArray named(pugi::xml_node parent, const char* name, int rows) const {
    const pugi::xml_node node = parent.find_child_by_attribute("DataArray", "Name", name);
    if (!node)
      fail(path_, std::string("the array \"") + name + "\" is missing", "points, connectivity, offsets and types");
    return array(node, rows);
  }

  void read_cells(pugi::xml_node node, int cells, VtuGrid& grid) const {
    const VtuArray types = named(node, "types", cells), offsets = named(node, "offsets", cells);
    const double kind = cells > 0 ? types.values[0] : double(VtuCell::Hexahedron);
    if (kind != 5 && kind != 10 && kind != 12 && kind != 24)
      fail(path_, "cells of VTK type " + text_of_number(kind),
           "triangles (5), tetrahedra (10 or, quadratic, 24) or hexahedra (12)");
    grid.kind = VtuCell(int(kind));
    const int corners = corner_count(grid.kind);
    for (int i = 0; i < cells; ++i)
      if (types.values[i] != kind || offsets.values[i] != double(i + 1) * corners)
        fail(path_, "several kinds of cells (cell " + std::to_string(i) + ")", "one kind");
    for (const double value : named(node, "connectivity", cells * corners).values) {
      if (!(value >= 0.0 && value < double(grid.points.rows())))
        fail(path_, "a cell with point " + std::to_string(value),
             "a point below " + std::to_string(grid.points.rows()));
      grid.connectivity.push_back(int(value));
    }
  }

  fs::path path_;
  VtkXmlFile file_;
};

}  // namespace

int corner_count(VtuCell kind) {
  switch (kind) {
    case VtuCell::Triangle:
      return 3;
    case VtuCell::Tetrahedron:
      return 4;
    case VtuCell::QuadraticTetrahedron:
      return 10;
    case VtuCell::Hexahedron:
      break;
  }
  return 8;
}

const VtuArray* VtuGrid::find_cell_data(const std::string& name) const {
  for (const VtuArray& array : cell_data)
    if (array.name == name) return &array;
  return nullptr;
}

namespace {
/// Which of our points stands at each place of VTK's order; nothing: the orders agree.
std::span<const int> vtk_places(VtuCell kind) {
  static constexpr std::array hexahedron = {0, 1, 3, 2, 4, 5, 7, 6};
  static constexpr std::array quadratic_tetrahedron = {0, 1, 2, 3, 4, 7, 5, 6, 8, 9};
  if (kind == VtuCell::Hexahedron) return hexahedron;
  if (kind == VtuCell::QuadraticTetrahedron) return quadratic_tetrahedron;
  return {};
}
}  // namespace

std::vector<int> to_vtk_order(VtuCell kind, std::span<const int> points) {
  std::vector<int> ordered(points.begin(), points.end());
  const auto places = vtk_places(kind);
  for (std::size_t i = 0; i < places.size(); ++i) ordered[i] = points[std::size_t(places[i])];
  return ordered;
}

std::vector<int> from_vtk_order(VtuCell kind, std::span<const int> points) {
  std::vector<int> ordered(points.begin(), points.end());
  const auto places = vtk_places(kind);
  for (std::size_t i = 0; i < places.size(); ++i) ordered[std::size_t(places[i])] = points[i];
  return ordered;
}

void write_vtu(const fs::path& path, const VtuGrid& grid, VtuPrecision precision) {
  check(grid);
  pugi::xml_document document;
  pugi::xml_node piece =
      append_root(document, "UnstructuredGrid").append_child("UnstructuredGrid").append_child("Piece");
  piece.append_attribute("NumberOfPoints") = (long long)grid.points.rows();
  piece.append_attribute("NumberOfCells") = grid.cell_count();
  append_array<double>(piece.append_child("Points"), "Float64", "points", 3,
                       {grid.points.data(), size_t(grid.points.size())});
  append_cells(piece, grid);
  pugi::xml_node point_data = piece.append_child("PointData"), cell_data = piece.append_child("CellData");
  for (const VtuArray& array : grid.point_data) append_data(point_data, array, precision);
  for (const VtuArray& array : grid.cell_data) append_data(cell_data, array, precision);
  save(path, document);
}

VtuGrid read_vtu(const fs::path& path) { return GridReader(path).grid(); }

void write_pvd(const fs::path& path, const std::vector<PvdEntry>& entries) {
  pugi::xml_document document;
  pugi::xml_node collection = append_root(document, "Collection").append_child("Collection");
  for (const PvdEntry& entry : entries) {
    pugi::xml_node node = collection.append_child("DataSet");
    std::ostringstream time;
    time.precision(12);
    time << entry.time;
    node.append_attribute("timestep") = time.str().c_str();
    node.append_attribute("group") = "";
    node.append_attribute("part") = "0";
    node.append_attribute("file") = entry.file.generic_string().c_str();
  }
  save(path, document);
}

}  // namespace pliant
