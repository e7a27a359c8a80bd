#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/types.hpp"
#include "geometry/camera.hpp"
#include "geometry/key_frames.hpp"
#include "geometry/triangle_mesh.hpp"
#include "geometry/volume_mesh.hpp"

// The facts of a situation: an object, its world, what holds, loads and surrounds it, how it begins to move, and when.
// Recordings, models, synthetic scenes and sessions of photographs hold one each. SI units, world coordinates.

namespace pliant {

/// Axis-aligned box [m] with its border.
struct RegionBox {
  Vector3 min, max;
  bool operator==(const RegionBox&) const = default;
};
/// Ball [m] with its border.
struct RegionSphere {
  Vector3 centre;
  double radius;
  bool operator==(const RegionSphere&) const = default;
};
/// Half of space with its border [m]; the unit normal points into the region.
struct RegionHalfSpace {
  Vector3 point, normal;
  bool operator==(const RegionHalfSpace&) const = default;
};
/// Vertices of the object's surface, by their indices from 0.
struct RegionVertices {
  std::vector<int> indices;
  bool operator==(const RegionVertices&) const = default;
};
/// Region of the object at rest: where it is held, or of another material.
using Region = std::variant<RegionBox, RegionSphere, RegionHalfSpace, RegionVertices>;

/// Region in which the object is held.
struct FixedRegion {
  Region region;
  std::optional<RigidMotion>
      displaced_to;  ///< rigid motion from rest to where it is held; nothing: held where it rests
  bool operator==(const FixedRegion&) const = default;
};

/// Region of another material than the object's own.
struct MaterialRegion {
  std::string name;
  Region region;
  bool operator==(const MaterialRegion&) const = default;
};

/// A control point of Young's modulus as the user places it: the field blends the moduli of all of them.
struct MaterialControl {
  std::string name;
  Vector3 point = Vector3::Zero();   ///< at rest [m]
  std::vector<double> weights = {};  ///< of the modulus at each vertex of the surface, >= 0; empty: those of `point`
  bool operator==(const MaterialControl&) const = default;
};

/// Plane obstacle.
struct Plane {
  Vector3 point = Vector3::Zero();    ///< [m]
  Vector3 normal = Vector3::UnitY();  ///< unit length, to the side where the object may be
  bool known = true;                  ///< false: a rough guess, to be estimated
  double friction = 0.0;              ///< Coulomb's coefficient [-], >= 0
  bool knows_friction = true;         ///< false: nobody said how large it is; to be estimated where something moves
  bool operator==(const Plane&) const = default;
};

/// Rigid shapes that the object meets, where they are for a zero motion [m].
struct ShapeBall {
  Vector3 centre;
  double radius;
  bool operator==(const ShapeBall&) const = default;
};
/// A rod with round ends.
struct ShapeCapsule {
  Vector3 from, to;
  double radius;
  bool operator==(const ShapeCapsule&) const = default;
};
struct ShapeBox {
  Vector3 min, max;
  bool operator==(const ShapeBox&) const = default;
};
/// All that lies behind a plane. @param normal  unit length, to the side where the object may be
struct ShapePlane {
  Vector3 point, normal;
  bool operator==(const ShapePlane&) const = default;
};
struct ShapeMesh {
  std::filesystem::path file;  ///< absolute
  TriangleMesh mesh;           ///< closed
  bool operator==(const ShapeMesh& other) const { return file == other.file; }
};

/// Rigid body of any shape that the object meets, standing still or moving as it is led.
struct RigidObstacle {
  std::variant<ShapeBall, ShapeCapsule, ShapeBox, ShapePlane, ShapeMesh> shape;
  double friction = 0.0;                       ///< Coulomb's coefficient [-], >= 0
  bool knows_friction = true;                  ///< false: nobody said how large it is; to be estimated
  std::vector<KeyFrames<6>::Key> motion = {};  ///< shift [m] and rotation vector [rad] about its middle, over the
                                               ///< frames' time; empty: it stands still
};

/// Region of the object that a clamp, a gripper or a shaker leads.
struct LedRegion {
  Region region;
  double from = -infinite, until = infinite;   ///< [s] when it takes hold and lets go; without them: in every frame
  std::vector<KeyFrames<6>::Key> motion = {};  ///< shift [m] and rotation vector [rad] about the region's middle, over
                                               ///< the frames' time
};

/// Rigid body inside or under the object that stays where it is: a skull under the skin, a core, a table.
struct InnerBody {
  enum class Contact {
    Sliding,  ///< the object slides on it and may lift off, without friction
    Glued,    ///< the object's surface sticks where it touches it
  };
  TriangleMesh surface;        ///< closed, at rest [m]
  std::filesystem::path file;  ///< of the surface, absolute; empty: of none
  Contact contact = Contact::Sliding;
  /// The object's `surface` is its scan less this body: the body's surface stands reversed at its end.
  bool is_cut_out = false;
};

/// Attached point mass: hangs at a point of the object, and moves along with it.
struct Weight {
  double mass = 0.0;             ///< [kg]
  Vector3 at = Vector3::Zero();  ///< [m], on the undeformed surface
  bool operator==(const Weight&) const = default;
};

/// A wind with its turbulence. Times are those of the frames.
struct WindFacts {
  Vector3 velocity = Vector3::Zero();              ///< mean [m/s]
  std::vector<KeyFrames<3>::Key> over_time;        ///< in the place of the mean; empty: it stays
  bool known = true;                               ///< false: the velocity is a guess, to be estimated
  double gust_intensity = 0.0, gust_length = 5.0;  ///< [-], [m]
  std::uint64_t seed = 1;
  double delay = 0.0;                                         ///< [s] by which its time runs ahead
  double air_density = 1.2, normal = 1.2, tangential = 0.02;  ///< see `WindOptions`
};

/// A force on a patch of the object.
struct AppliedForce {
  Vector3 at = Vector3::Zero();          ///< on the surface at rest [m]
  double radius = 0.0;                   ///< of the patch [m]
  std::vector<KeyFrames<3>::Key> force;  ///< [N] over the frames' time
  bool known = true;                     ///< false: how strong it is is a guess, to be estimated
};

/// Motion of the object at the start frame.
struct Initial {
  Vector3 linear_velocity = Vector3::Zero();   ///< [m/s], of the centre of mass
  Vector3 angular_velocity = Vector3::Zero();  ///< [rad/s], about the centre of mass
  bool known = true;                           ///< false: the velocities are guesses, to be estimated
  bool released = false;                       ///< from a held, deformed pose
  /// Forces on an object of a model that is released, until then, in the unit of `Pull`.
  std::vector<Vector3> pulls = {};
  /// Where those act [m], in the scan, as many; empty: far from what is held and from each other.
  std::vector<Vector3> pulled_at = {};
  /// Weight that hangs from a released object until its string is cut. Nothing: nobody knows what held the object.
  std::optional<Weight> release_of = {};
  bool operator==(const Initial&) const = default;
};

/// State in which the object's shape was scanned: stress-free, or sagging under gravity.
enum class ShapeIs { Reference, Static };

/// The object itself.
struct Object {
  /// Boundary of the solid [m], of bodies inside it too; nothing: no rest scan, nothing can be fitted.
  std::optional<TriangleMesh> surface;
  std::optional<VolumeMesh> volume;             ///< tetrahedra made elsewhere, whose boundary `surface` then is
  std::filesystem::path file;                   ///< file of the surface or the volume, absolute; empty: of neither
  std::optional<double> mass;                   ///< [kg]
  std::optional<double> density;                ///< [kg/m^3]
  std::optional<double> mass_std, density_std;  ///< how well the given one is known, in its unit; 0: exact
  std::optional<double> scale_std;              ///< how well all lengths together are known, a share of them; 0: exact
  ShapeIs shape_is = ShapeIs::Reference;
  std::optional<double> surface_noise;  ///< standard deviation of the surface along its normals [m]; 0: it is exact
  /// By how much the stiffness of its material varies from place to place, a share (a standard deviation); 0: it is
  /// even.
  std::optional<double> stiffness_std;
  bool pose_is_known = true;   ///< false: the surface stands anywhere, and is to be placed in the start frame
  bool scale_is_known = true;  ///< false: the surface is in any unit; its pose is unknown then too

  /// Mass [kg], from the density where that is given. Nothing: neither is known.
  std::optional<double> total_mass() const;
  /// Standard deviation of its mass, or density, over it. Nothing: nobody stated one.
  std::optional<double> relative_mass_std() const;
};

/// Gravity, and which way is up.
struct World {
  std::optional<Vector3> gravity;  ///< [m/s^2]; nothing: to be estimated
  Vector3 up = Vector3::UnitY();   ///< unit length, opposite to gravity's direction where that is known, else as given
  std::optional<double> gravity_std;  ///< how well its direction is known, about each level axis [rad]; 0: exact
  bool operator==(const World&) const = default;
};

/// Instants at which sensors recorded.
struct Timing {
  double frame_rate = 0.0;    ///< [Hz] of equally spaced frames; 0: `times` say all
  std::vector<double> times;  ///< [s] of each frame; empty: presses and loads alone, or a static model
  int start_frame = 0;        ///< first frame in which the object moves freely
  bool is_static = false;     ///< frames are looks at one equilibrium
  int frame_count() const { return int(times.size()); }
  bool operator==(const Timing&) const = default;
};

/// Frames k / frame_rate [s] for k = 0 .. frame_count - 1.
Timing evenly_timed(double frame_rate, int frame_count, int start_frame = 0);

/// A situation as a whole.
struct Scene {
  Object object;
  World world;
  Timing timing;
  std::vector<FixedRegion> fixed;
  std::vector<LedRegion> led;
  std::vector<MaterialRegion> regions;
  std::vector<MaterialControl> controls;  ///< all with points or all with weights; none where there are regions
  std::vector<Plane> planes;
  std::vector<RigidObstacle> obstacles;
  std::vector<InnerBody> inner;
  std::vector<Weight> weights;  ///< that hang in every frame
  std::optional<WindFacts> wind;
  std::vector<AppliedForce> forces;
  Initial initial;

  /// Whether something holds the object in every frame: a fixed or a led region, or a rigid body that it is glued to.
  bool is_held() const;
  /// Whether it may touch something: a plane, an obstacle, or a rigid body on which it slides.
  bool is_touched() const;
};

/// Parameters of the Young's moduli that a scene tells apart: `youngs_modulus`, the object's own, and
/// `youngs_modulus@NAME` of each region; or the latter of each control point. Empty: it tells none apart.
std::vector<std::string> named_moduli(const Scene& scene);

}  // namespace pliant
