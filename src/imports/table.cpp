#include "imports/table.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>

#include "base/files.hpp"

namespace pliant {

namespace {

std::string trimmed_cell(std::string_view text) {
  constexpr std::string_view blank = " \t\r\"";
  const auto begin = text.find_first_not_of(blank);
  if (begin == std::string_view::npos) return "";
  return std::string(text.substr(begin, text.find_last_not_of(blank) + 1 - begin));
}

// Cells of a line; separators in quotes are part of a cell.
std::vector<std::string> table_cells(std::string_view line, char separator) {
  std::vector<std::string> cells;
  std::size_t begin = 0;
  bool is_quoted = false;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    if (i < line.size() && line[i] == '"') is_quoted = !is_quoted;
    if (i < line.size() && (line[i] != separator || is_quoted)) continue;
    cells.push_back(trimmed_cell(line.substr(begin, i - begin)));
    begin = i + 1;
  }
  return cells;
}

std::optional<double> unit_in(const std::map<std::string_view, double>& units, std::string_view unit) {
  const auto it = units.find(unit);
  return it == units.end() ? std::nullopt : std::optional(it->second);
}

}  // namespace

TextTable read_table(const std::filesystem::path& file) {
  std::string content = read_file(file);
  if (content.starts_with("\xEF\xBB\xBF")) content.erase(0, 3);
  if (content.find('\0') != std::string::npos) refuse(file, "no text", "a CSV file", "export it as CSV in UTF-8");
  TextTable table{file, ',', {}};
  for (const char separator : {';', '\t'})
    if (std::ranges::count(content, separator) > std::ranges::count(content, '\n')) {
      table.separator = separator;
      break;
    }
  for (std::size_t at = 0; at < content.size();) {
    const std::size_t end = std::min(content.find('\n', at), content.size());
    table.lines.push_back(table_cells(std::string_view(content).substr(at, end - at), table.separator));
    at = end + 1;
  }
  return table;
}

std::optional<double> table_number(const TextTable& table, std::size_t line, std::size_t column) {
  if (column >= table.lines[line].size()) return std::nullopt;
  std::string text = table.lines[line][column];
  if (table.separator != ',') std::ranges::replace(text, ',', '.');
  if (text.starts_with('+')) text.erase(0, 1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

ColumnTitle column_title(std::string_view cell) {
  const auto open = cell.find_first_of("([");
  ColumnTitle title{trimmed_cell(cell.substr(0, open)), ""};
  for (char& c : title.name) c = char(std::tolower(static_cast<unsigned char>(c)));
  if (open == std::string_view::npos) return title;
  const auto close = std::min(cell.find_first_of(")]", open), cell.size());
  title.unit = trimmed_cell(cell.substr(open + 1, close - open - 1));
  return title;
}

std::optional<double> length_unit(std::string_view unit) {
  static const std::map<std::string_view, double> units = {{"m", 1.0},   {"cm", 1e-2},        {"mm", 1e-3},
                                                           {"um", 1e-6}, {"\xC2\xB5m", 1e-6}, {"in", 0.0254}};
  return unit_in(units, unit);
}

std::optional<double> force_unit(std::string_view unit) {
  static const std::map<std::string_view, double> units = {
      {"N", 1.0}, {"mN", 1e-3}, {"kN", 1e3}, {"kgf", 9.80665}, {"gf", 9.80665e-3}, {"lbf", 4.4482216152605}};
  return unit_in(units, unit);
}

std::optional<double> stress_unit(std::string_view unit) {
  static const std::map<std::string_view, double> units = {{"Pa", 1.0},     {"kPa", 1e3},   {"MPa", 1e6},
                                                           {"N/mm^2", 1e6}, {"N/mm2", 1e6}, {"psi", 6894.757293168}};
  return unit_in(units, unit);
}

}  // namespace pliant
