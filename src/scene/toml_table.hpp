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
#include "capture/capture.hpp"

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
  bool is_sound(const std::string& key) const { return !broken.contains(key); }
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

/// Parses a TOML file's content; a syntax error becomes an InputError with its place.
toml::table parse_toml(const std::string& content, const std::filesystem::path& path);

/// Why a 4 x 4 matrix is no rigid motion, in words; "" where it is one.
std::string why_not_rigid(const Eigen::Matrix4d& matrix);

/// The rigid motion nearest to such a matrix: rounding in the file does not stay in the rotation.
RigidMotion nearest_rigid(const Eigen::Matrix4d& matrix);

}  // namespace pliant
