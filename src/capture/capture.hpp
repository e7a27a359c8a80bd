#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"
#include "geometry/camera.hpp"
#include "scene/scene.hpp"

namespace pliant {

/// Paths of one file a frame: a printf pattern like "front/%06d.png", relative to the capture's folder.
struct FramePattern {
  std::string pattern;
  /// The path for a frame, relative to the capture's folder.
  std::filesystem::path operator()(int frame) const;
  /// Whether the pattern holds exactly one %d (with or without a width), so that frames have different paths.
  bool is_valid() const;
  /// Whether it holds no percent sign: the name of one file, enough for a recording of one frame.
  bool is_plain() const { return pattern.find('%') == std::string::npos; }
  bool operator==(const FramePattern&) const = default;
};

/// How well the pose of a sensor against the object's scan is known: standard deviations about each axis and along it.
struct PoseStd {
  double turn = 0.01;    ///< [rad] about the object's middle; 0: exact
  double shift = 0.005;  ///< [m] of where it puts the object's middle; 0: exact
  bool operator==(const PoseStd&) const = default;
};

/// What every calibrated camera of a recording has, whatever its pixels hold.
struct RecordingCamera {
  std::string name;
  PinholeCamera camera;
  int every = 1;
  double time_offset = 0.0;                         ///< [s] its images are taken that much later than their frames
  std::optional<std::filesystem::path> poses = {};  ///< absolute; CSV of where a camera that moves was at each image
  std::vector<RigidMotion> moved = {};              ///< camera to world at each frame; empty: the camera stands
  PoseStd pose_std = {};  ///< of its pose; of a camera that moves of what all its poses err by together

  /// The camera as it stood when it took a frame's image; of one that moves `camera` is that of the first.
  PinholeCamera at(int frame) const {
    PinholeCamera result = camera;
    if (!moved.empty()) result.camera_to_world = moved[std::size_t(frame)];
    return result;
  }
  bool operator==(const RecordingCamera&) const = default;
};

struct DepthCamera : RecordingCamera {
  FramePattern images;
  double depth_scale = 1000.0;  ///< raw units per metre
  std::optional<FramePattern> masks;
  std::optional<std::filesystem::path> background;  ///< absolute
  std::optional<double> noise = {};                 ///< standard deviation of a reading [m]
  /// How well it is known what all its readings err by together: a constant range [m], shares of their range and of the
  /// focal length; 0: exact.
  std::optional<double> range_std = {};
  double range_scale_std = 0.0, focal_std = 0.0;
  bool operator==(const DepthCamera&) const = default;
};

/// A camera without depth, of which only where the object is in its pictures counts.
struct SilhouetteCamera : RecordingCamera {
  FramePattern masks;
  double outline_std = 0.7;        ///< [pixels] standard deviation of the masks' outlines, each point by itself
  double outline_error_std = 1.0;  ///< [pixels] of what all reach beyond the object together; 0: taken as exact
  bool operator==(const SilhouetteCamera&) const = default;
};

struct CloudSequence {
  FramePattern points;
  int every = 1;
  std::optional<double> noise;
  std::optional<std::filesystem::path> background = {};  ///< absolute; a cloud of the scene without the object
  std::optional<PoseStd> pose_std = {};                  ///< of all clouds together; nothing: taken as exact
  bool operator==(const CloudSequence&) const = default;
};

struct MarkerTrack {
  std::filesystem::path rest, track;  ///< absolute
  bool operator==(const MarkerTrack&) const = default;
};

/// Whether a measurement of this role enters a fit, not only its tests.
inline bool is_fitted(const std::string& role) { return role == "fit"; }

struct Press {
  Vector3 force = Vector3::Zero();           ///< [N], the whole force of the probe on the object
  Vector3 contact_centre = Vector3::Zero();  ///< on the undeformed surface
  double contact_radius = 0.0;               ///< [m]
  std::optional<Plane> probe;
  std::filesystem::path markers, markers_rest;       ///< absolute
  std::optional<std::filesystem::path> markers_std;  ///< absolute; standard deviations of `markers`
  std::string role = "fit";                          ///< "fit" or "test"
  bool glued = true;
  bool operator==(const Press&) const = default;
};

struct Load {
  double mass = 0.0;                                                  ///< [kg]
  Vector3 at = Vector3::Zero();                                       ///< on the undeformed surface
  std::optional<std::filesystem::path> cloud, markers, markers_rest;  ///< absolute
  std::map<std::string, std::filesystem::path> images, masks;         ///< absolute, by the depth camera's name
  std::string role = "fit";                                           ///< "fit" or "test"
  bool operator==(const Load&) const = default;
};

/// Rigid probe of a force-depth curve, which slides without friction.
enum class IndenterShape { Ball, Punch };

/// Force-depth curve: a probe that touches the object is pushed into it along a line, to one depth after the other.
struct Indentation {
  std::string name;                           ///< for reports; empty: none
  IndenterShape probe = IndenterShape::Ball;  ///< a sphere, or a flat-ended cylinder
  double radius = 0.0;                        ///< [m] of the sphere, or of the cylinder's end
  Vector3 contact = Vector3::Zero();          ///< [m] point of the undeformed surface that the probe touches first
  Vector3 direction = -Vector3::UnitY();      ///< unit vector along which the probe advances, into the object
  std::filesystem::path curve;                ///< absolute; CSV `depth,force,std`
  std::string role = "fit";                   ///< "fit" or "test"
  double contact_std = 0.0;                   ///< [m] of the depth at which it touches, 0 in the curve; 0: exact
  bool operator==(const Indentation&) const = default;
};

/// Homogeneous deformation of a cube of material. Stretches are along the axes; faces that are not prescribed carry no
/// stress.
enum class TestMode {
  Uniaxial,          ///< stretch along x; y and z free
  PureShear,         ///< stretch along x, y kept, z free: a wide strip between clamps
  Equibiaxial,       ///< the same stretch along x and y, z free
  Biaxial,           ///< stretch along x, a second one along y, z free
  SimpleShear,       ///< F_xy is the shear; before it the cube is stretched along x by a prestretch, y and z free, and
                     ///< they stay what they were then
  ConfinedUniaxial,  ///< stretch along x; y and z kept
};

/// Stress that a stress-strain curve holds [Pa].
enum class StressMeasure {
  First,             ///< nominal: P_xx, of a shear P_xy
  Second,            ///< nominal: P_yy
  CauchyDifference,  ///< sigma_xx - sigma_yy
};

/// Names of the test modes and stress measures in files, in the order of their enumerations.
const std::vector<std::string>& test_mode_names();
const std::vector<std::string>& stress_measure_names();

/// Stress-strain curve of a homogeneous specimen of the object's own material.
struct MaterialCurve {
  std::string name;  ///< for reports; empty: none
  TestMode mode = TestMode::Uniaxial;
  StressMeasure measure = StressMeasure::First;
  double prestretch = 1.0;      ///< along x, before a simple shear
  std::filesystem::path curve;  ///< absolute; CSV `stretch,stress,std`, biaxial `stretch,second,stress,std`
  std::string role = "fit";     ///< "fit" or "test"
  bool operator==(const MaterialCurve&) const = default;
};

/// Static measurement between grips: one part of the object is moved to another place and kept there.
struct Grip {
  std::string name;                           ///< for reports; empty: none
  Region region;                              ///< part that is moved, at rest
  Vector3 displacement = Vector3::Zero();     ///< [m] of that part from rest
  std::optional<double> force;                ///< [N] of the grip on the object along `force_direction`
  std::optional<double> force_std;            ///< [N] its standard deviation
  Vector3 force_direction = Vector3::Zero();  ///< unit vector; zero: along the displacement
  std::optional<std::filesystem::path> markers, markers_rest;  ///< absolute
  std::optional<double> markers_std;                           ///< [m] standard deviation of a coordinate
  std::optional<Vector3> unseen;  ///< unit vector along which the markers' motion was not measured
  std::string role = "fit";       ///< "fit" or "test"
  bool operator==(const Grip&) const = default;
};

/// Facts read from a `capture.toml`, valid as a whole (see docs/formats.md). SI units, world coordinates.
struct Capture {
  std::filesystem::path folder;  ///< absolute; patterns of the capture are relative to it
  std::filesystem::path file;    ///< the capture.toml itself
  std::string name;
  std::string sha256;  ///< of capture.toml and the files of surfaces, hexadecimal

  Scene scene;

  std::vector<DepthCamera> depth;
  std::vector<SilhouetteCamera> silhouettes;
  std::vector<CloudSequence> clouds;
  std::vector<MarkerTrack> markers;
  std::vector<Press> presses;
  std::vector<Load> loads;
  std::vector<Indentation> indentations;
  std::vector<Grip> grips;
  std::vector<MaterialCurve> material_curves;

  int frame_count() const { return scene.timing.frame_count(); }
};

/// Visits all cameras: `visit(const RecordingCamera&, const char* kind, std::size_t i)`, the i-th of the blocks that
/// `kind` names in a file.
template <class Visit>
void for_each_camera(const Capture& capture, const Visit& visit) {
  for (std::size_t i = 0; i < capture.depth.size(); ++i) visit(capture.depth[i], "depth", i);
  for (std::size_t i = 0; i < capture.silhouettes.size(); ++i) visit(capture.silhouettes[i], "silhouette", i);
}

/// Whether silhouettes are all that is seen of the object in its frames.
bool has_silhouettes_alone(const Capture& capture);

/// Whether a camera takes its images at other times than the frames', of an object in motion.
bool has_time_offsets(const Capture& capture);

/// Whether a camera moves while it records.
bool has_moving_cameras(const Capture& capture);

/// Throws InputError where a depth camera moves, for what needs stationary cameras.
/// @param what  that needs them, such as "pliant scan"
void require_standing_cameras(const Capture& capture, const std::string& what);

/// The same recording described from another folder: its patterns lead there from `folder`.
Capture as_seen_from(Capture capture, const std::filesystem::path& folder);

/// Reads and validates a capture: `path` is the folder or its capture.toml.
/// Throws InputError with every problem found, each with file, line and column, what was found, what was expected
/// and what to do. Image files are all opened and their headers checked; pixels are read by `observe`.
Capture read_capture(const std::filesystem::path& path);

/// Writes `capture.toml` into a folder, and the files beside it that hold what the value itself holds: `rest.ply` where
/// the surface has no file, `timestamps.txt` where frames have no common rate, lists of vertices, inner bodies. Files
/// that the value names by their paths are there already, and are named relative to the folder. `read_capture` gives
/// the same facts back; rotations and unit vectors to the last digit but one. `capture.toml` is written last: a folder
/// with it is whole.
/// @param comment  first line of the file, without its number sign; "" for none
/// Throws InputError where a file cannot be written.
void write_capture(const std::filesystem::path& folder, const Capture& capture, const std::string& comment = "");

}  // namespace pliant
