#pragma once

#include <span>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// Which points of a cloud stand alone, as sensors invent them: those whose sixth nearest neighbour is more than three
/// times as far away as the sixth is by the median. By the cloud alone, whatever it is compared with. None of fewer
/// than seven points.
[[nodiscard]] std::vector<bool> isolated_points(std::span<const Vector3> points);

}  // namespace pliant
