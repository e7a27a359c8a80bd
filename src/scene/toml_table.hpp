#pragma once

#include <toml++/toml.h>

#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"
#include "geometry/camera.hpp"

namespace pliant {

/// Where each value of a TOML file stands: "object.mass", "depth[1].fx". Complaints about values use it.
class TomlPlaces {
 public:
  explicit TomlPlaces(std::filesystem::path file) : file_(std::move(file)) {}
  const std::filesystem::path& file() const { return file_; }
  void add(const std::string& key, int line, int column) { places_[key] = {file_, line, column}; }
  bool has(const std::string& key) const { return places_.contains(key); }
  /// Of the key, or of the nearest table above it where the key itself is not written.
  Place operator()(std::string key) const;

 private:
  std::filesystem::path file_;
  std::map<std::string, Place> places_;
};

/// What reading a TOML file gathers: places, and every problem met on the way.
struct TomlContext {
  TomlPlaces places;
  std::vector<Problem> problems;
  std::set<std::string> broken;  ///< keys, and the tables above them, with a problem of type or presence

  void complain(const std::string& key, std::string found, std::string expected, std::string advice = "");
  /// The same, and marks the key and the tables above it as broken: later rules skip them.
  void reject(const std::string& key, std::string found, std::string expected, std::string advice = "");
  /// Adds the problems of another file that a key names, and marks the key and the tables above it as broken.
  void reject(const std::string& key, const std::vector<Problem>& problems_of_file);
  bool is_sound(const std::string& key) const { return !broken.contains(key); }
  /// Throws InputError with all problems, if there are any: those of the file itself in the order of their places,
  /// then those of other files.
  void throw_problems();
};

/// The known name nearest to a misspelt one by edit distance; "" where none is near.
std::string nearest_name(std::string_view name, const std::set<std::string>& known);

/// One table of a TOML file, read strictly. Each value is asked for by key and type; `finish` complains about keys
/// that nobody asked for. Problems go to the context; a value with a problem comes back as nothing.
class TomlTable {
 public:
  TomlTable(const toml::table& table, std::string key, TomlContext& context);

  /// `double` (finite), `int`, `bool`, `std::string`, `Vector3`, a list of them, `RigidMotion` (4 x 4, row by
  /// row).
  template <class T>
  std::optional<T> optional(const std::string& name);
  /// The same; complains where it is missing. @param advice  what to write
  template <class T>
  std::optional<T> required(const std::string& name, const std::string& advice = "");

  /// A table inside this one. Nothing where it is missing.
  std::optional<TomlTable> table(const std::string& name);
  /// The blocks [[name]].
  std::vector<TomlTable> blocks(const std::string& name);
  /// Calls `read` with the table inside this one, and finishes it. False where it is missing, or no table.
  template <class Read>
  bool with_table(const std::string& name, const Read& read);
  /// The same; complains where it is missing.
  template <class Read>
  bool with_table(const std::string& name, const Read& read, const std::string& expected, const std::string& advice);
  /// Calls `read` with each of the blocks [[name]], and finishes it.
  template <class Read>
  void each_block(const std::string& name, const Read& read);
  /// All keys of this table, asked for or not; none of them is unknown then.
  std::vector<std::string> take_all_keys();

  bool has(const std::string& name) const { return table_->contains(name); }
  std::string key_of(const std::string& name) const { return key_.empty() ? name : key_ + "." + name; }
  const std::string& key() const { return key_; }
  TomlContext& context() const { return *context_; }
  /// Complains about keys that were not asked for, with the nearest known one.
  void finish();

 private:
  const toml::node* find(const std::string& name);

  const toml::table* table_;
  std::string key_;
  TomlContext* context_;
  std::set<std::string> asked_;
};

template <class Read>
bool TomlTable::with_table(const std::string& name, const Read& read) {
  auto inner = table(name);
  if (!inner) return false;
  read(*inner);
  inner->finish();
  return true;
}

template <class Read>
bool TomlTable::with_table(const std::string& name, const Read& read, const std::string& expected,
                           const std::string& advice) {
  if (!has(name)) context_->complain(key_of(name), "no table [" + key_of(name) + "]", expected, advice);
  return with_table(name, read);
}

template <class Read>
void TomlTable::each_block(const std::string& name, const Read& read) {
  for (TomlTable& block : blocks(name)) {
    read(block);
    block.finish();
  }
}

/// Complains where the key `format` is missing or names another format than `expected`, like "capture/1".
void check_format(TomlTable& root, const std::string& expected);

/// Which of several words a key has; the first where it is missing, or where it is another: that is complained about.
std::string read_choice(TomlTable& table, const std::string& name, std::initializer_list<const char*> words);

/// A number with a range. Complains, and answers `fallback`, where it is missing (unless optional) or outside.
struct NumberRule {
  double low = -1e300, high = 1e300;
  bool low_allowed = true, high_allowed = true;
  const char* meaning = "";  ///< for the complaint: what to write, with its unit
};
double read_number(TomlTable& table, const std::string& name, const NumberRule& rule);
double read_number(TomlTable& table, const std::string& name, const NumberRule& rule, double fallback);
/// Nothing where it is missing or outside.
std::optional<double> read_optional_number(TomlTable& table, const std::string& name, const NumberRule& rule);
int read_count(TomlTable& table, const std::string& name, int low, int high, std::optional<int> fallback = {});

/// A direction [-], required, of unit length. Nothing, with a complaint, where it is missing or has no length.
std::optional<Vector3> read_direction(TomlTable& table, const std::string& name, const std::string& advice = "");

/// A lens, `distortion = [k1, k2, p1, p2, ...]`; a straight one where the key is missing.
LensDistortion read_lens(TomlTable& table);

/// Where the files that a TOML file names are looked for.
struct NamedFiles {
  std::filesystem::path folder;  ///< below which relative paths lie
  bool only_relative = false;    ///< refuse absolute paths, so that the folder stays whole when it is moved
};

/// Path of an existing file that a key names; nothing, with a complaint, where it is not there or the key is missing.
std::optional<std::filesystem::path> read_path(TomlTable& table, const std::string& name, const NamedFiles& files);
/// The same; no complaint where the key is missing.
std::optional<std::filesystem::path> read_optional_path(TomlTable& table, const std::string& name,
                                                        const NamedFiles& files);

/// Calls `read` with a file that the key names; the problems that it throws join those of the table.
template <class Read>
void read_file_of(TomlTable& table, const std::string& name, const std::filesystem::path& path, const Read& read) {
  try {
    read(path);
  } catch (const InputError& error) {
    table.context().reject(table.key_of(name), error.problems());
  }
}

/// TOML text of values; numbers come back exactly.
std::string toml_text(double value);
std::string toml_text(const std::string& text);
std::string toml_text(const Vector3& vector);
std::string toml_text(const std::vector<double>& numbers);
std::string toml_text(const RigidMotion& motion);

/// Parses a TOML file's content; a syntax error becomes an InputError with its place.
toml::table parse_toml(const std::string& content, const std::filesystem::path& path);

/// Why a 4 x 4 matrix is no rigid motion, in words; "" where it is one.
std::string why_not_rigid(const Eigen::Matrix4d& matrix);

/// The rigid motion nearest to such a matrix: rounding in the file does not stay in the rotation.
RigidMotion nearest_rigid(const Eigen::Matrix4d& matrix);

}  // namespace pliant
