#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "capture/image_io.hpp"
#include "photos/lens_camera.hpp"

namespace pliant {

/// What dots look like against what is around them. Of each colour one number of a pixel tells its dots from the
/// others': dark 1 - max(r, g, b), light min(r, g, b), red (r - max(g, b)) / max(r, g, b), yellow (min(r, g) - b) /
/// max(r, g, b), and so on: coloured dots look the same in light and in shade.
enum class DotColour { Dark, Light, Red, Green, Blue, Yellow, Magenta, Cyan };

/// By its name in small letters; nothing where there is none.
std::optional<DotColour> dot_colour(std::string_view name);

struct FindDotsOptions {
  DotColour colour = DotColour::Dark;
  double least_diameter = 6.0, greatest_diameter = 80.0;  ///< of the ellipse's longer axis [pixels]
  double least_contrast = 0.1;  ///< between a dot and what is around it, of the full scale, 0 < c < 1
  bool fills_notches = false;   ///< take a dot's convex hull: a shaft in front of a bead is part of it
  double least_aspect = 0.2;    ///< shorter over longer axis; a dot that is seen more obliquely is left out
};

/// A dot in a photograph: an ellipse, seen through the lens.
struct Dot {
  Vector2 centre = Vector2::Zero();     ///< of its area [pixels]
  double sigma = 0.0;                   ///< of a coordinate of the centre, from the image's noise [pixels]
  double diameter = 0.0, aspect = 1.0;  ///< longer axis [pixels]; shorter over longer axis
  double contrast = 0.0;                ///< of the full scale
};

/// Finds dots of one colour: what stands out from the mean about it, cut again half-way between its own level and that
/// of a plane through its surroundings; the centre is that of the share of each pixel that is covered. Left out are
/// what touches the border, is no ellipse, or has another size. Uneven light is divided out where dots are dark. The
/// order is by row, then column of the component; it does not depend on threads. Throws std::invalid_argument for an
/// image without pixels or options out of range.
std::vector<Dot> find_dots(const Image<Rgb>& photograph, const FindDotsOptions& options);

/// Reads a photograph: JPEG, PNG, TIFF or what else OpenCV reads, as 8-bit RGB in the orientation in which it is
/// stored. Throws InputError where it is not there or no image.
Image<Rgb> read_photograph(const std::filesystem::path& path);

}  // namespace pliant
