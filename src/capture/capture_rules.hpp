#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "base/error.hpp"
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

/// What is wrong with a file that several blocks name is told once; nothing else of the block is looked at then.
void add_problems(RuleContext& context, const std::string& key, const InputError& error);

/// Reads a file that a block names.
template <class Read>
void try_file(RuleContext& context, const std::string& key, const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    add_problems(context, key, error);
  }
}

/// Visits the blocks of an array of tables in which nothing was found broken, each with its key.
template <class Block, class Visit>
void for_each_sound(RuleContext& context, const char* name, const std::vector<Block>& blocks, const Visit& visit) {
  for (std::size_t i = 0; i < blocks.size(); ++i)
    if (const std::string key = item(name, i); context.toml.is_sound(key)) visit(blocks[i], key);
}

/// Rules about the facts alone.
std::vector<Rule> fact_rules();

/// Rules about whether what was recorded shows the object where the capture has it.
std::vector<Rule> sight_rules();

/// These, and then those that open the recording's files, in the order in which they are applied.
std::span<const Rule> capture_rules();

/// Frames that a sequence holds when it has one for every `every`-th of `frame_count`.
std::vector<int> frames_of(int frame_count, int every);

/// "3, 7-9, 12" from sorted numbers; with many runs the rest is counted.
std::string ranges_text(std::span<const int> numbers);

}  // namespace pliant
