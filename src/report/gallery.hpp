#pragma once

#include <array>
#include <optional>
#include <vector>

#include "report/picture.hpp"
#include "report/report.hpp"

namespace pliant {

/// The simulation and what was observed at one frame.
struct GalleryFrame {
  int frame = 0;
  double time = 0.0;              ///< [s]
  Points surface;                 ///< simulated vertices [m], n x 3
  std::vector<Vector3> points;    ///< observed [m]; may be empty
  std::vector<double> residuals;  ///< signed distance of each to the surface [m]; not a number: an outlier
};

/// Frames of one motion, drawn from one place with one colour scale.
struct Gallery {
  std::vector<std::array<int, 3>> triangles;
  std::vector<Plane> planes;
  std::optional<PinholeCamera> camera;  ///< the recording's; nothing: a view from above and aside
  Vector3 up = Vector3::UnitY();        ///< for that view
  std::vector<GalleryFrame> frames;
  int width = 760, height = 475;  ///< of a picture [pixels]
  int samples = 3;                ///< see PictureOptions
};

/// `count` frames spread evenly over first..last, both ends included; all of them where there are fewer.
std::vector<int> spread_frames(int first, int last, int count);

/// Pictures of all frames with captions (time, rms of the residuals, grid of the floor), framed so that the whole
/// motion fits.
/// @param range  [m] where the colours end; 0: residual_range of all frames together. Put the same value into
///               ReportData::residual_range
std::vector<ReportPicture> draw_gallery(const Gallery& gallery, double range = 0.0);

/// A field in one state of the object.
struct FieldState {
  Points surface;              ///< vertices [m], n x 3
  std::vector<double> values;  ///< at each of them, in the field's unit; not a number: grey
  std::string caption;         ///< plain text
};

/// Pictures of a field's states from one place, that of the gallery, which shows all of them; its frames are not drawn.
/// @param unit  of the values, plain: "Pa"
/// Throws std::invalid_argument where a state has not a value for each vertex.
ReportField draw_field(const Gallery& gallery, const std::vector<FieldState>& states, const std::string& name,
                       const std::string& unit, ScaleEnds ends);

/// All residuals of a gallery, for residual_range.
std::vector<double> all_residuals(const Gallery& gallery);

}  // namespace pliant
