#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "photos/measure.hpp"
#include "photos/paint.hpp"

namespace pliant::test {

/// Measured markers of one photograph against the dots that were painted.
struct MarkerErrors {
  int markers = 0, seen = 0;
  int wrong = 0;                      ///< taken for another dot, or for none
  double mean = 0.0, greatest = 0.0;  ///< [pixels]: length of the error times focal length over depth
  double chi_squared = 0.0;           ///< mean square of a coordinate's error over its stated deviation
};

inline double pixels_per_metre(const PhotoSession& session, const Vector3& place) {
  double sum = 0.0;
  for (const LensCamera& camera : session.cameras) sum += camera.focal_length() / camera.world_to_camera(place).z();
  return sum / double(session.cameras.size());
}

inline int nearest_row(const Points& points, const Vector3& place) {
  Eigen::Index nearest = 0;
  (points.rowwise() - place.transpose()).rowwise().squaredNorm().minCoeff(&nearest);
  return int(nearest);
}

/// @param number   of the photograph; 0: at rest
/// @param at_rest  the dots' centres then [m]
inline MarkerErrors marker_errors(const PhotoExample& example, const MarkerMeasurement& measured, int number,
                                  const Points& at_rest) {
  constexpr double wrong_from = 2.0;  // [pixels]: far above the error of any right match, far below the dots' spacing
  const Points now = dot_centres(example.scene(number));
  const MeasuredMarkers& markers = number == 0 ? measured.rest : measured.presses[std::size_t(number) - 1].markers;
  MarkerErrors out;
  out.markers = int(markers.positions.rows());
  for (Eigen::Index i = 0; i < markers.positions.rows(); ++i) {
    const Vector3 seen = markers.positions.row(i);
    if (!seen.allFinite()) continue;
    const Vector3 truth = now.row(nearest_row(at_rest, measured.rest.positions.row(i)));
    const double error = (seen - truth).norm() * pixels_per_metre(example.session(), truth);
    const Vector3 deviation = markers.deviations.row(i);
    ++out.seen;
    out.wrong += error > wrong_from;
    out.mean += error;
    out.greatest = std::max(out.greatest, error);
    out.chi_squared += (seen - truth).cwiseQuotient(deviation).squaredNorm() / 3.0;
  }
  out.mean /= std::max(out.seen, 1);
  out.chi_squared /= std::max(out.seen, 1);
  return out;
}

/// Spacings of the markers by which the farthest of them moved.
inline double spacings_moved(const PhotoExample& example, const MarkerMeasurement& measured, int number,
                             double spacing) {
  const Points at_rest = dot_centres(example.scene(0)), now = dot_centres(example.scene(number));
  double greatest = 0.0;
  const MeasuredMarkers& markers = measured.presses[std::size_t(number) - 1].markers;
  for (Eigen::Index i = 0; i < markers.positions.rows(); ++i)
    if (markers.positions.row(i).allFinite()) {
      const int dot = nearest_row(at_rest, measured.rest.positions.row(i));
      greatest = std::max(greatest, (now.row(dot) - at_rest.row(dot)).norm());
    }
  return greatest / spacing;
}

inline MarkerMeasurement measure_example(const PhotoExample& example, const PhotoQuality& quality = {}) {
  return measure_markers(example.session(),
                         [&](int camera, int number) { return example.photograph(camera, number, quality); });
}

}  // namespace pliant::test
