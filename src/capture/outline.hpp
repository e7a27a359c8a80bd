#pragma once

#include <vector>

#include "capture/capture.hpp"
#include "capture/image_io.hpp"

namespace pliant {

/// The outline of the object in a picture: points halfway between a pixel that shows it and one that does not, in order
/// along closed curves that go around the object and around its holes.
struct Outline {
  std::vector<Vector2> points;   ///< [pixels], where a lens that does not bend would show them
  std::vector<Vector2> normals;  ///< unit, away from the object
  bool is_cut = false;           ///< whether the object reaches the picture's border; what lies along it is no outline
};

/// @param mask    not zero where the pixel shows the object; pixels that touch by a corner belong together
/// @param camera  of the mask's size
/// Gaps of up to two pixels are closed. Curves shorter than 12 pixels are specks, holes of less than a hundredth of the
/// object missing readings: both are left out, and so are points within four pixels of the border.
Outline outline_of(const Image<std::uint8_t>& mask, const PinholeCamera& camera);

/// Size of a pixel [m] at the object, where that is at rest before the camera as it stands in a frame.
/// Throws std::invalid_argument where the capture has no scan.
double pixel_size(const Capture& capture, const SilhouetteCamera& camera, int frame);

}  // namespace pliant
