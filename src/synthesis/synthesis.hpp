#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "capture/capture.hpp"
#include "capture/curves.hpp"
#include "synthesis/sensor.hpp"

namespace pliant {

/// What the recording says of a camera in the place of the truth, as of one that was badly calibrated.
struct StatedCamera {
  std::optional<RigidMotion> camera_to_world;
  std::optional<LensDistortion> lens;
  std::optional<double> time_offset;  ///< [s]
};

/// A depth camera of a synthetic recording, or one of which only the silhouettes are recorded.
struct SyntheticCamera {
  std::string name;
  PinholeCamera camera;
  SensorModel sensor;
  double depth_scale = 1000.0;  ///< raw units per metre
  int every = 1;
  double time_offset = 0.0;  ///< [s] its images are taken that much later than their frames
  StatedCamera stated = {};
  bool is_silhouette =
      false;  ///< masks alone, which are in the recording beside clouds, too; clouds are not made of it
};

/// Fused point clouds of all cameras: the object's points in world coordinates.
struct SyntheticCloud {
  int every = 1;
  bool with_background = false;  ///< also what cameras see of the planes
  bool with_images = false;      ///< the cameras' depth images are part of the recording too
};

/// Markers on the object's surface, and how well they are seen.
struct SyntheticMarkers {
  std::vector<Vector3> points;  ///< [m], m, on the surface where the object is stress-free
  double noise = 0.0;           ///< [m] standard deviation of a coordinate, at rest and later
  double relative_noise = 0.0;  ///< of a coordinate, times how far the marker has moved from rest
  double lost = 0.0;            ///< probability that a marker is not seen in a frame, or under a load, 0..1
};

/// Where the object is at one time.
struct TrueShape {
  Points vertices;  ///< of its surface, n x 3 [m]
  Points markers;   ///< m x 3 [m]; no rows where there are none
};

/// The object at rest under a weight.
struct TrueLoad {
  Weight weight;  ///< where it hangs on the scanned surface
  std::string role = "fit";
  TrueShape shape;
};

/// The object at rest under a probe.
struct TruePress {
  Press facts;                      ///< force, contact on the scanned surface, glued, role; neither probe nor files
  Vector3 axis = Vector3::Zero();   ///< of the probe, unit, into the object
  Vector3 shift = Vector3::Zero();  ///< [m] of the probe from where it first touched
  double force_noise = 0.0;         ///< [N] standard deviation of each component of the force as it is written
  TrueShape shape;
};

/// A force-depth curve as it truly is.
struct TrueIndentation {
  Indentation facts;  ///< without file
  ForceCurve curve;   ///< true forces, and the standard deviation with which each is written
};

/// A true parameter, for judging estimates.
struct TrueParameter {
  std::string name;  ///< as in result.json
  std::variant<double, Vector3> value;
  std::string unit;
};

/// A recording that is known completely.
struct Synthesis {
  std::string name;
  Scene scene;                           ///< the object's surface at rest, exactly one of its mass and density; timing
  std::vector<double> plane_half_sizes;  ///< [m] of each plane: half the edge of the square that cameras see around the
                                         ///< object; 0: invisible
  Points scan;  ///< vertices of rest.ply, n x 3 [m]: of an object that sags; empty: those of the surface, stress-free
  std::vector<TrueShape> frames;  ///< the object in each frame; none: static tests alone
  /// Of each camera, the object when it takes the image of each frame; empty, also of one camera: as in `frames`.
  std::vector<std::vector<TrueShape>> camera_frames = {};
  std::vector<SyntheticCamera> cameras;
  std::optional<SyntheticCloud> cloud;
  std::optional<SyntheticMarkers> markers;
  Points scan_markers;  ///< where they are in the scan, m x 3 [m]
  std::vector<TrueLoad> loads;
  std::vector<TruePress> presses;
  std::vector<TrueIndentation> indentations;
  std::vector<TrueParameter> truth;
  std::uint64_t seed = 1;
  double scan_noise = 0.0;        ///< [m] deviation of the vertices of rest.ply along their normals
  bool write_trajectory = false;  ///< the true surface of each frame as truth/000000.ply ...
};

/// Writes a capture as docs/formats.md describes it: capture.toml, rest.ply, depth images and masks, clouds, markers,
/// and truth.json (never read by a fit) in the format "synth-truth/1". Frames are made in parallel; the files do not
/// depend on the number of threads.
/// @param progress  called with images done and their total, from one thread at a time; may be empty
/// Throws std::invalid_argument where the parts do not fit together, InputError where a file cannot be written.
void write_synthetic_capture(const std::filesystem::path& folder, const Synthesis& synthesis,
                             const std::function<void(int, int)>& progress = {});

}  // namespace pliant
