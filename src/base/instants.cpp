#include "base/instants.hpp"

#include <algorithm>
#include <stdexcept>

namespace pliant {

std::vector<double> instants_of(std::vector<double> times) {
  std::ranges::sort(times);
  const auto again = std::ranges::unique(times, [](double a, double b) { return b - a < same_instant; });
  times.erase(again.begin(), again.end());
  return times;
}

std::size_t instant_at(const std::vector<double>& instants, double time) {
  const auto it = std::ranges::lower_bound(instants, time - same_instant);
  if (it == instants.end() || *it > time + same_instant) throw std::out_of_range("a time that is none of the instants");
  return std::size_t(it - instants.begin());
}

}  // namespace pliant
