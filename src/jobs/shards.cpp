#include "jobs/shards.hpp"

#include <cstdio>

#include "base/error.hpp"

namespace pliant {

Shard shard_named(const std::string& text) {
  if (text.empty()) return {};
  Shard shard;
  int end = 0;
  if (std::sscanf(text.c_str(), "%d/%d%n", &shard.part, &shard.parts, &end) != 2 || std::size_t(end) != text.size() ||
      shard.part < 1 || shard.part > shard.parts)
    throw InputError({{}, "--shard " + text, "PART/PARTS, such as 3/50", ""});
  return shard;
}

}  // namespace pliant
