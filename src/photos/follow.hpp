#pragma once

#include <span>
#include <vector>

#include "base/types.hpp"

namespace pliant {

/// Which of the points seen under load is which marker.
struct Followed {
  std::vector<int> candidate;  ///< by marker: number of the point seen; -1: not seen, or not clear which
  int unclear = 0;             ///< markers left out because two points would do, or their neighbours contradict them
  /// Where every marker is expected, m x 3 [m]: what was seen, else what its neighbours say, else as predicted.
  Points expected;
  int followed_count() const;
};

/// Finds markers of a shape at rest among points seen under load. It begins with markers that stand where they were
/// predicted, their neighbours likewise, and goes on from there: the affine motion of neighbours already found says
/// where the next one should be, and a point is taken where it is alone within a part of the markers' spacing about
/// that place. At the end each one must agree with what its neighbours say without it.
/// @param rest        where markers are at rest, m x 3 [m]
/// @param prediction  where they are thought to be, m x 3 [m]: at rest, or under a smaller load; all finite
/// @param candidates  points seen, k x 3 [m]; some may be no markers
/// Displacements may be many spacings where they grow from regions that stay as predicted. Throws std::invalid_argument
/// where the two m differ or a number is not finite.
Followed follow_markers(const Points& rest, const Points& prediction, const Points& candidates);

/// What several attempts with different predictions agree on: a marker keeps its point where all attempts that found it
/// found the same, and no other marker claims that point. Attempts that found less than half of what the best one
/// found are not heard. `expected` is that of the attempt which found most.
Followed agreement(std::span<const Followed> attempts);

/// Median distance [m] of points to their nearest neighbour.
double spacing_of(const Points& points);

}  // namespace pliant
