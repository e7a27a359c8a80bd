#pragma once

#include <span>
#include <string>
#include <vector>

namespace pliant {

/// Where in time frames are whose numbers are known, in periods from the first. Numbers grow by the step that most of
/// them grow by; where they grow by a multiple of it, frames are missing.
/// @return  empty where the numbers do not grow in such steps: they count no frames
std::vector<int> periods_of(std::span<const long long> numbers);

/// A note of frames that are missing between the first and the last.
/// @param what  that has the gaps: "the numbers in the images' names"
std::string note_of_gaps(std::span<const int> periods, const std::string& what);

}  // namespace pliant
