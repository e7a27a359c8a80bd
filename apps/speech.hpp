#pragma once

#include <cstdio>
#include <iostream>
#include <optional>
#include <string>

#include "simulation/strain_range.hpp"

/// What commands tell people on stdout.
namespace pliant::apps {

/// As by printf; what is longer than 511 characters is cut off.
template <class... Values>
std::string formatted(const char* format, Values... values) {
  char text[512];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

/// A line of a description: a heading, or none, in a column of its own, and a text.
inline void say(const std::string& heading, const std::string& text, int column = 13) {
  std::cout << formatted("%-*s", column, heading.c_str()) << text << '\n';
}

/// Where an object is strained by more than while its model was fitted: see `extrapolation_note`.
inline void say_if_extrapolated(const std::optional<DeformationResult>& recorded,
                                const std::optional<DeformationResult>& strained) {
  const std::string note = extrapolation_note(recorded, strained);
  if (!note.empty()) std::cout << "note: " << note << '\n';
}

}  // namespace pliant::apps
