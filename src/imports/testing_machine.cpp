// CSV files of testing machines: lines about the specimen, a line of titles, units in brackets there or in the next
// line, and numbers. Extension and load, strain and stress, or all of them; of several strains the engineering one.
#include <algorithm>

#include "base/files.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/table.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

struct MachineColumn {
  std::size_t at = 0;
  double unit = 1.0;        // in SI
  bool compresses = false;  // its title says that positive numbers compress
};

bool names_any(const std::string& title, std::initializer_list<const char*> words) {
  return std::ranges::any_of(words, [&](const char* word) { return title.find(word) != std::string::npos; });
}

// The title line, and the columns that stand under it.
struct MachineTitles {
  std::size_t line = 0;
  std::vector<ColumnTitle> titles;
};

bool is_extension(const std::string& t) {
  return names_any(t, {"extension", "displacement", "crosshead", "travel", "stroke", "depth", "elongation"});
}
bool is_force(const std::string& t) { return names_any(t, {"load", "force"}); }
bool is_strain(const std::string& t) { return names_any(t, {"strain"}) && !names_any(t, {"stress"}); }
bool is_stress(const std::string& t) { return names_any(t, {"stress"}); }

std::optional<MachineTitles> titles_of(const TextTable& table) {
  for (std::size_t line = 0; line + 1 < table.lines.size(); ++line) {
    MachineTitles found{line, {}};
    bool displaces = false, loads = false, strains = false, stresses = false;
    for (const std::string& cell : table.lines[line]) {
      found.titles.push_back(column_title(cell));
      const std::string& name = found.titles.back().name;
      displaces |= is_extension(name), loads |= is_force(name), strains |= is_strain(name), stresses |= is_stress(name);
    }
    const bool has_numbers = [&] {
      for (std::size_t below = line + 1; below < std::min(line + 3, table.lines.size()); ++below)
        if (table.lines[below].size() >= 2 && table_number(table, below, 0) && table_number(table, below, 1))
          return true;
      return false;
    }();
    if (!((displaces && loads) || (strains && stresses)) || !has_numbers) continue;
    const std::vector<std::string>& below = table.lines[line + 1];
    if (!table_number(table, line + 1, 0))  // a line of units
      for (std::size_t i = 0; i < found.titles.size() && i < below.size(); ++i)
        if (found.titles[i].unit.empty()) {
          const ColumnTitle unit = column_title(below[i]);
          found.titles[i].unit = unit.unit.empty() ? below[i] : unit.unit;
        }
    return found;
  }
  return std::nullopt;
}

// The column of a kind: one that is not called true before others.
std::optional<std::size_t> column_of(const MachineTitles& titles, bool (*is_kind)(const std::string&)) {
  std::optional<std::size_t> found;
  for (std::size_t i = 0; i < titles.titles.size(); ++i) {
    if (!is_kind(titles.titles[i].name)) continue;
    if (!found || (names_any(titles.titles[*found].name, {"true"}) && !names_any(titles.titles[i].name, {"true"})))
      found = i;
  }
  return found;
}

MachineColumn machine_column(const TextTable& table, const MachineTitles& titles, std::size_t at,
                             std::optional<double> (*unit_of)(std::string_view), const char* units) {
  const ColumnTitle& title = titles.titles[at];
  const auto unit = unit_of(title.unit);
  if (!unit)
    throw InputError(Problem{{table.file, int(titles.line) + 1},
                             title.unit.empty() ? "the column \"" + title.name + "\" without a unit"
                                                : "the unit \"" + title.unit + "\" of \"" + title.name + "\"",
                             units,
                             "write the unit in brackets behind the title"});
  if (names_any(title.name, {"true"}))
    throw InputError(Problem{{table.file, int(titles.line) + 1},
                             "the column \"" + title.name + "\" alone",
                             "engineering strain and stress, of the length and area at rest",
                             "export them, or extension and load"});
  return {at, *unit, names_any(title.name, {"compressive", "compression"})};
}

std::optional<double> strain_unit(std::string_view unit) {
  if (unit == "%") return 0.01;
  if (unit.empty() || unit == "-" || unit == "1" || unit == "mm/mm" || unit == "m/m" || unit == "in/in") return 1.0;
  return std::nullopt;
}

// Two columns, row by row; lines in which one is no number end the table.
void read_pair(const TextTable& table, const MachineTitles& titles, const MachineColumn& a, const MachineColumn& b,
               std::vector<double>& first, std::vector<double>& second) {
  for (std::size_t line = titles.line + 1; line < table.lines.size(); ++line) {
    const auto x = table_number(table, line, a.at), y = table_number(table, line, b.at);
    if (!x || !y) {
      const bool is_blank = std::ranges::all_of(table.lines[line], [](const std::string& c) { return c.empty(); });
      if (line == titles.line + 1 || is_blank) continue;
      throw InputError(Problem{{table.file, int(line) + 1},
                               "a line without numbers in both columns",
                               "numbers",
                               "remove what stands below the table"});
    }
    const double sign = a.compresses || b.compresses ? -1.0 : 1.0;
    first.push_back(sign * *x * a.unit), second.push_back(sign * *y * b.unit);
  }
  if (first.size() < 2) refuse(table.file, std::to_string(first.size()) + " lines of numbers", "a curve");
}

}  // namespace

bool is_machine_csv(const fs::path& source) {
  if (!is_file(source) || (source.extension() != ".csv" && source.extension() != ".txt")) return false;
  try {
    return titles_of(read_table(source)).has_value();
  } catch (const InputError&) {
    return false;
  }
}

ImportedRecording read_machine_csv(const fs::path& source, const ImportOptions& /*options*/) {
  const TextTable table = read_table(source);
  const auto titles = titles_of(table);
  if (!titles)
    refuse(source, "no line of titles above numbers", "columns of extension and load, or of strain and stress");
  ImportedRecording recording;
  recording.name = source_name(source);
  MachineTest test;
  test.name = recording.name;
  const auto extension = column_of(*titles, is_extension), force = column_of(*titles, is_force);
  const auto strain = column_of(*titles, is_strain), stress = column_of(*titles, is_stress);
  if (extension && force)
    read_pair(table, *titles, machine_column(table, *titles, *extension, length_unit, "m, cm, mm, um or in"),
              machine_column(table, *titles, *force, force_unit, "N, mN, kN, kgf, gf or lbf"), test.extensions,
              test.forces);
  if (strain && stress)
    read_pair(table, *titles, machine_column(table, *titles, *strain, strain_unit, "none, % or mm/mm"),
              machine_column(table, *titles, *stress, stress_unit, "Pa, kPa, MPa, N/mm^2 or psi"), test.strains,
              test.stresses);
  recording.test = std::move(test);
  return recording;
}

}  // namespace pliant
