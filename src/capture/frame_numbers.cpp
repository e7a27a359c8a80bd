#include "capture/frame_numbers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace pliant {

std::vector<int> periods_of(std::span<const long long> numbers) {
  std::map<long long, int> steps;
  for (std::size_t i = 1; i < numbers.size(); ++i) ++steps[numbers[i] - numbers[i - 1]];
  if (steps.empty()) return std::vector<int>(numbers.size(), 0);
  const long long usual = std::ranges::max_element(steps, {}, &std::pair<const long long, int>::second)->first;
  const auto is_multiple = [&](const auto& step) { return step.first > 0 && step.first % usual == 0; };
  if (usual <= 0 || !std::ranges::all_of(steps, is_multiple)) return {};
  std::vector<int> periods;
  for (const long long number : numbers) periods.push_back(int((number - numbers[0]) / usual));
  return periods;
}

std::string note_of_gaps(std::span<const int> periods, const std::string& what) {
  int missing = 0;
  std::size_t before = 0;
  for (std::size_t i = 1; i < periods.size(); ++i)
    if (const int lost = periods[i] - periods[i - 1] - 1; lost > 0) {
      if (missing == 0) before = i - 1;
      missing += lost;
    }
  return fmt::format("{} of {} frames are missing by {}, the first between frames {} and {}: time passes there",
                     missing, periods.back() + 1, what, before, before + 1);
}

}  // namespace pliant
