#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/types.hpp"

// Volume meshes and their data in VTK's XML format, which ParaView, PyVista and meshio open. The small part of the
// format that is needed here is written by ourselves: VTK's own library is 264 packages on Debian, which is much to
// ask of everyone who builds the program for two file types of a few XML elements each.

namespace pliant {

/// Kinds of cells with VTK's own numbers. A grid has cells of one kind.
enum class VtuCell { Triangle = 5, Tetrahedron = 10, Hexahedron = 12, QuadraticTetrahedron = 24 };

/// Points of a cell: 3, 4, 8 or 10.
int corner_count(VtuCell kind);

/// Values at points or cells: row by row, `components` a row (1 scalar, 3 vector, 6 symmetric tensor in VTK's order
/// xx yy zz xy yz xz, 9 full tensor row by row).
struct VtuArray {
  std::string name;  ///< with the unit for people, like "youngs_modulus [Pa]"
  int components = 1;
  std::vector<double> values;
};

struct VtuGrid {
  Points points;  ///< [m], n x 3
  VtuCell kind = VtuCell::Hexahedron;
  std::vector<int> connectivity;  ///< corner_count(kind) point numbers a cell, in VTK's order (see to_vtk_order)
  std::vector<VtuArray> point_data, cell_data;

  int cell_count() const { return int(connectivity.size()) / corner_count(kind); }
  /// The array of the cells of that name, or null.
  const VtuArray* find_cell_data(const std::string& name) const;
};

/// Precision of the values in a file; points are always written in double precision.
enum class VtuPrecision { Single, Double };

/// A cell's points in VTK's order, from the orders used here: hexahedra i + 2 j + 4 k (VTK goes around the bottom, then
/// around the top), mid-edge points of quadratic tetrahedra 01 02 03 12 13 23 (VTK: 01 12 02 03 13 23).
std::vector<int> to_vtk_order(VtuCell kind, std::span<const int> points);
/// And back.
std::vector<int> from_vtk_order(VtuCell kind, std::span<const int> points);

/// Writes `.vtu`: XML with base64 arrays, little endian, whole or not at all.
/// Throws std::invalid_argument where an array's length does not fit or a cell names a point that is not there, and
/// InputError where the file cannot be written.
void write_vtu(const std::filesystem::path& path, const VtuGrid& grid, VtuPrecision precision = VtuPrecision::Double);

/// Reads a grid in any of VTK's codings. Throws InputError with the file's name and what is wrong in it: not XML, cut
/// off, arrays of another length, several kinds of cells.
VtuGrid read_vtu(const std::filesystem::path& path);

/// One time of a collection.
struct PvdEntry {
  double time = 0.0;           ///< [s]
  std::filesystem::path file;  ///< as written in the collection: relative to its folder
};

/// Writes `.pvd`: the list of files of a motion with their times.
void write_pvd(const std::filesystem::path& path, const std::vector<PvdEntry>& entries);

}  // namespace pliant
