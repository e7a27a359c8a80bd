#include "capture/toml_facts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <tuple>

#include "base/files.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

std::optional<Vector3> read_direction(TomlTable& table, const std::string& name) {
  const auto direction = table.required<Vector3>(name);
  if (!direction || direction->norm() > 1e-9)
    return direction ? std::optional<Vector3>(direction->normalized()) : std::nullopt;
  table.context().reject(table.key_of(name), "a direction without length", "a direction like [0, 1, 0]");
  return std::nullopt;
}

std::optional<Region> read_box(TomlTable table) {
  const auto min = table.required<Vector3>("min"), max = table.required<Vector3>("max");
  table.finish();
  if (!min || !max) return std::nullopt;
  if ((min->array() > max->array()).any())
    table.context().reject(table.key(), "a box whose `min` lies above its `max`", "min <= max on each axis",
                           "swap them");
  return RegionBox{*min, *max};
}

std::optional<Region> read_sphere(TomlTable table) {
  const auto centre = table.required<Vector3>("centre");
  const double radius =
      read_number(table, "radius", {.low = 0.0, .low_allowed = false, .meaning = "a radius in metres"});
  table.finish();
  return centre ? std::optional<Region>(RegionSphere{*centre, radius}) : std::nullopt;
}

std::optional<Region> read_half_space(TomlTable table) {
  const auto point = table.required<Vector3>("point");
  const auto normal = read_direction(table, "normal");
  table.finish();
  return point && normal ? std::optional<Region>(RegionHalfSpace{*point, *normal}) : std::nullopt;
}

std::optional<Region> read_vertices(TomlTable& table, const fs::path& folder) {
  const fs::path file = read_path(table, "vertices", folder);
  if (file.empty()) return std::nullopt;
  std::istringstream lines(read_file(file));
  RegionVertices region;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::istringstream words(line);
    int index = -1;
    std::string rest;
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    if (!(words >> index) || index < 0 || words >> rest) {
      table.context().problems.push_back(
          {{file, number, 1}, "\"" + line.substr(0, 40) + "\"", "one vertex index a line", ""});
      return std::nullopt;
    }
    region.indices.push_back(index);
  }
  return region;
}

std::string range_text(const NumberRule& rule) {
  std::string text;
  if (rule.low > -1e300) text = fmt::format("{} {}", rule.low_allowed ? "at least" : "above", rule.low);
  if (rule.high < 1e300)
    text += fmt::format("{}{} {}", text.empty() ? "" : " and ", rule.high_allowed ? "at most" : "below", rule.high);
  return text;
}

double checked(TomlTable& table, const std::string& name, const NumberRule& rule, std::optional<double> value,
               double fallback) {
  if (!value) return fallback;
  const bool low = rule.low_allowed ? *value >= rule.low : *value > rule.low;
  const bool high = rule.high_allowed ? *value <= rule.high : *value < rule.high;
  if (low && high) return *value;
  table.context().reject(table.key_of(name), fmt::format("`{}` is {}", name, *value), range_text(rule), rule.meaning);
  return fallback;
}

}  // namespace

std::optional<Region> read_region(TomlTable& table, const fs::path& folder) {
  int written = 0;
  for (const char* name : {"box", "sphere", "half_space", "vertices"}) written += table.has(name);
  std::optional<Region> region;
  if (auto box = table.table("box")) region = read_box(*box);
  if (auto sphere = table.table("sphere")) region = read_sphere(*sphere);
  if (auto half_space = table.table("half_space")) region = read_half_space(*half_space);
  if (table.has("vertices")) region = read_vertices(table, folder);
  if (written == 1) return region;
  table.context().reject(table.key(), written == 0 ? "no region" : std::to_string(written) + " regions in one block",
                         "one of `box`, `sphere`, `half_space`, `vertices`", "write a block for each region");
  return std::nullopt;
}

FixedRegion read_fixed(TomlTable block, const fs::path& folder) {
  FixedRegion fixed;
  if (auto region = read_region(block, folder)) fixed.region = *region;
  fixed.displaced_to = block.optional<RigidMotion>("displaced_to");
  block.finish();
  return fixed;
}

Plane read_plane(TomlTable block) {
  Plane plane;
  plane.point = block.required<Vector3>("point").value_or(plane.point);
  plane.normal = read_direction(block, "normal").value_or(plane.normal);
  plane.known = block.optional<bool>("known").value_or(true);
  block.finish();
  return plane;
}

Weight read_weight(TomlTable block) {
  Weight weight;
  weight.mass = block.required<double>("mass", "the hung mass in kilograms").value_or(0.0);
  weight.at = block.required<Vector3>("at", "where it hangs, on the rest surface").value_or(Vector3::Zero());
  block.finish();
  return weight;
}

Initial read_initial(TomlTable table) {
  Initial initial;
  initial.linear_velocity = table.optional<Vector3>("linear_velocity").value_or(Vector3::Zero());
  initial.angular_velocity = table.optional<Vector3>("angular_velocity").value_or(Vector3::Zero());
  initial.known = table.optional<bool>("known").value_or(true);
  initial.released = table.optional<bool>("released").value_or(false);
  initial.pulls = table.optional<std::vector<Vector3>>("pulls").value_or(std::vector<Vector3>{});
  if (const auto weight = table.table("release_of")) initial.release_of = read_weight(*weight);
  table.finish();
  return initial;
}

double read_number(TomlTable& table, const std::string& name, const NumberRule& rule) {
  return checked(table, name, rule, table.required<double>(name, rule.meaning), 1.0);
}

double read_number(TomlTable& table, const std::string& name, const NumberRule& rule, double fallback) {
  return checked(table, name, rule, table.optional<double>(name), fallback);
}

int read_count(TomlTable& table, const std::string& name, int low, int high, std::optional<int> fallback) {
  const auto value = fallback ? table.optional<int>(name) : table.required<int>(name);
  if (value && (*value < low || *value > high))
    table.context().reject(table.key_of(name), fmt::format("`{}` is {}", name, *value),
                           fmt::format("{} to {}", low, high));
  return value.value_or(fallback.value_or(low));
}

fs::path read_path(TomlTable& table, const std::string& name, const fs::path& folder) {
  const auto text = table.required<std::string>(name);
  if (!text) return {};
  const fs::path path = (folder / *text).lexically_normal();
  if (is_file(path)) return path;
  table.context().reject(table.key_of(name), "the file \"" + *text + "\" " + why_no_file(path),
                         "a file in " + folder.string(), "check the spelling, or copy the file");
  return {};
}

void throw_problems(TomlContext& context) {
  if (context.problems.empty()) return;
  std::stable_sort(context.problems.begin(), context.problems.end(), [](const Problem& a, const Problem& b) {
    return std::tie(a.place.line, a.place.column) < std::tie(b.place.line, b.place.column);
  });
  throw InputError(context.problems);
}

std::string toml_text(double value) {
  const std::string text = fmt::format("{}", value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

std::string toml_text(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      out += std::string("\\") + c;
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\u{:04X}", int(static_cast<unsigned char>(c)));
    else
      out += c;
  }
  return out + "\"";
}

std::string toml_text(const Vector3& v) {
  return "[" + toml_text(v.x()) + ", " + toml_text(v.y()) + ", " + toml_text(v.z()) + "]";
}

std::string toml_text(const RigidMotion& motion) {
  std::string out = "[";
  for (int i = 0; i < 3; ++i) {
    out += "[";
    for (int j = 0; j < 3; ++j) out += toml_text(motion.rotation(i, j)) + ", ";
    out += toml_text(motion.translation[i]) + "], ";
  }
  return out + "[0.0, 0.0, 0.0, 1.0]]";
}

void write_toml(std::ostream& out, const Plane& plane) {
  out << "[[plane]]\npoint = " << toml_text(plane.point) << "   # m\nnormal = " << toml_text(plane.normal)
      << "   # to the side where the object may be\nknown = " << (plane.known ? "true" : "false") << "\n\n";
}

void write_toml(std::ostream& out, const Weight& weight) {
  out << "[[weight]]\nmass = " << toml_text(weight.mass) << "   # kg, hung\nat = " << toml_text(weight.at)
      << "   # m, on the rest surface\n\n";
}

void write_toml(std::ostream& out, const Initial& initial) {
  out << "[initial]\nlinear_velocity = " << toml_text(initial.linear_velocity)
      << "   # m/s, of the centre of mass\nangular_velocity = " << toml_text(initial.angular_velocity)
      << "   # rad/s\nknown = " << (initial.known ? "true" : "false")
      << "\nreleased = " << (initial.released ? "true" : "false") << "\n";
  if (!initial.pulls.empty()) {
    out << "pulls = [";
    for (std::size_t k = 0; k < initial.pulls.size(); ++k) out << (k > 0 ? ", " : "") << toml_text(initial.pulls[k]);
    out << "]   # what holds the object until it is released, times its size about how far each moves it\n";
  }
  if (initial.release_of)
    out << "release_of = { mass = " << toml_text(initial.release_of->mass)
        << ", at = " << toml_text(initial.release_of->at) << " }   # kg and m: hangs until the object is released\n";
  out << "\n";
}

void write_toml(std::ostream& out, const FixedRegion& fixed, const std::string& vertices_file) {
  out << "[[fixed]]\n";
  if (const auto* box = std::get_if<RegionBox>(&fixed.region))
    out << "box = { min = " << toml_text(box->min) << ", max = " << toml_text(box->max) << " }\n";
  else if (const auto* sphere = std::get_if<RegionSphere>(&fixed.region))
    out << "sphere = { centre = " << toml_text(sphere->centre) << ", radius = " << toml_text(sphere->radius) << " }\n";
  else if (const auto* half = std::get_if<RegionHalfSpace>(&fixed.region))
    out << "half_space = { point = " << toml_text(half->point) << ", normal = " << toml_text(half->normal) << " }\n";
  else
    out << "vertices = " << toml_text(vertices_file) << "\n";
  if (fixed.displaced_to) out << "displaced_to = " << toml_text(*fixed.displaced_to) << "\n";
  out << "\n";
}

}  // namespace pliant
