#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/error.hpp"
#include "base/types.hpp"
#include "geometry/camera.hpp"
#include "geometry/triangle_mesh.hpp"
#include "geometry/volume_mesh.hpp"

namespace pliant {

/// A region of space at rest: where a point of the object is held, or of another material.
struct RegionBox {
  Vector3 min, max;
};
struct RegionSphere {
  Vector3 centre;
  double radius;
};
struct RegionHalfSpace {
  Vector3 point, normal;
};  ///< the normal points into the region
struct RegionVertices {
  std::vector<int> indices;
};  ///< vertices of the object's surface
using Region = std::variant<RegionBox, RegionSphere, RegionHalfSpace, RegionVertices>;

struct FixedRegion {
  Region region;
  std::optional<RigidMotion> displaced_to;  ///< from rest to where it is held; nothing: held where it rests
};

struct MaterialRegion {
  std::string name;
  Region region;
};

struct Plane {
  Vector3 point = Vector3::Zero();
  Vector3 normal = Vector3::UnitY();  ///< unit length, to the side where the object may be
  bool known = true;
};

enum class ShapeIs { Reference, Static };

/// A small heavy thing that hangs at a point of the object, and moves along with it.
struct Weight {
  double mass = 0.0;             ///< [kg]
  Vector3 at = Vector3::Zero();  ///< on the undeformed surface
};

struct Initial {
  Vector3 linear_velocity = Vector3::Zero();   ///< [m/s], of the centre of mass
  Vector3 angular_velocity = Vector3::Zero();  ///< [rad/s], about the centre of mass
  bool known = true;
  bool released = false;
  /// Of a model or scene whose object is released: what pulls it until then, in the unit of `Pull`.
  std::vector<Vector3> pulls = {};
  /// Of an object that is released: the weight that hangs from it until then, and whose string is cut. Nothing: nobody
  /// knows what held it.
  std::optional<Weight> release_of = {};
};

/// Paths of one file a frame: a printf pattern like "front/%06d.png", relative to the capture's folder.
struct FramePattern {
  std::string pattern;
  /// The path for a frame, relative to the capture's folder.
  std::filesystem::path operator()(int frame) const;
  /// Whether the pattern holds exactly one %d (with or without a width), so that frames have different paths.
  bool is_valid() const;
  /// Whether it holds no percent sign: the name of one file, enough for a recording of one frame.
  bool is_plain() const { return pattern.find('%') == std::string::npos; }
};

struct DepthCamera {
  std::string name;
  PinholeCamera camera;
  FramePattern images;
  double depth_scale = 1000.0;  ///< raw units per metre
  std::optional<FramePattern> masks;
  std::optional<std::filesystem::path> background;  ///< absolute
  int every = 1;
  std::optional<double> noise;  ///< standard deviation of a reading [m]
};

struct CloudSequence {
  FramePattern points;
  int every = 1;
  std::optional<double> noise;
};

struct MarkerTrack {
  std::filesystem::path rest, track;  ///< absolute
};

struct Press {
  Vector3 force = Vector3::Zero();           ///< [N], the whole force of the probe on the object
  Vector3 contact_centre = Vector3::Zero();  ///< on the undeformed surface
  double contact_radius = 0.0;               ///< [m]
  std::optional<Plane> probe;
  std::filesystem::path markers, markers_rest;  ///< absolute
  std::string role = "fit";                     ///< "fit" or "test"
  bool glued = true;
};

struct Load {
  double mass = 0.0;                                                  ///< [kg]
  Vector3 at = Vector3::Zero();                                       ///< on the undeformed surface
  std::optional<std::filesystem::path> cloud, markers, markers_rest;  ///< absolute
  std::map<std::string, std::filesystem::path> images, masks;         ///< absolute, by the depth camera's name
  std::string role = "fit";                                           ///< "fit" or "test"
};

/// Facts read from a `capture.toml`, valid as a whole (see docs/formats.md). SI units, world coordinates.
struct Capture {
  std::filesystem::path folder;  ///< absolute; patterns of the capture are relative to it
  std::filesystem::path file;    ///< the capture.toml itself
  std::string name;
  std::string sha256;  ///< of capture.toml and the surface file, hexadecimal

  std::optional<TriangleMesh> surface;  ///< nothing: no rest scan, nothing can be fitted
  std::optional<VolumeMesh> volume;     ///< tetrahedra made elsewhere, whose boundary `surface` then is
  std::filesystem::path surface_file;   ///< or the volume's
  std::optional<double> mass;           ///< [kg]
  std::optional<double> density;        ///< [kg/m^3]
  ShapeIs shape_is = ShapeIs::Reference;

  std::optional<Vector3> gravity;  ///< [m/s^2]; nothing: to be estimated
  Vector3 up = Vector3::UnitY();   ///< opposite to gravity's direction where that is known, else as given

  std::vector<double> times;  ///< [s] of each frame; empty in a capture of presses and loads alone
  int start_frame = 0;
  bool is_static = false;

  std::vector<FixedRegion> fixed;
  std::vector<MaterialRegion> regions;
  std::vector<Plane> planes;
  std::vector<Weight> weights;  ///< that hang in every frame
  Initial initial;

  std::vector<DepthCamera> depth;
  std::vector<CloudSequence> clouds;
  std::vector<MarkerTrack> markers;
  std::vector<Press> presses;
  std::vector<Load> loads;

  int frame_count() const { return int(times.size()); }
  /// Mass [kg] of the object, from its density where that is given. Nothing: neither is known.
  std::optional<double> total_mass() const;
};

/// Reads and validates a capture: `path` is the folder or its capture.toml.
/// Throws InputError with every problem found, each with file, line and column, what was found, what was expected
/// and what to do. Image files are all opened and their headers checked; pixels are read by `observe`.
Capture read_capture(const std::filesystem::path& path);

}  // namespace pliant
