#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "capture/capture.hpp"
#include "capture/observe.hpp"
#include "estimation/objective.hpp"
#include "simulation/scene_simulation.hpp"

namespace pliant {

/// A recording made ready for simulation at one resolution.
struct Discretisation {
  std::shared_ptr<const SignedDistance> distance;
  std::shared_ptr<const Body> body;
  Mismatch mismatch;
  std::vector<Vector3> control_points;  ///< of the field of moduli; empty: homogeneous, or regions
  SimulationOptions simulation;
  std::optional<TriangleMesh> surface =
      {};  ///< of the object, where that is off its scan; none: the scan is the surface
};

/// The object's surface in a model of a capture.
const TriangleMesh& surface_of(const Capture& capture, const Discretisation& discretisation);

/// Signed distance of the capture's surface, fine enough for every resolution.
/// Throws InputError where the capture has no surface.
std::shared_ptr<const SignedDistance> capture_distance(const Capture& capture, double band);

/// What a capture's observations are compared with, around a body.
/// @param tracked  points of the object that are followed [m], at rest
Mismatch make_mismatch(const Capture& capture, const std::shared_ptr<const SignedDistance>& distance,
                       const std::shared_ptr<const Body>& body, const Resolution& resolution,
                       const std::vector<Vector3>& tracked = {});

/// Where the parameters of a capture stand in a vector.
struct CaptureBlocks {
  MotionBlocks motion;
  std::vector<SensorBlocks> sensors;
  std::optional<LawLayout> law = {};  ///< of the object; none: corotated linear elasticity
};

/// Body, scene and mismatch of a capture.
/// @param theta  its density and gravity are what contact is scaled by
Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          const Resolution& resolution, const CaptureBlocks& blocks, const VectorX& theta,
                          const SimulationOptions& settings = {}, const std::vector<Vector3>& tracked = {});

/// The same around a body that is there already.
Discretisation discretise(const Capture& capture, std::shared_ptr<const SignedDistance> distance,
                          std::shared_ptr<const Body> body, const Resolution& resolution, const CaptureBlocks& blocks,
                          const VectorX& theta, const SimulationOptions& settings = {},
                          const std::vector<Vector3>& tracked = {});

/// The parameters of a capture, and where they stand in a vector.
struct CaptureParameters {
  ParameterSet set;
  CaptureBlocks blocks;
};

/// All parameters of a capture with their start values, bounds and priors. What the capture leaves unknown is
/// estimated: always stiffness and both dampings, Poisson's ratio under a prior, and gravity, velocities or planes that
/// it does not give; density only where it is unknown and the object is released from under a known weight.
/// Of the corrections of sensors ("range_error@camera", "sensor_turn@camera", "sensor_shift@camera", and where they are
/// not exact "range_scale@camera", "focal_error@camera") those of poses are estimated where the capture does not take
/// the pose as exact (`PoseStd`), and those of readings where it states a deviation, under a prior as wide as that
/// says.
/// @param volume    of the object [m^3], for the density that belongs to a mass
/// @param controls  control moduli of the body: `modulus_names` tells what they are called
/// @param pulls     that hold a released object: "pull@1", ... (see `Pull`)
/// @param shapes    of the scan's correction: "scan_correction@1", ... (see `ShapeField`)
/// @param law       of the object, whose own numbers ("exponent_1", ...) come last and are estimated under wide priors;
///                  none: corotated linear elasticity
CaptureParameters default_parameters(const Capture& capture, double volume, int controls = 1, int pulls = 0,
                                     int shapes = 0, const std::optional<LawForm>& law = std::nullopt);

/// What corrections of sensors apply to: each depth camera by its name, "clouds", each silhouette camera by its name
/// and "markers".
std::vector<std::string> sensor_names(const Capture& capture);
/// Number of a silhouette camera among them.
int silhouette_sensor(const Capture& capture, int camera);

/// "youngs_modulus" alone; with regions followed by "youngs_modulus@name" of each; with control points
/// "youngs_modulus@1", "youngs_modulus@2", ...
std::vector<std::string> modulus_names(const Capture& capture, int controls);

/// Points of the object that the capture's [[markers]] follow.
struct TrackedPoints {
  std::vector<Vector3> rest;                            ///< [m], all blocks' markers one after the other
  std::map<int, std::vector<TrackObservation>> frames;  ///< by the recording's frame
};

/// Reads them, each block as noisy as its track shows (`track_noise`); where too few frames tell, a thousandth of the
/// object's size stands in.
TrackedPoints tracked_points(const Capture& capture);

/// An outline as a fit compares it.
OutlineObservation outline_observation(const Capture& capture, const ObservedOutline& seen, int frame);

/// How its sensor sees the i-th point of a frame; nothing is known of clouds.
Sight sight_of(const Capture& capture, const ObservedFrame& seen, std::size_t i);

/// Observations of the frames from the start on, numbered from it. Frames before a release show the pose from which the
/// object is released, and count as looks at its first frame.
/// @param first_at_rest  from that frame on, to the start, the object stands still as it was scanned: all are looks at
///                       the first frame; negative: it does not
std::vector<FrameObservations> frame_observations(const Capture& capture, const std::vector<ObservedFrame>& observed,
                                                  const TrackedPoints& tracked = {}, int first_at_rest = -1);

}  // namespace pliant
