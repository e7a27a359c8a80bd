#pragma once

#include <filesystem>
#include <ostream>
#include <string>

#include "capture/capture.hpp"
#include "capture/toml_table.hpp"

// What scenes and models say in the words of a capture (docs/formats.md): regions, planes, first velocities.

namespace pliant {

/// A region: one of `box`, `sphere`, `half_space`, `vertices` (a file in `folder` with one index a line).
/// Nothing, with a complaint in the table's context, where there is none or it makes no sense.
std::optional<Region> read_region(TomlTable& table, const std::filesystem::path& folder);

/// A [[fixed]] block, a [[plane]] block, a [[weight]] block, the table [initial]; each finishes its table.
FixedRegion read_fixed(TomlTable block, const std::filesystem::path& folder);
Plane read_plane(TomlTable block);
Weight read_weight(TomlTable block);
Initial read_initial(TomlTable table);

/// A number with a range. Complains, and answers `fallback`, where it is missing (unless optional) or outside.
struct NumberRule {
  double low = -1e300, high = 1e300;
  bool low_allowed = true, high_allowed = true;
  const char* meaning = "";  ///< for the complaint: what to write, with its unit
};
double read_number(TomlTable& table, const std::string& name, const NumberRule& rule);
double read_number(TomlTable& table, const std::string& name, const NumberRule& rule, double fallback);
int read_count(TomlTable& table, const std::string& name, int low, int high, std::optional<int> fallback = {});

/// An existing file named by a key, below `folder`; an empty path, with a complaint, where it is not there.
std::filesystem::path read_path(TomlTable& table, const std::string& name, const std::filesystem::path& folder);

/// Throws InputError with all problems in the order of their lines, if there are any.
void throw_problems(TomlContext& context);

/// TOML text of values; numbers come back exactly.
std::string toml_text(double value);
std::string toml_text(const std::string& text);
std::string toml_text(const Vector3& vector);
std::string toml_text(const RigidMotion& motion);

/// The same blocks as text. @param vertices_file  for a region of vertices: the file that lists them
void write_toml(std::ostream& out, const Plane& plane);
void write_toml(std::ostream& out, const Weight& weight);
void write_toml(std::ostream& out, const Initial& initial);
void write_toml(std::ostream& out, const FixedRegion& fixed, const std::string& vertices_file);

}  // namespace pliant
