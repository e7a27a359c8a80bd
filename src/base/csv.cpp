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

// Calls `cell` with each cell's text, without spaces around it, and where it begins in the line.
template <class Cell>
void split(std::string_view line, const Cell& cell) {
  for (std::size_t at = 0; at <= line.size();) {
    const std::size_t end = std::min(line.find(',', at), line.size());
    std::string_view text = line.substr(at, end - at);
    const std::size_t begin = std::min(text.find_first_not_of(blank), text.size());
    text.remove_prefix(begin);
    text = text.substr(0, text.find_last_not_of(blank) + 1);
    cell(text, int(at + begin) + 1);
    at = end + 1;
  }
}

std::vector<std::string_view> names_in(std::string_view header) {
  std::vector<std::string_view> names;
  split(header, [&](std::string_view text, int) { names.push_back(text); });
  return names;
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
  const std::string content = read_file(path);
  const std::vector<std::string_view> names = names_in(header);
  CsvRow current;
  bool has_rows = false;
  current.path_ = &path;
  current.problems_ = &problems;
  for (std::size_t at = content.starts_with(byte_order_mark) ? byte_order_mark.size() : 0; at < content.size();) {
    const std::size_t end = std::min(content.find('\n', at), content.size());
    const std::string_view line = std::string_view(content).substr(at, end - at);
    at = end + 1;
    if (++current.line_ == 1) {
      if (names_in(line) == names) continue;
      problems.push_back({{path, 1, 1},
                          "the header " + in_quotes(line.substr(0, line.find_last_not_of(blank) + 1)),
                          in_quotes(header),
                          "name the columns so, in this order"});
      return;
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
                          std::to_string(names.size()) + " cells: " + std::string(header),
                          "separate cells by commas, write decimals with a point"});
  }
  if (current.line_ == 0)
    problems.push_back({{path}, "the file is empty", "a CSV file with the header " + in_quotes(header), ""});
  else if (!has_rows)
    problems.push_back({{path}, "no row below the header", "one row at least", ""});
}

}  // namespace pliant
