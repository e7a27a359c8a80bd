#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "imports/recording.hpp"

namespace pliant {

/// Lines of a text file taken apart at semicolons, tabs or commas, whichever the file uses; cells without spaces and
/// quotes around them. Lines stand where the file has them: line i + 1 of the file is `lines[i]`.
struct TextTable {
  std::filesystem::path file;
  char separator = ',';
  std::vector<std::vector<std::string>> lines;
};
TextTable read_table(const std::filesystem::path& file);

/// A cell as a finite number; with semicolons or tabs a comma may stand for the point. Nothing: it is none.
std::optional<double> table_number(const TextTable& table, std::size_t line, std::size_t column);

/// A column's title in lower case, and the unit that stands in brackets behind it, or in the line below.
struct ColumnTitle {
  std::string name, unit;
};
ColumnTitle column_title(std::string_view cell);

/// How much one unit is in SI: of lengths [m], forces [N] and stresses [Pa]. Nothing: the unit is unknown.
std::optional<double> length_unit(std::string_view unit);
std::optional<double> force_unit(std::string_view unit);
std::optional<double> stress_unit(std::string_view unit);

}  // namespace pliant
