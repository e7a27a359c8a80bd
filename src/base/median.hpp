#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace pliant {

/// The value in the middle of all, of an even number the upper of the two; zero of none.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T{};
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace pliant
