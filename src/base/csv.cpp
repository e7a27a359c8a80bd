#include "base/csv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr std::string_view blank = " \t\r", byte_order_mark = "\xEF\xBB\xBF";

std::string in_quotes(std::string_view text) { return '"' + std::string(text.substr(0, 60)) + '"'; }

std::optional<double> parsed(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// Where the cell that begins here ends: at a comma that stands in no quotes.
std::size_t end_of_cell(std::string_view line, std::size_t at) {
  const std::size_t begin = line.find_first_not_of(blank, at);
  if (begin == std::string_view::npos || line[begin] != '"') return std::min(line.find(',', at), line.size());
  bool is_quoted = false;
  for (std::size_t i = begin; i < line.size(); ++i) {
    if (line[i] == '"') is_quoted = !is_quoted;
    if (line[i] == ',' && !is_quoted) return i;
  }
  return line.size();
}

// Calls `cell` with each cell's text, without spaces around it, and where it begins in the line.
template <class Cell>
void split(std::string_view line, const Cell& cell) {
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = end_of_cell(line, at);
    std::string_view text = line.substr(at, end - at);
    const std::size_t begin = std::min(text.find_first_not_of(blank), text.size());
    text.remove_prefix(begin);
    text = text.substr(0, text.find_last_not_of(blank) + 1);
    cell(text, int(at + begin) + 1);
    at = end + 1;
  }
}

std::vector<std::string> names_in(std::string_view header) {
  std::vector<std::string> names;
  split(header, [&](std::string_view text, int) { names.emplace_back(text); });
  return names;
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) text += (i > 0 ? "," : "") + names[i];
  return text;
}

}  // namespace

void CsvRow::complain(std::size_t column, std::string found, std::string expected, std::string advice) {
  problems_->push_back(
      {{*path_, line_, cells_[column].column}, std::move(found), std::move(expected), std::move(advice)});
}

std::optional<std::string> CsvRow::text(std::size_t column) {
  const std::string_view text = cells_[column].text;
  if (!text.empty() && text.find('"') == std::string_view::npos) return std::string(text);
  complain(column, text.empty() ? "an empty cell" : in_quotes(text), "a name without commas and quotes");
  return std::nullopt;
}

std::optional<double> CsvRow::number(std::size_t column) {
  const auto value = parsed(cells_[column].text);
  if (!value)
    complain(column, in_quotes(cells_[column].text), "a finite number", "leave out rows of what was not measured");
  return value;
}

std::optional<int> CsvRow::index(std::size_t column) {
  const auto value = parsed(cells_[column].text);
  if (value && *value >= 0 && *value == std::floor(*value) && *value <= std::numeric_limits<int>::max())
    return int(*value);
  complain(column, in_quotes(cells_[column].text), "a whole number from 0");
  return std::nullopt;
}

void read_csv(const fs::path& path, std::string_view header, std::vector<Problem>& problems,
              const std::function<void(CsvRow&)>& row) {
  const auto is_that = [&](const std::vector<std::string>& names) {
    if (names == names_in(header)) return true;
    if (names.empty())
      problems.push_back({{path}, "the file is empty", "the header " + in_quotes(header) + " and rows below it", ""});
    else
      problems.push_back({{path, 1, 1},
                          "the header " + in_quotes(joined(names)),
                          in_quotes(header),
                          "name the columns so, in this order"});
    return false;
  };
  read_csv(path, is_that, problems, row);
}

void read_csv(const fs::path& path, std::string_view header, const std::function<void(CsvRow&)>& row) {
  std::vector<Problem> problems;
  read_csv(path, header, problems, row);
  if (!problems.empty()) throw InputError(std::move(problems));
}

void read_csv(const fs::path& path, const std::function<bool(const std::vector<std::string>&)>& header,
              std::vector<Problem>& problems, const std::function<void(CsvRow&)>& row) {
  const std::string content = read_file(path);
  std::vector<std::string> names;
  CsvRow current;
  bool has_rows = false;
  current.path_ = &path;
  current.problems_ = &problems;
  for (std::size_t at = content.starts_with(byte_order_mark) ? byte_order_mark.size() : 0; at < content.size();) {
    const std::size_t end = std::min(content.find('\n', at), content.size());
    const std::string_view line = std::string_view(content).substr(at, end - at);
    at = end + 1;
    if (++current.line_ == 1) {
      names = names_in(line);
      if (!header(names)) return;
      continue;
    }
    if (line.find_first_not_of(blank) == std::string_view::npos) continue;
    has_rows = true;
    current.cells_.clear();
    split(line, [&](std::string_view text, int column) { current.cells_.push_back({text, column}); });
    if (current.cells_.size() == names.size())
      row(current);
    else
      problems.push_back({{path, current.line_, 1},
                          std::to_string(current.cells_.size()) + " cells",
                          std::to_string(names.size()) + " cells: " + joined(names),
                          "separate cells by commas, write decimals with a point"});
  }
  if (current.line_ == 0) {
    if (header({})) problems.push_back({{path}, "the file is empty", "a CSV file with a header", ""});
  } else if (!has_rows) {
    problems.push_back({{path}, "no row below the header", "one row at least", ""});
  }
}

std::string csv_cell(std::string text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) text.insert(at, "\"");
  return "\"" + text + "\"";
}

}  // namespace pliant
