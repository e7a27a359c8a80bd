#include "scene/toml_table.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>
#include <tuple>

#include "base/files.hpp"
#include "base/old_names.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

std::string parent_of(const std::string& key) {
  const auto dot = key.rfind('.');
  return dot == std::string::npos ? "" : key.substr(0, dot);
}

struct Mismatch {
  std::string found, expected, advice;
};

std::string kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::string:
      return "a text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    case toml::node_type::array:
      return "a list of " + std::to_string(node.as_array()->size());
    case toml::node_type::table:
      return "a table";
    default:
      return "a date or time";
  }
}

std::string number_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::optional<Mismatch> convert(const toml::node& node, double& value) {
  const auto number = node.value<double>();
  if (!number || node.is_boolean()) return Mismatch{kind_of(node), "a number", ""};
  if (!std::isfinite(*number)) return Mismatch{number_text(*number), "a finite number", ""};
  value = *number;
  return {};
}

std::optional<Mismatch> convert(const toml::node& node, int& value) {
  const auto number = node.as_integer();
  if (!number) return Mismatch{kind_of(node), "a whole number", ""};
  if (number->get() > std::numeric_limits<int>::max() || number->get() < -std::numeric_limits<int>::max())
    return Mismatch{std::to_string(number->get()), "a smaller number", ""};
  value = int(number->get());
  return {};
}

std::optional<Mismatch> convert(const toml::node& node, bool& value) {
  if (!node.is_boolean()) return Mismatch{kind_of(node), "true or false", ""};
  value = node.as_boolean()->get();
  return {};
}

std::optional<Mismatch> convert(const toml::node& node, std::string& value) {
  if (!node.is_string()) return Mismatch{kind_of(node), "a text in quotes", ""};
  value = node.as_string()->get();
  if (value.empty()) return Mismatch{"an empty text", "a text", ""};
  return {};
}

template <int n>
std::optional<Mismatch> convert_list(const toml::node& node, Eigen::Matrix<double, n, 1>& value, const char* expected) {
  const toml::array* list = node.as_array();
  if (!list || list->size() != n) return Mismatch{kind_of(node), expected, ""};
  for (int i = 0; i < n; ++i)
    if (auto mismatch = convert(*list->get(std::size_t(i)), value[i]))
      return Mismatch{mismatch->found + " as component " + std::to_string(i + 1), expected, ""};
  return {};
}

std::optional<Mismatch> convert(const toml::node& node, Vector3& value) {
  return convert_list<3>(node, value, "three numbers [x, y, z]");
}

std::optional<Mismatch> convert(const toml::node& node, std::vector<Vector3>& values) {
  const toml::array* list = node.as_array();
  if (!list) return Mismatch{kind_of(node), "a list of vectors [[x, y, z], ...]", ""};
  for (const toml::node& item : *list)
    if (auto mismatch = convert(item, values.emplace_back()))
      return Mismatch{mismatch->found + " as vector " + std::to_string(values.size()), mismatch->expected, ""};
  return {};
}

std::optional<Mismatch> convert(const toml::node& node, std::vector<double>& values) {
  const toml::array* list = node.as_array();
  if (!list) return Mismatch{kind_of(node), "a list of numbers [x, y, ...]", ""};
  for (const toml::node& item : *list)
    if (auto mismatch = convert(item, values.emplace_back()))
      return Mismatch{mismatch->found + " as number " + std::to_string(values.size()), "a list of numbers", ""};
  return {};
}

std::optional<Mismatch> convert(const toml::node& node, RigidMotion& value) {
  const toml::array* rows = node.as_array();
  const char* expected = "a 4 x 4 matrix, row by row: [[..4 numbers..], [..], [..], [0, 0, 0, 1]]";
  if (!rows || rows->size() != 4) return Mismatch{kind_of(node), expected, ""};
  Eigen::Matrix4d matrix;
  for (int row = 0; row < 4; ++row) {
    Eigen::Vector4d numbers;
    if (auto mismatch = convert_list<4>(*rows->get(std::size_t(row)), numbers, expected))
      return Mismatch{mismatch->found + " in row " + std::to_string(row + 1), expected, ""};
    matrix.row(row) = numbers.transpose();
  }
  if (const std::string why = why_not_rigid(matrix); !why.empty())
    return Mismatch{why, "a rigid motion: orthonormal rotation, last row [0, 0, 0, 1]",
                    "write the matrix row by row, in metres, without scale or mirroring"};
  value = nearest_rigid(matrix);
  return {};
}

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    int diagonal = std::exchange(row[0], int(i));
    for (std::size_t j = 1; j <= b.size(); ++j)
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, diagonal + int(a[i - 1] != b[j - 1])}));
  }
  return row.back();
}

std::string range_text(const NumberRule& rule) {
  std::string text;
  if (rule.low > -1e300) text = fmt::format("{} {}", rule.low_allowed ? "at least" : "above", rule.low);
  if (rule.high < 1e300)
    text += fmt::format("{}{} {}", text.empty() ? "" : " and ", rule.high_allowed ? "at most" : "below", rule.high);
  return text;
}

std::optional<double> checked(TomlTable& table, const std::string& name, const NumberRule& rule,
                              std::optional<double> value) {
  if (!value) return std::nullopt;
  const bool low = rule.low_allowed ? *value >= rule.low : *value > rule.low;
  const bool high = rule.high_allowed ? *value <= rule.high : *value < rule.high;
  if (low && high) return value;
  table.context().reject(table.key_of(name), fmt::format("`{}` is {}", name, *value), range_text(rule), rule.meaning);
  return std::nullopt;
}

// Whether the path may stand in such a file and something is there; complains where not.
std::optional<fs::path> existing(TomlTable& table, const std::string& name, const std::string& text,
                                 const NamedFiles& files) {
  if (files.only_relative && fs::path(text).is_absolute()) {
    table.context().reject(table.key_of(name), "the absolute path \"" + text + "\"",
                           "a path relative to the folder of this file",
                           "the folder must still be whole when it is moved");
    return std::nullopt;
  }
  const fs::path path = (files.folder / text).lexically_normal();
  if (is_file(path)) return path;
  table.context().reject(table.key_of(name), "the file \"" + text + "\" " + why_no_file(path),
                         "a file in " + files.folder.string(), "check the spelling, or copy the file");
  return std::nullopt;
}

}  // namespace

Place TomlPlaces::operator()(std::string key) const {
  for (; !key.empty(); key = parent_of(key))
    if (const auto found = places_.find(key); found != places_.end()) return found->second;
  return {file_, 1, 1};
}

void TomlContext::complain(const std::string& key, std::string found, std::string expected, std::string advice) {
  problems.push_back({places(key), std::move(found), std::move(expected), std::move(advice)});
}

void TomlContext::reject(const std::string& key, std::string found, std::string expected, std::string advice) {
  complain(key, std::move(found), std::move(expected), std::move(advice));
  for (std::string at = key; !at.empty(); at = parent_of(at)) broken.insert(at);
}

void TomlContext::reject(const std::string& key, const std::vector<Problem>& problems_of_file) {
  problems.insert(problems.end(), problems_of_file.begin(), problems_of_file.end());
  for (std::string at = key; !at.empty(); at = parent_of(at)) broken.insert(at);
}

void TomlContext::throw_problems() {
  if (problems.empty()) return;
  const auto rank = [&](const Problem& problem) {
    const bool is_own = problem.place.file == places.file();
    return is_own ? std::tuple(0, problem.place.line, problem.place.column) : std::tuple(1, 0, 0);
  };
  std::ranges::stable_sort(problems, {}, rank);
  throw InputError(std::move(problems));
}

std::string nearest_name(std::string_view name, const std::set<std::string>& known) {
  std::string nearest;
  int least = std::max(2, int(name.size()) / 2) + 1;
  for (const std::string& candidate : known)
    if (const int distance = edit_distance(name, candidate); distance < least) {
      least = distance;
      nearest = candidate;
    }
  return nearest;
}

TomlTable::TomlTable(const toml::table& table, std::string key, TomlContext& context)
    : table_(&table), key_(std::move(key)), context_(&context) {
  const auto position = table.source().begin;
  if (!key_.empty()) context.places.add(key_, int(position.line), int(position.column));
  for (const auto& [name, node] : table) {
    const auto at = name.source().begin;
    context.places.add(key_of(std::string(name.str())), int(at.line), int(at.column));
  }
}

const toml::node* TomlTable::find(const std::string& name) {
  asked_.insert(name);
  if (!table_->contains(name))
    if (const std::string former = former_name(name); !former.empty() && table_->contains(former)) {
      asked_.insert(former);
      note_former_word(former, name, context_->places.file().filename().string());
      return table_->get(former);
    }
  return table_->get(name);
}

template <class T>
std::optional<T> TomlTable::optional(const std::string& name) {
  const toml::node* node = find(name);
  if (!node) return std::nullopt;
  T value{};
  if (auto mismatch = convert(*node, value)) {
    context_->reject(key_of(name), "`" + name + "` is " + mismatch->found, mismatch->expected, mismatch->advice);
    return std::nullopt;
  }
  return value;
}

template <class T>
std::optional<T> TomlTable::required(const std::string& name, const std::string& advice) {
  if (!find(name)) {
    const std::string where = key_.empty() ? "the file" : "[" + key_ + "]";
    context_->reject(key_of(name), where + " has no `" + name + "`", "the key `" + name + "`", advice);
    return std::nullopt;
  }
  return optional<T>(name);
}

#define PLIANT_INSTANTIATE(T)                                        \
  template std::optional<T> TomlTable::optional(const std::string&); \
  template std::optional<T> TomlTable::required(const std::string&, const std::string&);
PLIANT_INSTANTIATE(double)
PLIANT_INSTANTIATE(int)
PLIANT_INSTANTIATE(bool)
PLIANT_INSTANTIATE(std::string)
PLIANT_INSTANTIATE(Vector3)
PLIANT_INSTANTIATE(std::vector<Vector3>)
PLIANT_INSTANTIATE(std::vector<double>)
PLIANT_INSTANTIATE(RigidMotion)
#undef PLIANT_INSTANTIATE

std::optional<TomlTable> TomlTable::table(const std::string& name) {
  const toml::node* node = find(name);
  if (!node) return std::nullopt;
  if (!node->is_table()) {
    context_->reject(key_of(name), "`" + name + "` is " + kind_of(*node), "a table [" + key_of(name) + "]",
                     node->is_array() ? "write single brackets: there is one of it" : "");
    return std::nullopt;
  }
  return TomlTable(*node->as_table(), key_of(name), *context_);
}

std::vector<TomlTable> TomlTable::blocks(const std::string& name) {
  const toml::node* node = find(name);
  if (!node) return {};
  const toml::array* list = node->as_array();
  if (!list || !std::all_of(list->begin(), list->end(), [](const toml::node& item) { return item.is_table(); })) {
    context_->reject(key_of(name), "`" + name + "` is " + kind_of(*node), "blocks [[" + key_of(name) + "]]",
                     "write double brackets: there may be several of it");
    return {};
  }
  std::vector<TomlTable> blocks;
  for (std::size_t i = 0; i < list->size(); ++i)
    blocks.emplace_back(*list->get(i)->as_table(), key_of(name) + "[" + std::to_string(i) + "]", *context_);
  return blocks;
}

std::vector<std::string> TomlTable::take_all_keys() {
  std::vector<std::string> keys;
  for (const auto& [name, node] : *table_) {
    keys.emplace_back(name.str());
    asked_.insert(keys.back());
  }
  return keys;
}

void TomlTable::finish() {
  for (const auto& [name, node] : *table_) {
    const std::string own(name.str());
    if (asked_.contains(own)) continue;
    const std::string nearest = nearest_name(own, asked_);
    std::string known;
    for (const std::string& candidate : asked_) known += (known.empty() ? "" : ", ") + candidate;
    context_->complain(key_of(own), "the unknown key `" + own + "`" + (key_.empty() ? "" : " in [" + key_ + "]"),
                       nearest.empty() ? "one of " + known : "`" + nearest + "`",
                       nearest.empty() ? "remove it" : "did you mean `" + nearest + "`? Else remove it");
  }
}

void check_format(TomlTable& root, const std::string& expected) {
  const auto format = root.required<std::string>("format", "write format = \"" + expected + "\" first");
  if (format && *format != expected)
    root.context().complain("format", "the format \"" + *format + "\"", "\"" + expected + "\"",
                            "use a program that knows this format");
}

std::string read_choice(TomlTable& table, const std::string& name, std::initializer_list<const char*> words) {
  const auto word = table.optional<std::string>(name);
  if (!word) return *words.begin();
  std::string list;
  for (const char* possible : words) {
    if (*word == possible) return *word;
    list += (list.empty() ? "\"" : ", \"") + std::string(possible) + "\"";
  }
  table.context().reject(table.key_of(name), "`" + name + "` is \"" + *word + "\"", "one of " + list,
                         "write one of these, or leave it out");
  return *words.begin();
}

double read_number(TomlTable& table, const std::string& name, const NumberRule& rule) {
  return checked(table, name, rule, table.required<double>(name, rule.meaning)).value_or(1.0);
}

double read_number(TomlTable& table, const std::string& name, const NumberRule& rule, double fallback) {
  return read_optional_number(table, name, rule).value_or(fallback);
}

std::optional<double> read_optional_number(TomlTable& table, const std::string& name, const NumberRule& rule) {
  return checked(table, name, rule, table.optional<double>(name));
}

int read_count(TomlTable& table, const std::string& name, int low, int high, std::optional<int> fallback) {
  const auto value = fallback ? table.optional<int>(name) : table.required<int>(name);
  if (value && (*value < low || *value > high))
    table.context().reject(table.key_of(name), fmt::format("`{}` is {}", name, *value),
                           fmt::format("{} to {}", low, high));
  return value.value_or(fallback.value_or(low));
}

std::optional<Vector3> read_direction(TomlTable& table, const std::string& name, const std::string& advice) {
  const auto direction = table.required<Vector3>(name, advice);
  if (!direction) return std::nullopt;
  if (direction->norm() > 1e-9) return direction->normalized();
  table.context().reject(table.key_of(name), "`" + name + "` is a direction without length",
                         "a direction like [0, 1, 0]", advice);
  return std::nullopt;
}

LensDistortion read_lens(TomlTable& table) {
  const auto coefficients = table.optional<std::vector<double>>("distortion");
  if (!coefficients || coefficients->empty()) return {};
  if (LensDistortion::takes(coefficients->size())) return LensDistortion(*coefficients);
  table.context().reject(table.key_of("distortion"), fmt::format("{} coefficients", coefficients->size()),
                         std::string(LensDistortion::counts) + " of them", "k1, k2, p1, p2, k3, ... as in OpenCV");
  return {};
}

std::optional<fs::path> read_path(TomlTable& table, const std::string& name, const NamedFiles& files) {
  const auto text = table.required<std::string>(name);
  return text ? existing(table, name, *text, files) : std::nullopt;
}

std::optional<fs::path> read_optional_path(TomlTable& table, const std::string& name, const NamedFiles& files) {
  const auto text = table.optional<std::string>(name);
  return text ? existing(table, name, *text, files) : std::nullopt;
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

std::string toml_text(const std::vector<double>& numbers) {
  std::string out;
  for (const double number : numbers) out += (out.empty() ? "" : ", ") + toml_text(number);
  return "[" + out + "]";
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

toml::table parse_toml(const std::string& content, const std::filesystem::path& path) {
  try {
    return toml::parse(content, path.string());
  } catch (const toml::parse_error& error) {
    const auto at = error.source().begin;
    throw InputError(Problem{{path, int(at.line), int(at.column)}, std::string(error.description()), "TOML", ""});
  }
}

std::string why_not_rigid(const Eigen::Matrix4d& matrix) {
  // Files carry three to nine decimals; a thousandth is above their rounding and far below any scale or shear meant.
  constexpr double tolerance = 2e-3;
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 1e-9)
    return matrix.col(3).head<3>().isZero() && !matrix.row(3).head<3>().isZero()
               ? "a matrix with its translation in the last row: it is transposed"
               : "a matrix whose last row is not [0, 0, 0, 1]";
  const Matrix3 rotation = matrix.topLeftCorner<3, 3>();
  const double deviation = (rotation.transpose() * rotation - Matrix3::Identity()).cwiseAbs().maxCoeff();
  if (deviation > tolerance) return "a matrix whose axes are not orthonormal (off by " + number_text(deviation) + ")";
  if (rotation.determinant() < 0) return "a matrix that mirrors (determinant -1)";
  return "";
}

RigidMotion nearest_rigid(const Eigen::Matrix4d& matrix) {
  const Eigen::JacobiSVD<Matrix3> svd(matrix.topLeftCorner<3, 3>(), Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU() * svd.matrixV().transpose(), matrix.col(3).head<3>()};
}

}  // namespace pliant
