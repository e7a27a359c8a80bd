// CSV files of testing machines: lines about the specimen, a line of titles, units behind the titles or in the next
// line, and numbers. Extension or strain with load or stress, in English or German; of several strains the engineering
// one.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <functional>

#include "base/files.hpp"
#include "imports/formats.hpp"
#include "imports/image_sequence.hpp"
#include "imports/table.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double greatest_strain = 20.0;  // [-] of a material that people test
constexpr double surely_a_strain = 1.0;   // [-] numbers without a unit that stay below are no percents of a soft object
constexpr double stretch_at_rest = 0.05;  // [-] from 1, where a table of stretches begins
constexpr double true_strain_error = 0.02;  // of the logarithm of the stretch
constexpr std::size_t lines_of_units = 4;   // between titles and numbers, blank ones included

enum class Quantity { Extension, Strain, Force, Stress };
constexpr std::array<const char*, 4> quantity_names = {"an extension", "a strain", "a force", "a stress"};
constexpr std::array<const char*, 4> quantity_units = {"m, cm, mm, um or in", "none, % or mm/mm",
                                                       "N, mN, kN, kgf, gf, g or lbf", "Pa, kPa, MPa, N/mm^2 or psi"};
using UnitOf = std::optional<double> (*)(std::string_view);
constexpr std::array<UnitOf, 4> units_of = {length_unit, strain_unit, force_unit, stress_unit};

bool is_known_unit(std::string_view unit) {
  return is_time_unit(unit) || std::ranges::any_of(units_of, [&](UnitOf f) { return f(unit).has_value(); });
}

std::string trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t_,/:;-");
  if (begin == std::string_view::npos) return "";
  return std::string(text.substr(begin, text.find_last_not_of(" \t_,/:;-") + 1 - begin));
}

// Small letters, German umlauts as two.
std::string folded(std::string_view text) {
  std::string result(text);
  for (const auto& [old, by] :
       std::initializer_list<std::pair<std::string_view, std::string_view>>{{"\xC3\xA4", "ae"},
                                                                            {"\xC3\x84", "ae"},
                                                                            {"\xC3\xB6", "oe"},
                                                                            {"\xC3\x96", "oe"},
                                                                            {"\xC3\xBC", "ue"},
                                                                            {"\xC3\x9C", "ue"},
                                                                            {"\xC3\x9F", "ss"},
                                                                            {"\xCF\x83", "sigma"},
                                                                            {"\xCE\xB5", "epsilon"},
                                                                            {"\xCE\xBB", "lambda"},
                                                                            {"\xCE\x94", "delta"},
                                                                            {"\xE2\x88\x86", "delta"}})
    for (std::size_t at = result.find(old); at != std::string::npos; at = result.find(old, at + by.size()))
      result.replace(at, old.size(), by);
  for (char& c : result) c = char(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

// Name and unit of "Force_N", "Kraft [N]", "Force (channel 1) (N)", "Dehnung %", "Weg in mm", "Kraft / N".
ColumnTitle machine_title(const std::string& cell) {
  ColumnTitle title;
  const std::size_t open = cell.find_first_of("([{");
  title.name = trimmed(cell.substr(0, open));
  for (std::size_t at = open; at != std::string::npos; at = cell.find_first_of("([{", at + 1)) {
    const std::size_t close = std::min(cell.find_first_of(")]}", at), cell.size());
    const std::string inside = cell.substr(at + 1, close - at - 1);
    if (title.unit.empty() || is_known_unit(inside)) title.unit = inside;
  }
  if (!is_known_unit(title.unit))
    for (std::size_t at = title.name.find_first_of("_ ,/:"); at != std::string::npos;
         at = title.name.find_first_of("_ ,/:", at + 1)) {
      const std::string rest = trimmed(title.name.substr(at));
      if (rest == "1" || !is_known_unit(rest)) continue;
      title.unit = rest, title.name = trimmed(title.name.substr(0, at));
      break;
    }
  title.name = folded(title.name);
  return title;
}

std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> words(1);
  for (const char c : name)
    if (std::isalpha(static_cast<unsigned char>(c)) != 0)
      words.back() += c;
    else if (!words.back().empty())
      words.emplace_back();
  if (words.back().empty()) words.pop_back();
  return words;
}

bool names_any(const std::string& title, std::initializer_list<const char*> parts) {
  return std::ranges::any_of(parts, [&](const char* part) { return title.find(part) != std::string::npos; });
}
bool has_word(const std::vector<std::string>& words, std::initializer_list<const char*> wanted) {
  return std::ranges::any_of(words, [&](const std::string& word) {
    return std::ranges::any_of(wanted, [&](const char* w) { return word == w; });
  });
}
bool has_ending(const std::vector<std::string>& words, std::initializer_list<const char*> endings) {
  return std::ranges::any_of(words, [&](const std::string& word) {
    return std::ranges::any_of(endings, [&](const char* e) { return word.ends_with(e) && word != "elast"; });
  });
}

bool is_of_something_else(const std::string& name, const std::vector<std::string>& words) {
  return names_any(name, {"speed",     "geschwindigkeit", "velocity", "modul",  "energ",  "arbeit",    "temp",
                          "transvers", "lateral",         "quer",     "width",  "breite", "thickness", "dicke",
                          "diameter",  "durchmesser",     "flaeche",  "cycle",  "zyklus", "time",      "zeit",
                          "setpoint",  "command",         "soll",     "voltage"}) ||
         has_word(words, {"rate", "work", "area", "target", "no", "number", "count"}) || has_ending(words, {"rate"});
}

// What a title says is measured along the specimen: a length, or a share of it.
bool names_strain(const std::string& name, const std::vector<std::string>& words) {
  return names_any(name, {"strain", "dehnung", "stauchung"}) || has_word(words, {"epsilon", "eps"});
}
bool names_stretch(const std::string& name, const std::vector<std::string>& words) {
  return names_any(name, {"stretch", "streckung", "dehnungsverhaeltnis"}) || has_word(words, {"lambda"});
}
bool names_extension(const std::string& name, const std::vector<std::string>& words) {
  return names_any(name, {"extension", "displacement", "crosshead", "travel", "stroke", "depth", "elongation",
                          "deflection", "indentation", "distance", "position", "verschiebung", "verlaengerung",
                          "eindring", "laengenaenderung", "deformation", "verformung", "durchbiegung"}) ||
         has_word(words, {"hub", "traverse", "dl", "deltal", "delta", "disp", "ext", "pos"}) ||
         has_ending(words, {"weg"});
}
bool names_stress(const std::string& name, const std::vector<std::string>& words) {
  return names_any(name, {"stress", "spannung"}) || has_word(words, {"sigma"});
}
bool names_force(const std::string& name, const std::vector<std::string>& words) {
  return names_any(name, {"load", "force", "kraft", "belastung"}) || has_word(words, {"f"}) ||
         has_ending(words, {"last"});
}
bool is_true_measure(const std::string& name) {
  return names_any(name, {"true", "wahre", "logarithmi", "hencky", "cauchy"});
}

// What a column is by title and unit. Where both are known the unit decides what kind of measure it is; a unit that is
// unknown, or one that is missing, is kept to complain of where the column is needed.
struct MachineColumn {
  std::size_t at = 0;
  ColumnTitle title;
  std::optional<Quantity> quantity;
  bool is_named = false;    // else its unit alone says what it is
  bool is_stretch = false;  // of its title
  double unit = 0.0;        // in SI; 0: it has none that is known
  int rank = 0;             // lower ones are taken first
  bool compresses = false;  // its title says that positive numbers compress
};

MachineColumn classified(std::size_t at, ColumnTitle title) {
  MachineColumn column;
  column.at = at, column.title = std::move(title);
  const std::string& name = column.title.name;
  const std::vector<std::string> words = words_of(name);
  if (is_of_something_else(name, words) || is_time_unit(column.title.unit)) return column;
  const auto take = [&](Quantity quantity) {
    const std::optional<double> unit = units_of[std::size_t(quantity)](column.title.unit);
    if (unit) column.quantity = quantity, column.unit = *unit;
    return unit.has_value();
  };
  column.is_stretch = names_stretch(name, words);
  const bool is_strain = names_strain(name, words) || column.is_stretch || column.title.unit == "%";
  const bool is_stress = names_stress(name, words);
  if ((is_strain && !is_stress) || names_extension(name, words)) {
    column.is_named = true;
    if (!take(Quantity::Extension) && !take(Quantity::Strain))
      column.quantity = is_strain ? Quantity::Strain : Quantity::Extension;
  } else if (is_stress || names_force(name, words)) {
    column.is_named = true;
    if (!take(Quantity::Force) && !take(Quantity::Stress))
      column.quantity = is_stress ? Quantity::Stress : Quantity::Force;
  } else if (column.title.unit != "1" && column.title.unit != "-") {
    (void)(take(Quantity::Extension) || take(Quantity::Force) || take(Quantity::Stress));
  }
  column.rank = (is_true_measure(name) ? 8 : 0) + (column.is_named ? 0 : 4) +
                (names_any(name, {"max", "peak", "break", "bruch"}) ? 2 : 0) + (names_any(name, {"position"}) ? 1 : 0);
  column.compresses = names_any(name, {"compressive", "compression", "stauchung", "druckkraft", "druckspannung"});
  return column;
}

// The line of titles, the columns that stand under it, and the first line of numbers.
struct MachineTitles {
  std::size_t line = 0, first = 0;
  std::vector<MachineColumn> columns;

  // The column to take of a quantity; nothing where there is none, or where only units tell and several have it.
  const MachineColumn* column(Quantity quantity) const {
    const MachineColumn* found = nullptr;
    int unnamed = 0;
    for (const MachineColumn& c : columns) {
      if (c.quantity != quantity) continue;
      unnamed += !c.is_named;
      if (found == nullptr || c.rank < found->rank) found = &c;
    }
    return found != nullptr && !found->is_named && unnamed > 1 ? nullptr : found;
  }
};

bool has_numbers(const TextTable& table, std::size_t line) {
  int count = 0;
  for (std::size_t i = 0; i < table.lines[line].size(); ++i) count += table_number(table, line, i).has_value();
  return count >= 2;
}

std::optional<std::size_t> numbers_below(const TextTable& table, std::size_t line) {
  for (std::size_t below = line + 1; below < std::min(line + 2 + lines_of_units, table.lines.size()); ++below)
    if (has_numbers(table, below)) return below;
  return std::nullopt;
}

// The unit of a column in a line below its title: alone in its cell, or in brackets there.
std::string unit_below(const TextTable& table, std::size_t line, std::size_t column) {
  const std::string cell(table.cell(line, column));
  const ColumnTitle unit = column_title(cell);
  return unit.name.empty() ? unit.unit : cell;
}

std::optional<MachineTitles> titles_of(const TextTable& table, bool by_name) {
  for (std::size_t line = 0; line + 1 < table.lines.size(); ++line) {
    if (table.lines[line].size() < 2 || has_numbers(table, line)) continue;
    const auto first = numbers_below(table, line);
    if (!first) continue;
    MachineTitles found{line, *first, {}};
    for (std::size_t i = 0; i < table.lines[line].size(); ++i) {
      ColumnTitle title = machine_title(table.lines[line][i]);
      for (std::size_t below = line + 1; below < *first && !is_known_unit(title.unit); ++below) {
        const std::string unit = unit_below(table, below, i);
        if (is_known_unit(unit) || title.unit.empty()) title.unit = unit;
      }
      found.columns.push_back(classified(i, std::move(title)));
    }
    const auto has = [&](Quantity a, Quantity b) {
      return std::ranges::any_of(std::array{a, b}, [&](Quantity quantity) {
        const MachineColumn* column = found.column(quantity);
        return column != nullptr && (column->is_named || !by_name);
      });
    };
    if (has(Quantity::Extension, Quantity::Strain) && has(Quantity::Force, Quantity::Stress)) return found;
  }
  return std::nullopt;
}

// The first line that names what is measured; where none does, the first whose units tell.
std::optional<MachineTitles> titles_of(const TextTable& table) {
  std::optional<MachineTitles> named = titles_of(table, true);
  return named ? named : titles_of(table, false);
}

[[noreturn]] void complain_of_column(const TextTable& table, const MachineTitles& titles, std::string found,
                                     std::string expected, std::string advice) {
  throw InputError(
      Problem{{table.file, int(titles.line) + 1}, std::move(found), std::move(expected), std::move(advice)});
}

// Why a column cannot be read, as a complaint; nothing where it can.
void require_usable(const TextTable& table, const MachineTitles& titles, const MachineColumn& column) {
  const std::string& name = column.title.name;
  const char* units = quantity_units[std::size_t(*column.quantity)];
  const bool may_lack_unit = *column.quantity == Quantity::Strain && column.title.unit.empty();
  if (column.unit == 0.0 && !may_lack_unit)
    complain_of_column(table, titles,
                       column.title.unit.empty() ? "the column \"" + name + "\" without a unit"
                                                 : "the unit \"" + column.title.unit + "\" of \"" + name + "\"",
                       units, "write the unit in brackets behind the title");
  if (is_true_measure(name))
    complain_of_column(table, titles, "the column \"" + name + "\" alone",
                       "engineering strain and stress, of the length and area at rest",
                       "export them, or extension and load");
}

bool is_usable(const MachineColumn& column) {
  const bool may_lack_unit = column.quantity == Quantity::Strain && column.title.unit.empty();
  return (column.unit > 0.0 || may_lack_unit) && !is_true_measure(column.title.name);
}

// Numbers of one column as the file has them; none where the cell is empty.
std::vector<double> read_column(const TextTable& table, const MachineTitles& titles, const MachineColumn& column) {
  std::vector<double> values;
  for (std::size_t line = titles.first; line < table.lines.size(); ++line) {
    if (table.is_blank(line)) continue;
    const std::string cell(table.cell(line, column.at));
    const auto value = table_number(table, line, column.at);
    const bool is_missing = has_numbers(table, line) &&
                            (cell.empty() || cell == "-" || cell == "--" || cell == "---" || folded(cell) == "nan");
    if (!value && !is_missing)
      throw InputError(Problem{{table.file, int(line) + 1},
                               cell.empty() ? "a line without a number under \"" + column.title.name + "\""
                                            : "\"" + cell.substr(0, 40) + "\" under \"" + column.title.name + "\"",
                               "numbers",
                               "remove what stands below the table"});
    values.push_back(value.value_or(not_a_number));
  }
  return values;
}

std::vector<double> in_si(std::vector<double> values, const MachineColumn& column, double unit) {
  for (double& v : values) v *= column.compresses ? -unit : unit;
  return values;
}

// Of the last digit of a column's numbers, in SI; of a measure whose zeros are not written the finest.
double column_resolution(const TextTable& table, const MachineTitles& titles, const MachineColumn& column) {
  double finest = infinite;
  for (std::size_t line = titles.first; line < table.lines.size(); ++line)
    if (const double r = number_resolution(table, line, column.at); r > 0.0) finest = std::min(finest, r);
  return std::isfinite(finest) ? finest * column.unit : 0.0;
}

double first_of(const std::vector<double>& values) {
  const auto it = std::ranges::find_if(values, [](double v) { return std::isfinite(v); });
  return it == values.end() ? not_a_number : *it;
}

double greatest_of(const std::vector<double>& values) {
  double greatest = 0.0;
  for (const double v : values)
    if (std::isfinite(v)) greatest = std::max(greatest, std::abs(v));
  return greatest;
}

// Whether another column holds the logarithms of the stretches that these strains are, in a unit.
bool agrees_with_true_strain(const TextTable& table, const MachineTitles& titles, const std::vector<double>& values,
                             double unit) {
  for (const MachineColumn& c : titles.columns) {
    if (c.quantity != Quantity::Strain || !is_true_measure(c.title.name)) continue;
    const std::vector<double> logs = read_column(table, titles, c);
    const auto agrees = [&](double other) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        const double expected = std::log1p(values[i] * unit);
        if (std::isfinite(logs[i]) && std::isfinite(expected) &&
            std::abs(logs[i] * other - expected) > true_strain_error * (std::abs(expected) + 0.01))
          return false;
      }
      return true;
    };
    return agrees(c.unit > 0.0 ? c.unit : unit);
  }
  return false;
}

// What the numbers of a column of strains are: `unit` of one, and what is to be taken off (1 of stretches).
struct StrainMeasure {
  double unit = 1.0, at_rest = 0.0;
  std::string note;
};

StrainMeasure strain_measure(const TextTable& table, const MachineTitles& titles, const MachineColumn& column,
                             const std::vector<double>& values, const std::string& said) {
  const StrainMeasure percent{0.01, 0.0, ""}, strain{1.0, 0.0, ""}, stretch{1.0, 1.0, ""};
  if (said == "percent") return percent;
  if (said == "strain") return strain;
  if (said == "stretch") return stretch;
  const double first = first_of(values), greatest = greatest_of(values);
  const std::string title = "\"" + column.title.name + "\"" +
                            (column.title.unit.empty() ? " without a unit" : " [" + column.title.unit + "]");
  const auto ask = [&](const std::string& why) {
    complain_of_column(table, titles, "the column " + title + " " + why,
                       "strains (0 at rest), percents of them, or stretches (1 at rest)",
                       "say which it is: --strain strain, --strain percent or --strain stretch");
  };
  const auto text = [](double value) {
    std::array<char, 32> buffer{};
    std::snprintf(buffer.data(), buffer.size(), "%.4g", value);
    return std::string(buffer.data());
  };
  const bool begins_at_one = std::abs(first - 1.0) <= stretch_at_rest;
  const double unit = column.unit > 0.0 ? column.unit : 1.0;
  if (column.is_stretch && unit == 1.0) {
    if (!begins_at_one || greatest > greatest_strain)
      ask("begins at " + text(first) + " and reaches " + text(greatest) + ", stretches are 1 at rest");
    return stretch;
  }
  const bool begins_at_rest = std::abs(first * unit) <= stretch_at_rest;
  if ((column.is_stretch && !begins_at_rest) || std::abs(first * unit - 1.0) <= stretch_at_rest)
    ask("begins at " + text(first));
  if (column.unit > 0.0 && greatest * unit > greatest_strain) ask("reaches " + text(greatest));
  if (column.unit == percent.unit && greatest < surely_a_strain)
    return {unit, 0.0,
            title + " reaches " + text(greatest) + " % alone: --strain strain, where these are parts of the length"};
  if (column.unit > 0.0) return {unit, 0.0, ""};
  if (names_any(column.title.name, {"percent", "prozent"})) return percent;
  const bool may_be_strain = agrees_with_true_strain(table, titles, values, 1.0);
  const bool may_be_percent = agrees_with_true_strain(table, titles, values, 0.01);
  if (may_be_strain != may_be_percent) return may_be_strain ? strain : percent;
  if (greatest <= surely_a_strain)
    return {1.0, 0.0, title + " is taken as parts of the length: --strain percent, where it is not"};
  if (greatest > greatest_strain) return {0.01, 0.0, title + " reaches " + text(greatest) + ": it is taken as percent"};
  ask("reaches " + text(greatest));
  return strain;
}

std::string column_text(const MachineColumn& column) {
  return "\"" + column.title.name + "\"" + (column.title.unit.empty() ? "" : " [" + column.title.unit + "]");
}

// Reads what of two quantities a table has; complains where there is neither.
void read_either(const TextTable& table, const MachineTitles& titles, std::array<Quantity, 2> quantities,
                 const std::function<void(const MachineColumn&)>& read) {
  bool any = false;
  for (const Quantity quantity : quantities)
    if (const MachineColumn* column = titles.column(quantity); column != nullptr && is_usable(*column))
      read(*column), any = true;
  if (any) return;
  for (const Quantity quantity : quantities)
    if (const MachineColumn* column = titles.column(quantity)) require_usable(table, titles, *column);
}

std::string titles_seen(const TextTable& table) {
  for (std::size_t line = 0; line < table.lines.size(); ++line) {
    if (!has_numbers(table, line)) continue;
    std::string seen = "numbers from line " + std::to_string(line + 1) + " on";
    for (std::size_t above = line; above-- > 0;)
      if (!table.is_blank(above)) {
        seen += " below the titles";
        for (const std::string& cell : table.lines[above]) seen += " \"" + cell.substr(0, 30) + "\"";
        return seen;
      }
    return seen + " without titles";
  }
  return "no line of titles above numbers";
}

// Whether some line above numbers names an extension, strain, load or stress.
bool names_a_measure(const TextTable& table) {
  for (std::size_t line = 0; line + 1 < table.lines.size(); ++line)
    if (table.lines[line].size() >= 2 && !has_numbers(table, line) && numbers_below(table, line))
      for (const std::string& cell : table.lines[line])
        if (classified(0, machine_title(cell)).is_named) return true;
  return false;
}

}  // namespace

bool is_machine_csv(const fs::path& source) {
  const std::string ending = ending_of(source);
  if (!is_file(source) || (ending != ".csv" && ending != ".txt" && ending != ".tsv" && ending != ".asc")) return false;
  try {
    const TextTable table = read_table(source);
    return titles_of(table).has_value() || names_a_measure(table);
  } catch (const InputError&) {
    return false;
  }
}

ImportedRecording read_machine_csv(const fs::path& source, const ImportOptions& options) {
  const TextTable table = read_table(source);
  const auto titles = titles_of(table);
  if (!titles)
    refuse(source, titles_seen(table), "a line of titles with an extension or strain, and a load or stress",
           "name the columns, with units: Extension (mm), Load (N), Strain (%), Stress (MPa)");
  ImportedRecording recording;
  recording.name = source_name(source);
  MachineTest test;
  test.name = recording.name;
  std::string taken;
  const auto take = [&](const MachineColumn& column, std::vector<double>& values) {
    std::vector<double> numbers = read_column(table, *titles, column);
    taken += (taken.empty() ? "" : ", ") + column_text(column);
    const auto alike = std::ranges::count_if(titles->columns, [&](const MachineColumn& c) {
      return c.quantity == column.quantity && c.rank == column.rank;
    });
    if (alike > 1)
      recording.notes.push_back("of " + std::to_string(alike) + " columns of " +
                                quantity_names[std::size_t(*column.quantity)] +
                                " the first is taken: " + column_text(column));
    if (column.quantity != Quantity::Strain) {
      values = in_si(std::move(numbers), column, column.unit);
      return;
    }
    const bool can_do_without = !test.extensions.empty() && column.unit == 0.0 && options.strain.empty();
    StrainMeasure measure;
    try {
      measure = strain_measure(table, *titles, column, numbers, options.strain);
    } catch (const InputError&) {
      if (can_do_without) return;
      throw;
    }
    for (double& v : numbers) v = v * measure.unit - measure.at_rest;
    values = in_si(std::move(numbers), column, 1.0);
    if (!measure.note.empty()) recording.notes.push_back(measure.note);
  };
  read_either(table, *titles, {Quantity::Extension, Quantity::Strain}, [&](const MachineColumn& column) {
    take(column, column.quantity == Quantity::Extension ? test.extensions : test.strains);
  });
  read_either(table, *titles, {Quantity::Force, Quantity::Stress}, [&](const MachineColumn& column) {
    const bool is_force = column.quantity == Quantity::Force;
    take(column, is_force ? test.forces : test.stresses);
    (is_force ? test.force_resolution : test.stress_resolution) = column_resolution(table, *titles, column);
    if (const std::string& unit = column.title.unit; unit == "g" || unit == "kg" || unit == "mg")
      recording.notes.push_back("\"" + unit + "\" of " + column.title.name + " is taken as a weight, by 9.80665 m/s^2");
  });
  recording.notes.insert(recording.notes.begin(), "columns: " + taken);
  recording.test = std::move(test);
  return recording;
}

}  // namespace pliant
