#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"

namespace pliant {

/// What a cell of a volume mesh's file is, as far as it matters here.
enum class RawCell { Flat, Tetrahedron, QuadraticTetrahedron, OtherSolid };

/// A volume mesh as its file has it, before anything is judged.
struct RawCells {
  struct Cell {
    RawCell kind = RawCell::Flat;
    std::string name;        ///< of another solid, for people
    int line = 0;            ///< 0: the file has no lines there
    std::vector<int> nodes;  ///< of tetrahedra, as indices into `nodes`, mid nodes in the order 01 02 03 12 13 23
  };
  std::vector<Vector3> nodes;
  std::vector<int> node_lines;  ///< 0: the file has no lines there
  std::vector<Cell> cells;
};

RawCells read_gmsh(const std::filesystem::path& path);
RawCells read_legacy_vtk(const std::filesystem::path& path);
RawCells read_xml_vtk(const std::filesystem::path& path);

/// Bytes of a number of a type by the name that VTK's XML files have for it, like "Float64". Nothing where the type is
/// unknown.
std::optional<std::size_t> vtk_number_size(const std::string& type);

/// Numbers of such a type, widened to double. Nothing where the type is unknown.
std::optional<std::vector<double>> vtk_values(std::string_view bytes, const std::string& type, bool big_endian);

/// The kind of a cell by VTK's number, with the nodes that it has (0: any number).
struct VtkKind {
  RawCell kind;
  int nodes;
  const char* name;
};
/// Throws InputError for a number that VTK does not have, or of a kind that no mesh of tetrahedra holds.
VtkKind vtk_kind(double type, const Place& place);

/// Mid nodes from VTK's order (01 12 02 03 13 23) to ours; nothing happens to other cells.
void reorder_from_vtk(RawCells::Cell& cell);

}  // namespace pliant
