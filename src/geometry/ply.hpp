#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace pliant {

/// One column of a PLY element, widened to double (every PLY number fits exactly).
struct PlyProperty {
  std::string name;
  bool is_list = false;
  std::vector<double> values;        ///< of all rows one after another
  std::vector<std::size_t> offsets;  ///< of a list: row r owns values[offsets[r]] .. values[offsets[r + 1]]
};

/// A table of a PLY file: its vertices, its faces.
struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;

  /// Nothing where there is no such column.
  const PlyProperty* property(std::string_view name) const;
};

/// All tables of a PLY file in the order of the file.
struct PlyFile {
  std::vector<PlyElement> elements;
  const PlyElement* element(std::string_view name) const;
};

/// Reads a whole PLY file: text, binary of both byte orders, any types and any elements.
/// Throws InputError that names line (text, header) or row (binary) where the file is cut short or malformed.
PlyFile read_ply(const std::filesystem::path& path);

/// The columns x, y, z of the element "vertex" as points [m], finite all of them.
/// Throws InputError where there are none, or where one is not a finite number.
std::vector<Eigen::Vector3d> ply_points(const PlyFile& ply, const std::filesystem::path& path);

}  // namespace pliant
