#pragma once

#include <functional>

#include "photos/session.hpp"

namespace pliant {

/// Markers of one set of photographs, in the order of their ids.
struct MeasuredMarkers {
  Points positions;   ///< m x 3 [m]; NaN rows where a marker was not seen
  Points deviations;  ///< m x 3 [m], standard deviation of each coordinate; NaN likewise
};

/// How the photographs of one moment went.
struct PhotoFigures {
  std::vector<int> dots;       ///< by camera, dots of the markers' colour
  int seen = 0;                ///< markers found
  int ambiguous = 0;           ///< dots (at rest) or markers (under load) that were left out as it was not clear which
  double rms = 0.0;            ///< distance of the dots from their points [pixels]
  double noise_factor = 1.0;   ///< on the dots' own sigmas
  double deviation = 0.0;      ///< median of the positions' standard deviations [m]
  double greatest_bias = 0.0;  ///< correction for middles of ellipses that are no middles of dots [pixels]
  double seconds = 0.0;
};

struct MeasuredPress {
  PhotographedPress press;
  std::string failure;  ///< why it cannot be used, in words; "" where it can
  MeasuredForce force;
  ProbePose probe;
  Vector3 contact = Vector3::Zero();  ///< [m] on the rest surface
  MeasuredMarkers markers;
  PhotoFigures figures;
};

/// What a session's photographs say.
struct MarkerMeasurement {
  std::vector<std::string> ids;  ///< "000", "001", ...
  MeasuredMarkers rest;
  PhotoFigures rest_figures;
  std::vector<MeasuredPress> presses;  ///< in the session's order
};

/// A photograph of one camera, by its number.
using PhotographSource = std::function<Image<Rgb>(int camera, int number)>;
/// Told after each set of photographs.
using PhotoProgress = std::function<void(int done, int total)>;

/// Measures markers at rest, then follows them through the presses in the order of their force: each is predicted
/// by the shape at rest, by the press whose probe was nearest, and by how far the probe went in; what these find must
/// agree. Throws InputError where a photograph has another size than its camera, or fewer than four markers are seen at
/// rest.
MarkerMeasurement measure_markers(const PhotoSession& session, const PhotographSource& photographs,
                                  const PhotoProgress& progress = {});

/// The photographs in the session's files, read when they are asked for. The session must stay as long as the source.
PhotographSource photographs_of(const PhotoSession& session);

/// Writes a capture (docs/formats.md) of the presses that can be used: capture.toml, the surface, markers_rest.csv,
/// press/NNN.csv, beside each a file of deviations `id,sx,sy,sz` (markers_rest_std.csv, press/NNN_std.csv), and
/// markers.json with the figures. capture.toml is written last.
/// Throws InputError where a file cannot be written, and where no press can be used.
void write_marker_capture(const std::filesystem::path& folder, const PhotoSession& session,
                          const MarkerMeasurement& measurement);

/// How far the middle of a round dot's picture lies from the picture of its middle [pixels]: perspective and lens show
/// a circle as nearly an ellipse whose middle is another point.
/// @param radius  [m] of the dot, @param normal  of the surface that it is painted on
Vector2 centre_bias(const LensCamera& camera, const Vector3& centre, const Vector3& normal, double radius);

}  // namespace pliant
