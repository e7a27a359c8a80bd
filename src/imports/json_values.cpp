#include "imports/json_values.hpp"

#include <limits>
#include <nlohmann/json.hpp>

namespace pliant {

const nlohmann::json& value_at(const nlohmann::json& json, const char* pointer) {
  static const nlohmann::json none;
  const nlohmann::json::json_pointer path(pointer);
  return json.contains(path) ? json[path] : none;
}

std::string text_at(const nlohmann::json& json, const char* pointer) {
  const nlohmann::json& value = value_at(json, pointer);
  return value.is_string() ? value.get<std::string>() : "";
}

int whole_number_at(const nlohmann::json& json, const char* pointer, int otherwise) {
  const nlohmann::json& value = value_at(json, pointer);
  if (!value.is_number_integer()) return otherwise;
  const double number = value.get<double>();  // also of what no integer holds
  return number >= std::numeric_limits<int>::min() && number <= std::numeric_limits<int>::max() ? int(number)
                                                                                                : otherwise;
}

}  // namespace pliant
