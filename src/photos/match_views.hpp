#pragma once

#include <functional>
#include <span>
#include <vector>

#include "photos/lens_camera.hpp"

namespace pliant {

/// Dots of one camera's photograph, where they would be without the lens.
struct ViewDots {
  std::vector<Vector2> pixels;  ///< [pixels]; NaN: not to be used
  std::vector<double> sigmas;   ///< of a coordinate [pixels]
};

/// A point in space that several cameras see as a dot.
struct Sighting {
  std::vector<int> dots;             ///< by camera, the dot's number in that view; -1: not seen there
  Vector3 position;                  ///< [m]
  Matrix3 covariance;                ///< [m^2], from the dots' sigmas alone
  double rms = 0.0, greatest = 0.0;  ///< distance of the dots from where the point would be seen [pixels]
  double chi_squared = 0.0;          ///< of the dots, over their sigmas
  int view_count() const;
  int degrees_of_freedom() const { return 2 * view_count() - 3; }
};

/// Point seen at pixels without lens by two cameras or more, by Gauss-Newton on the weighted distances in the images.
/// @param dots  by camera, -1: not seen there
/// Where rays are parallel or the point is behind a camera, `rms` is infinite.
Sighting triangulate(std::span<const LensCamera> cameras, std::span<const ViewDots> views, std::vector<int> dots);

struct MatchOptions {
  double tolerance = 1.0;                                ///< greatest distance of a dot from its point [pixels]
  int least_views = 3;                                   ///< cameras that must see a point, at least 2
  std::function<bool(const Vector3&)> is_possible = {};  ///< whether a point of the object may be here [m]
};

/// Every point that the dots may show: sets of dots, one a camera, from pairs near each other's epipolar lines that
/// agree with dots of the other cameras. Sets contain each other's dots where it is not clear which are right. Throws
/// std::invalid_argument unless there is one view a camera, and two at least.
std::vector<Sighting> possible_sightings(std::span<const LensCamera> cameras, std::span<const ViewDots> views,
                                         const MatchOptions& options);

/// Which of all possible sightings are true.
struct ResolvedSightings {
  std::vector<Sighting> sure;  ///< no two share a dot
  std::vector<Sighting> open;  ///< sets that share dots, and no choice among them was clear
  int ambiguous_dots() const;  ///< dots of all views in them
};

/// Takes a set where no other shares a dot with it, or where all that do are seen by fewer cameras or are clearly
/// worse: by rms more than 2.5 times as far off and by more than a third of the tolerance. Sets worse than five times
/// the median of those taken belong to nothing. What remains is told, not guessed.
ResolvedSightings resolve(std::vector<Sighting> sightings, double tolerance);

/// sqrt(chi^2 / degrees of freedom) of all of them, 1 at least: what lens and pose add to the dots' own noise.
double noise_factor(std::span<const Sighting> sightings);

}  // namespace pliant
