#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "elasticity/body.hpp"
#include "elasticity/modulus_field.hpp"
#include "geometry/signed_distance.hpp"
#include "motion/simulation.hpp"
#include "scene/scene.hpp"

// From the facts of a scene to a body and its simulation.

namespace pliant {

/// How Young's modulus varies over the object where the scene names neither regions nor control points.
struct FieldOptions {
  enum class Weights { Linear, Harmonic, InverseDistance };
  int control_points = 1;  ///< >= 1; 1: homogeneous
  /// Linear ones stand along the object's longest axis, the others spread over it. Of points that the scene places,
  /// linear ones are harmonic.
  Weights weights = Weights::Linear;
};

/// How finely the body and its motion are resolved, and by what elements.
struct Resolution {
  ElementKind element = ElementKind::Hexahedron;
  FieldOptions field;
  double cells = 12.0;             ///< elements along the object's longest axis
  bool follows_thickness = false;  ///< hexahedra of thin objects are smaller: `hex_cell_size`
  double steps = 1.0;              ///< time steps per default step: 2 halves the step
  int pulls = 4;                   ///< that hold a released object until it is let go
  int shape_points = 0;            ///< about which the scan may err; 0: it is exact. Tetrahedra only
  double shape_std = 0.01;         ///< by how much, times the object's longest axis
  double band = 0.15;              ///< of the mismatch, times the object's longest axis
  double relative_density =
      1.0;  ///< of the body to the parameter: where an object of known mass is larger than its scan
  /// By which the object's surface lies outside its scan, at a place of the scan [m]; none: it is the scan.
  std::function<double(const Vector3&)> offset = {};
  /// By which the logarithm of the stiffness differs at a place of the scan, but for its mean; none: it is even.
  std::function<double(const Vector3&)> unevenness = {};
};

/// Moduli of the scene's regions or control points, or as many as are asked for where it names none.
int control_count(const Scene& scene, int asked_for);

/// The field of a body: of the scene's regions or control points, or as the options say where it names none.
ControlledField modulus_field(const Body& body, const Scene& scene, const FieldOptions& options);

/// The object's surface: its scan, or beside that by the resolution's offset along its normals, but where it is held.
TriangleMesh surface_of(const Scene& scene, const Resolution& resolution);
/// Signed distance of that surface, where it lies beside the scan, by the scan's (`SignedDistance::offset_by`).
/// @param resolution  with an offset
SignedDistance offset_distance(const Scene& scene, const SignedDistance& scan, const Resolution& resolution);

/// Longest edge of the surface's box [m].
double object_size(const Scene& scene);

/// Signed distance of the scene's surface, fine enough for every resolution.
/// @param band  how far outside it is known, times the object's longest axis
std::shared_ptr<const SignedDistance> scene_distance(const Scene& scene, double band);

/// Whether a point [m] at rest lies in each of the scene's regions of other materials.
std::vector<std::function<bool(const Vector3&)>> region_tests(const Scene& scene);

/// How thick the object is [m]: what three quarters of its surface exceed, by the distance through it along the normal.
double thickness(const Scene& scene, const SignedDistance& distance);

/// Edge of hexahedra [m]: so many along the object's longest axis or, where it is thinner than a fifth of that, along
/// five times its thickness: what is thin bends, and its stiffness is wrong where an element reaches through it. No
/// more than about `most` elements at 12 cells are spent on that.
double hex_cell_size(const Scene& scene, const SignedDistance& distance, double cells, int most = 200);

/// Hexahedra over the scene's object. The lattice lies so that the faces of held boxes, and held half-spaces with an
/// axis as their normal, end between two layers of cells: held is then what the region contains, and no part of a cell
/// more. One such face an axis can be met, the first in the scene's order.
/// @param cell_size  [m]
HexGrid hex_grid_of(const Scene& scene, const SignedDistance& distance, double cell_size);

/// The object's elements at one resolution; `control_points` are those of its field of moduli, if any. One whose
/// surface is not its scan has the same mass where the scene tells that.
/// Throws InputError where so thin an object cannot be so far from its scan.
/// @param distance  of the scene's surface; only hexahedra ask for it
std::shared_ptr<const Body> make_body_of(const Scene& scene, const SignedDistance& distance,
                                         const Resolution& resolution, std::vector<Vector3>& control_points);

/// Held regions of a scene.
std::vector<Hold> held_regions(const Scene& scene);
/// The same of regions of a surface.
std::vector<Hold> held_regions(const std::vector<FixedRegion>& fixed, const TriangleMesh& surface);

/// Number of pulls of a scene's motion: none where it is not released, or from under a known weight.
int pull_count(const Scene& scene, const Resolution& resolution);

/// Puts a scene's planes and obstacles into a parameter vector: places of planes, and coefficients of friction.
void set_obstacles(const Scene& scene, const MotionBlocks& blocks, VectorX& theta);

/// Blocks of a motion's parameters that a scene's planes, obstacles, wind and forces need.
MotionCounts load_counts(const Scene& scene);
/// Puts a scene's wind into a parameter vector, and strengths of one for its forces.
void set_loads(const Scene& scene, const MotionBlocks& blocks, VectorX& theta);
/// The scene's wind and forces as force terms, after those that the options have.
/// @param simulation  whose blocks are those of the scene (`load_counts`)
void add_loads(const Scene& scene, SimulationOptions& simulation);

/// How a body moves in a scene: its instants and time step, what it touches, what holds and loads it.
/// @param blocks    of the motion's parameters, with the scene's planes, obstacles, wind and forces
/// @param theta     by those blocks; its density and gravity scale contact
/// @param settings  what the scene does not say
/// Throws InputError as `add_obstacles` does.
SimulationOptions make_simulation(const Scene& scene, const Body& body, const Resolution& resolution,
                                  const MotionBlocks& blocks, const VectorX& theta,
                                  const SimulationOptions& settings = {});

}  // namespace pliant
