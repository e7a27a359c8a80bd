#include "imports/table.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
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

void append_utf8(std::string& text, char32_t c) {
  if (c < 0x80) {
    text += char(c);
  } else if (c < 0x800) {
    text += char(0xC0 | (c >> 6)), text += char(0x80 | (c & 0x3F));
  } else if (c < 0x10000) {
    text += char(0xE0 | (c >> 12)), text += char(0x80 | ((c >> 6) & 0x3F)), text += char(0x80 | (c & 0x3F));
  } else {
    text += char(0xF0 | (c >> 18)), text += char(0x80 | ((c >> 12) & 0x3F));
    text += char(0x80 | ((c >> 6) & 0x3F)), text += char(0x80 | (c & 0x3F));
  }
}

std::string from_utf16(std::string_view bytes, bool is_little_endian) {
  const auto unit = [&](std::size_t i) {
    const auto low = static_cast<unsigned char>(bytes[i + (is_little_endian ? 0 : 1)]);
    const auto high = static_cast<unsigned char>(bytes[i + (is_little_endian ? 1 : 0)]);
    return char32_t(high << 8 | low);
  };
  std::string text;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    char32_t c = unit(i);
    if (c >= 0xD800 && c < 0xDC00 && i + 3 < bytes.size()) c = 0x10000 + ((c - 0xD800) << 10) + (unit(i += 2) - 0xDC00);
    append_utf8(text, c);
  }
  return text;
}

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c < 0x80) continue;
    const int following = c >= 0xF0 ? 3 : c >= 0xE0 ? 2 : c >= 0xC2 ? 1 : 0;
    if (following == 0) return false;
    for (int k = 0; k < following; ++k)
      if (++i >= text.size() || (static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) return false;
  }
  return true;
}

// Bytes of a text as UTF-8 with ends of lines that are '\n': UTF-8 or UTF-16 by their mark, UTF-16 by its zeros, else
// Latin-1 where they are no UTF-8.
std::string decoded(std::string bytes, const std::filesystem::path& file) {
  if (bytes.starts_with("\xEF\xBB\xBF")) {
    bytes.erase(0, 3);
  } else if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF")) {
    bytes = from_utf16(std::string_view(bytes).substr(2), bytes[0] == '\xFF');
  } else if (bytes.size() > 3 && (bytes[1] == '\0') != (bytes[0] == '\0')) {
    bytes = from_utf16(bytes, bytes[1] == '\0');
  } else if (!is_utf8(bytes)) {
    std::string text;
    for (const char c : bytes) append_utf8(text, static_cast<unsigned char>(c));
    bytes = std::move(text);
  }
  if (bytes.find('\0') != std::string::npos) refuse(file, "no text", "a CSV file", "export it as CSV in UTF-8");
  if (bytes.find('\n') == std::string::npos) std::ranges::replace(bytes, '\r', '\n');
  return bytes;
}

void replace_all(std::string& text, std::string_view old, std::string_view by) {
  std::string replaced;
  std::size_t at = 0;
  for (std::size_t next = 0; (next = text.find(old, at)) != std::string::npos; at = next + old.size())
    replaced.append(text, at, next - at).append(by);
  if (at > 0) text = std::move(replaced.append(text, at));
}

// A cell without a plus, and without spaces and apostrophes between digits; a minus of any kind as '-'.
std::string plain_number(std::string text) {
  replace_all(text, "\xE2\x88\x92", "-");  // minus sign
  for (const std::string_view space : {"\xC2\xA0", "\xE2\x80\xAF", "\xE2\x80\x89", "\xE2\x80\x99"})
    replace_all(text, space, "'");
  if (text.starts_with('+')) text.erase(0, 1);
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_between = i > 0 && i + 1 < text.size() &&
                            std::isdigit(static_cast<unsigned char>(text[i - 1])) != 0 &&
                            std::isdigit(static_cast<unsigned char>(text[i + 1])) != 0;
    if (!((text[i] == '\'' || text[i] == ' ') && is_between)) plain += text[i];
  }
  return plain;
}

// What a number says of the sign before its fraction: '.' or ',', and whether it could be no other.
struct DecimalSign {
  char sign = 0;  // 0: it has none
  bool is_sure = false;
};

DecimalSign decimal_sign(const std::string& cell) {
  const std::string text = plain_number(cell);
  const std::size_t digits = text.find_first_of("0123456789");
  if (digits == std::string::npos || text.find_first_not_of("+-.,0123456789eE") != std::string::npos) return {};
  const std::size_t mantissa = std::min(text.find_first_of("eE"), text.size());
  const std::size_t last = text.substr(0, mantissa).find_last_of(".,");
  if (last == std::string::npos) return {};
  const char sign = text[last], other = sign == '.' ? ',' : '.';
  const auto count = std::ranges::count(text, sign);
  const bool ends_in_three = mantissa - last == 4;
  if (text.find(other) != std::string::npos) return {sign, count == 1};
  if (count > 1)  // thousands, or a date
    return ends_in_three && last >= 4 && text[last - 4] == sign ? DecimalSign{other, true} : DecimalSign{};
  return {sign, !ends_in_three || last <= digits || text[digits] == '0' || mantissa < text.size()};
}

std::size_t lines_of_numbers(const std::vector<std::vector<std::string>>& lines) {
  return std::size_t(std::ranges::count_if(lines, [](const std::vector<std::string>& cells) {
    return std::ranges::count_if(cells, [](const std::string& cell) {
             return !cell.empty() && cell.find_first_not_of("+-.,0123456789eE' ") == std::string::npos;
           }) >= 2;
  }));
}

// The sign before the fractions of most numbers that leave no doubt, else of those that there are.
char decimal_of(const TextTable& table) {
  std::array<std::size_t, 2> sure{}, all{};  // of points, of commas
  for (const std::vector<std::string>& cells : table.lines)
    for (const std::string& cell : cells)
      if (const DecimalSign found = decimal_sign(cell); found.sign != 0)
        ++all[found.sign == ','], sure[found.sign == ','] += found.is_sure;
  const std::array<std::size_t, 2>& counts = sure[0] + sure[1] > 0 ? sure : all;
  if (table.separator == ',' && sure[1] == 0) return '.';
  return counts[1] > counts[0] ? ',' : '.';
}

// A unit as the tables below write it: no spaces, powers without a sign, "u" for micro.
std::string plain_unit(std::string_view unit) {
  std::string plain(unit);
  for (const auto& [old, by] : std::initializer_list<std::pair<std::string_view, std::string_view>>{
           {"\xC2\xB2", "2"}, {"\xC2\xB5", "u"}, {"\xCE\xBC", "u"}, {"\xE2\x88\x95", "/"}, {"**", ""}})
    replace_all(plain, old, by);
  std::erase_if(plain, [](char c) { return c == ' ' || c == '^' || c == '.'; });
  return plain;
}

using Units = std::map<std::string_view, double>;

std::optional<double> unit_in(const Units& units, std::string_view unit) {
  const auto it = units.find(plain_unit(unit));
  return it == units.end() ? std::nullopt : std::optional(it->second);
}

constexpr double gravity_of_grams = 9.80665e-3;  // [N] weight of a gram
constexpr double gravity_of_pounds = 4.4482216152605;
constexpr double pound_per_square_inch = 6894.757293168;

}  // namespace

bool TextTable::is_blank(std::size_t line) const {
  return std::ranges::all_of(lines[line], [](const std::string& c) { return c.empty(); });
}

std::string_view TextTable::cell(std::size_t line, std::size_t column) const {
  return column < lines[line].size() ? std::string_view(lines[line][column]) : std::string_view();
}

TextTable read_table(const std::filesystem::path& file) {
  const std::string content = decoded(read_file(file), file);
  TextTable table{file, ',', '.', {}};
  std::size_t most = 0;
  for (const char separator : {';', '\t', ','}) {
    std::vector<std::vector<std::string>> lines;
    for (std::size_t at = 0; at < content.size();) {
      const std::size_t end = std::min(content.find('\n', at), content.size());
      lines.push_back(table_cells(std::string_view(content).substr(at, end - at), separator));
      at = end + 1;
    }
    const std::size_t count = lines_of_numbers(lines);
    if (table.lines.empty() || count > most) table.separator = separator, table.lines = std::move(lines), most = count;
  }
  table.decimal = decimal_of(table);
  return table;
}

std::optional<double> table_number(const TextTable& table, std::size_t line, std::size_t column) {
  std::string text = plain_number(std::string(table.cell(line, column)));
  const char thousands = table.decimal == '.' ? ',' : '.';
  if (text.find(thousands) != std::string::npos) {  // groups of three digits before the fraction
    const std::size_t end = std::min(text.find_first_of(table.decimal == '.' ? ".eE" : ",eE"), text.size());
    const std::size_t first = text.find(thousands);
    for (std::size_t i = first; i < text.size(); ++i)
      if ((text[i] == thousands) != (i < end && (i - first) % 4 == 0)) return std::nullopt;
    if (first == 0 || end <= first || (end - first) % 4 != 0) return std::nullopt;
    std::erase(text, thousands);
  }
  std::ranges::replace(text, ',', '.');
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

double number_resolution(const TextTable& table, std::size_t line, std::size_t column) {
  if (!table_number(table, line, column)) return 0.0;
  const std::string text = plain_number(std::string(table.cell(line, column)));
  const std::size_t end = std::min(text.find_first_of("eE"), text.size());
  const std::size_t point = text.substr(0, end).find(table.decimal);
  const int digits = point == std::string::npos ? 0 : int(end - point) - 1;
  return std::pow(10.0, (end < text.size() ? std::atof(text.c_str() + end + 1) : 0.0) - digits);
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
  static const Units units = {{"m", 1.0},           {"dm", 0.1},      {"cm", 1e-2},         {"mm", 1e-3},
                              {"um", 1e-6},         {"micron", 1e-6}, {"microns", 1e-6},    {"nm", 1e-9},
                              {"in", 0.0254},       {"inch", 0.0254}, {"inches", 0.0254},   {"ft", 0.3048},
                              {"millimeter", 1e-3}, {"meter", 1.0},   {"millimetre", 1e-3}, {"metre", 1.0},
                              {"Millimeter", 1e-3}, {"Meter", 1.0}};
  return unit_in(units, unit);
}

std::optional<double> force_unit(std::string_view unit) {
  static const Units units = {{"N", 1.0},
                              {"nN", 1e-9},
                              {"uN", 1e-6},
                              {"mN", 1e-3},
                              {"cN", 1e-2},
                              {"daN", 10.0},
                              {"kN", 1e3},
                              {"KN", 1e3},
                              {"MN", 1e6},
                              {"Newton", 1.0},
                              {"newton", 1.0},
                              {"newtons", 1.0},
                              {"kgf", 1e3 * gravity_of_grams},
                              {"kp", 1e3 * gravity_of_grams},
                              {"kg", 1e3 * gravity_of_grams},
                              {"gf", gravity_of_grams},
                              {"g", gravity_of_grams},
                              {"gram", gravity_of_grams},
                              {"grams", gravity_of_grams},
                              {"Gramm", gravity_of_grams},
                              {"mg", 1e-3 * gravity_of_grams},
                              {"lbf", gravity_of_pounds},
                              {"lb", gravity_of_pounds},
                              {"lbs", gravity_of_pounds},
                              {"ozf", gravity_of_pounds / 16.0}};
  return unit_in(units, unit);
}

std::optional<double> stress_unit(std::string_view unit) {
  static const Units units = {{"Pa", 1.0},
                              {"hPa", 1e2},
                              {"kPa", 1e3},
                              {"KPa", 1e3},
                              {"MPa", 1e6},
                              {"Mpa", 1e6},
                              {"MPA", 1e6},
                              {"GPa", 1e9},
                              {"bar", 1e5},
                              {"mbar", 1e2},
                              {"N/mm2", 1e6},
                              {"N/cm2", 1e4},
                              {"N/m2", 1.0},
                              {"mN/mm2", 1e3},
                              {"kN/mm2", 1e9},
                              {"kN/m2", 1e3},
                              {"MN/m2", 1e6},
                              {"kgf/mm2", 1e9 * gravity_of_grams},
                              {"kg/mm2", 1e9 * gravity_of_grams},
                              {"kgf/cm2", 1e7 * gravity_of_grams},
                              {"kg/cm2", 1e7 * gravity_of_grams},
                              {"gf/mm2", 1e6 * gravity_of_grams},
                              {"g/mm2", 1e6 * gravity_of_grams},
                              {"psi", pound_per_square_inch},
                              {"ksi", 1e3 * pound_per_square_inch}};
  return unit_in(units, unit);
}

std::optional<double> strain_unit(std::string_view unit) {
  static const Units units = {{"%", 1e-2},    {"percent", 1e-2}, {"Prozent", 1e-2},    {"pct", 1e-2},
                              {"-", 1.0},     {"1", 1.0},        {"mm/mm", 1.0},       {"m/m", 1.0},
                              {"in/in", 1.0}, {"um/m", 1e-6},    {"um/mm", 1e-3},      {"mm/m", 1e-3},
                              {"ue", 1e-6},   {"ustrain", 1e-6}, {"microstrain", 1e-6}};
  return unit_in(units, unit);
}

bool is_time_unit(std::string_view unit) {
  static const Units units = {{"s", 1.0}, {"sec", 1.0}, {"ms", 1e-3}, {"min", 60.0}, {"h", 3600.0}, {"Sek", 1.0}};
  return unit_in(units, unit).has_value();
}

}  // namespace pliant
