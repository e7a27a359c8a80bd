#pragma once

#include <optional>

#include "capture/capture.hpp"

namespace pliant {

/// A plane seen in depth images or clouds.
struct FoundPlane : Plane {
  double rms = 0.0;  ///< of the readings' distances to it [m]
  int pixels = 0;    ///< readings on it
};

/// Fits a plane that is only roughly known to what the sensors saw of it: the backgrounds, else of depth cameras the
/// first frames without the object's pixels. Looks within 25 degrees of the guess and a distance that grows with how
/// far a reading lies from `guess.point`; a plane more than 0.1 m from that point is another one.
/// @return  the plane, its point nearest to `guess.point`, its normal to the guess's side, `known` true;
///          nothing where no camera sees enough of such a plane
/// Throws InputError where an image cannot be decoded.
[[nodiscard]] std::optional<FoundPlane> find_plane(const Capture& capture, const Plane& guess);

}  // namespace pliant
