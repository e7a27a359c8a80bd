#include "capture/toml_table.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numeric>

namespace pliant {

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
  if (std::abs(number->get()) > std::numeric_limits<int>::max())
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
  if (!has(name)) {
    find(name);
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
