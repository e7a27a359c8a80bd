#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"

namespace pliant {

/// A line of a CSV file below its header, with as many cells as the header has. Cells are asked for by column, from 0;
/// one that is not what it should be comes back as nothing, with a complaint that names its line and column.
class CsvRow {
 public:
  /// A text: not empty, without quotes.
  std::optional<std::string> text(std::size_t column);
  /// A finite number.
  std::optional<double> number(std::size_t column);
  /// A whole number from 0.
  std::optional<int> index(std::size_t column);
  /// The cell as it stands there, without spaces around it.
  std::string raw(std::size_t column) const { return std::string(cells_[column].text); }

  int line() const { return line_; }
  void complain(std::size_t column, std::string found, std::string expected, std::string advice = "");

 private:
  friend void read_csv(const std::filesystem::path&, const std::function<bool(const std::vector<std::string>&)>&,
                       std::vector<Problem>&, const std::function<void(CsvRow&)>&);
  struct Cell {
    std::string_view text;  // without spaces around it
    int column;             // in the line, from 1
  };
  const std::filesystem::path* path_ = nullptr;
  std::vector<Problem>* problems_ = nullptr;
  int line_ = 0;
  std::vector<Cell> cells_;
};

/// Reads a CSV file strictly: the first line must be `header`, every other line that is not empty has as many cells,
/// and there is one such line at least. Spaces around cells, Windows line ends and a byte order mark are taken.
/// @param problems  gets everything that is wrong, also what `row` complains about
/// @param row       called for each line below the header; not at all where the header is another
/// Throws InputError where the file cannot be read.
void read_csv(const std::filesystem::path& path, std::string_view header, std::vector<Problem>& problems,
              const std::function<void(CsvRow&)>& row);

/// The same; throws InputError with all that is wrong.
void read_csv(const std::filesystem::path& path, std::string_view header, const std::function<void(CsvRow&)>& row);

/// The same for a file whose columns may be of several kinds. A cell that begins with a quote ends with one, and may
/// have commas.
/// @param header  called with the names of the columns, none of an empty file; false, with a problem told, where they
///                will not do
void read_csv(const std::filesystem::path& path, const std::function<bool(const std::vector<std::string>&)>& header,
              std::vector<Problem>& problems, const std::function<void(CsvRow&)>& row);

/// A text as a cell: in quotes, doubled where it has some, if it has commas, quotes or ends of lines.
std::string csv_cell(std::string text);

}  // namespace pliant
