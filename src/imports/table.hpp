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
  char decimal = '.';  ///< sign before the fraction of its numbers; the other one of '.' and ',' may group thousands
  std::vector<std::vector<std::string>> lines;

  bool is_blank(std::size_t line) const;
  /// A cell, or nothing where its line ends before it.
  std::string_view cell(std::size_t line, std::size_t column) const;
};

/// Reads a text in UTF-8, UTF-16 or Latin-1. Throws InputError where the file cannot be read or is no text.
TextTable read_table(const std::filesystem::path& file);

/// A cell as a finite number. Nothing: it is none.
std::optional<double> table_number(const TextTable& table, std::size_t line, std::size_t column);

/// How much one more in the last digit of such a number is; 0 of a cell that is none.
double number_resolution(const TextTable& table, std::size_t line, std::size_t column);

/// A column's title in lower case, and the unit that stands in brackets behind it, or in the line below.
struct ColumnTitle {
  std::string name, unit;
};
ColumnTitle column_title(std::string_view cell);

/// How much one unit is in SI: of lengths [m], forces [N], stresses [Pa] and strains [-]. Nothing: the unit is unknown.
/// Grams and kilograms of a force are their weight.
std::optional<double> length_unit(std::string_view unit);
std::optional<double> force_unit(std::string_view unit);
std::optional<double> stress_unit(std::string_view unit);
std::optional<double> strain_unit(std::string_view unit);
/// Whether it is a unit of time.
bool is_time_unit(std::string_view unit);

}  // namespace pliant
