#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "capture/capture.hpp"
#include "scene/toml_table.hpp"

namespace pliant {

/// What a rule sees: the capture as read so far, and where to complain.
struct RuleContext {
  const Capture& capture;
  TomlContext& toml;
};

/// One thing that a valid capture must satisfy. A rule skips what an earlier one or the reader found broken.
using Rule = void (*)(RuleContext&);

/// @name Words of the rules' complaints
/// @{
std::string text_of(double value, const char* unit);  ///< four digits and the unit
std::string text_of(const Vector3& v);                ///< "[x, y, z]" of four digits each
/// A key of the i-th entry of an array of tables, "name[i].key"; the entry itself without a key.
std::string item(const char* name, std::size_t i, const char* key = "");
/// @}

/// Rules about the facts alone.
std::vector<Rule> fact_rules();

/// These, and then those that open the recording's files, in the order in which they are applied.
std::span<const Rule> capture_rules();

/// Frames that a sequence holds when it has one for every `every`-th of `frame_count`.
std::vector<int> frames_of(int frame_count, int every);

/// "3, 7-9, 12" from sorted numbers; with many runs the rest is counted.
std::string ranges_text(std::span<const int> numbers);

}  // namespace pliant
