#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/median.hpp"
#include "capture/markers.hpp"

namespace pliant {

namespace {

constexpr double traded = 0.5;       // of the way that two markers go, which they would go with their names traded
constexpr double sudden = 12.0;      // times what a marker mostly moves against the others from frame to frame
constexpr double of_the_set = 0.05;  // of the markers' extent: smaller jumps are none
constexpr std::size_t most_told = 5;

/// What a marker moved by from where it was seen last, beyond what the median marker did; NaN where it is not seen.
std::vector<double> own_ways(const Points& before, const Points& now) {
  const Points way = now - before;
  Vector3 common;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> seen;
    for (const double w : way.col(axis))
      if (std::isfinite(w)) seen.push_back(w);
    common[axis] = median(std::move(seen));
  }
  std::vector<double> ways;
  for (Eigen::Index i = 0; i < way.rows(); ++i) ways.push_back((way.row(i).transpose() - common).norm());
  return ways;
}

/// The marker with which `i` would go the shortest way, were their names traded; nothing where none is much shorter.
std::optional<Eigen::Index> partner(const Points& before, const Points& now, Eigen::Index i) {
  std::optional<Eigen::Index> best;
  double least = traded;
  for (Eigen::Index j = 0; j < now.rows(); ++j) {
    if (j == i) continue;
    const double own = (now.row(i) - before.row(i)).norm() + (now.row(j) - before.row(j)).norm();
    const double other = (now.row(i) - before.row(j)).norm() + (now.row(j) - before.row(i)).norm();
    if (other < least * own) best = j, least = other / own;  // false of what is not seen
  }
  return best;
}

}  // namespace

std::vector<std::string> marker_doubts(const MarkerSet& markers, bool begins_at_rest) {
  std::vector<std::string> doubts;
  const Eigen::Index count = markers.rest.rows();
  const double extent = (markers.rest.colwise().maxCoeff() - markers.rest.colwise().minCoeff()).norm();
  // What each marker mostly moves by against the others, between frames in which it is seen.
  std::vector<std::vector<double>> usual(markers.ids.size());
  for (std::size_t f = 1; f < markers.frames.size(); ++f) {
    const std::vector<double> ways = own_ways(markers.frames[f - 1], markers.frames[f]);
    for (std::size_t i = 0; i < ways.size(); ++i)
      if (std::isfinite(ways[i])) usual[i].push_back(ways[i]);
  }
  std::vector<double> limit;
  for (const std::vector<double>& ways : usual) limit.push_back(std::max(of_the_set * extent, sudden * median(ways)));
  Points before = begins_at_rest ? markers.rest : Points::Constant(count, 3, std::nan(""));
  std::size_t found = 0;
  const auto tell = [&](std::string sentence) {
    if (++found <= most_told) doubts.push_back(std::move(sentence));
  };
  for (std::size_t f = 0; f < markers.frames.size(); ++f) {
    const Points& now = markers.frames[f];
    const std::vector<double> ways = own_ways(before, now);
    const std::string where = markers.frames.size() == 1 ? "" : fmt::format(" in frame {}", f);
    std::vector<bool> is_told(markers.ids.size(), false);
    const bool tells_jumps = f > 0 && markers.frames.size() > 2;
    for (Eigen::Index i = 0; i < count; ++i) {
      if (is_told[std::size_t(i)] || !(ways[std::size_t(i)] > limit[std::size_t(i)])) continue;
      const auto other = partner(before, now, i);
      if (other && !is_told[std::size_t(*other)]) {
        is_told[std::size_t(*other)] = true;
        tell(fmt::format("markers \"{}\" and \"{}\" trade places{}: their names may be traded",
                         markers.ids[std::size_t(i)], markers.ids[std::size_t(*other)], where));
      } else if (tells_jumps && !other) {
        tell(fmt::format("marker \"{}\" jumps by {:.3g} m{}, the others do not", markers.ids[std::size_t(i)],
                         ways[std::size_t(i)], where));
      }
    }
    for (Eigen::Index i = 0; i < count; ++i)
      if (now.row(i).allFinite()) before.row(i) = now.row(i);
  }
  if (found > most_told) doubts.push_back(fmt::format("{} more of that kind", found - most_told));
  return doubts;
}

}  // namespace pliant
