#pragma once

#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "choices.hpp"

namespace pliant {

/// The JSON file that a choice "request" names. Throws std::invalid_argument where it cannot be read.
inline nlohmann::json read_request(const Choices& choices) {
  std::ifstream file(choices.at("request"));
  if (!file) throw std::invalid_argument("cannot read " + choices.at("request"));
  return nlohmann::json::parse(file);
}

}  // namespace pliant
