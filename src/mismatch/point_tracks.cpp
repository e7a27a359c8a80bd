#include "mismatch/point_tracks.hpp"

namespace pliant {

Points PointTracks::tangent(std::span<const TrackObservation> seen, const Points& d_positions) const {
  Points moved(Eigen::Index(seen.size()), 3);
  for (std::size_t i = 0; i < seen.size(); ++i)
    moved.row(Eigen::Index(i)) = points_.position(seen[i].point, d_positions).transpose();
  return moved;
}

Points PointTracks::residuals(std::span<const TrackObservation> seen, const Points& positions) const {
  Points r = tangent(seen, positions);
  for (std::size_t i = 0; i < seen.size(); ++i) r.row(Eigen::Index(i)) -= seen[i].position.transpose();
  return r;
}

void PointTracks::add_adjoint(std::span<const TrackObservation> seen, const Points& residual_bar,
                              Points& positions_bar) const {
  for (std::size_t i = 0; i < seen.size(); ++i)
    points_.add_transpose(seen[i].point, residual_bar.row(Eigen::Index(i)).transpose(), positions_bar);
}

}  // namespace pliant
