#pragma once

#include <string>
#include <vector>

namespace pliant {

/// One of several equal parts of all jobs.
struct Shard {
  int part = 1, parts = 1;  ///< 1 <= part <= parts
};

/// The part that a text such as "3/50" names; all jobs where it is empty. Throws InputError for another text.
Shard shard_named(const std::string& text);

/// The jobs of a part: every so many of them, in their order.
template <class Job>
std::vector<Job> shard_of(const std::vector<Job>& jobs, const Shard& shard) {
  std::vector<Job> own;
  for (std::size_t k = std::size_t(shard.part - 1); k < jobs.size(); k += std::size_t(shard.parts))
    own.push_back(jobs[k]);
  return own;
}

}  // namespace pliant
