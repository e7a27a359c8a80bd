#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "base/types.hpp"
#include "geometry/triangle_mesh.hpp"
#include "report/image.hpp"
#include "scene/scene.hpp"

namespace pliant {

/// What is to be seen at one instant.
struct PictureScene {
  Points surface;  ///< vertices of the object [m], n x 3
  std::vector<std::array<int, 3>> triangles;
  std::vector<Plane> planes;      ///< obstacles, drawn as light floors with grid lines and soft shadows
  std::vector<Vector3> points;    ///< observed points [m], drawn as small discs over the surface; may be empty
  std::vector<double> residuals;  ///< signed distance of each point to the surface [m]; empty: one colour for all
  std::vector<Rgb> colours = {};  ///< of the surface's vertices; empty: grey
  /// What floor, grid and shadows are scaled by, the same for all frames of a motion; left out: the surface's own box.
  std::optional<Box> about = {};
};

struct PictureOptions {
  int samples = 3;     ///< rays a pixel along each side, 1..8
  int light_rays = 2;  ///< rays towards the sky for each of them, 1..64: how soft and how clean the shadows are
  double residual_range = 0.0;  ///< [m], residual that gets the full colour; 0: the scene's own (see residual_range)
  double disc_radius = 0.0;     ///< [pixels]; 0: by the number of points
  double even_light = 0.0;      ///< 0..1, the part of the object's light that is the same all over, so that colours can
                                ///< be read off a scale
  int max_points = 900;         ///< about so many of the points are drawn where there are more, always the same ones
};

/// Draws a scene as a camera sees it; no display is needed. The picture has the camera's size. Deterministic, and the
/// same for every number of threads.
/// Throws std::invalid_argument where residuals do not match the points, or colours the vertices, or an option is out
/// of its range.
Picture draw(const PictureScene& scene, const PinholeCamera& camera, const PictureOptions& options = {});

/// Residual [m] at which the colours end: the 95th percentile of the absolute residuals, rounded up to 1, 2 or 5 times
/// a power of ten; 1 mm where there are none. Use one range for all frames of a report.
double residual_range(const std::vector<double>& residuals);

/// Distance of the floor's grid lines [m] for an object of this extent: 1, 2 or 5 times a power of ten.
double grid_spacing(const Box& object);

/// The camera's place and direction, with focal length and centre changed so that the box fills a picture of
/// width x height pixels with a margin. The camera itself, scaled to the width, where the box is not all in front.
PinholeCamera framed(const PinholeCamera& camera, const Box& box, int width, int height);

/// The same for points.
PinholeCamera framed(const PinholeCamera& camera, std::span<const Vector3> points, int width, int height);

/// A view from above and aside that shows the whole box. `azimuth` [rad] around `up`, `elevation` [rad] above the
/// horizontal.
PinholeCamera view_of(const Box& box, const Vector3& up, int width, int height, double azimuth = 0.6,
                      double elevation = 0.45);

}  // namespace pliant
