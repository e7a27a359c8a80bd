#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "capture/capture.hpp"
#include "capture/observe.hpp"
#include "geometry/camera.hpp"
#include "geometry/signed_distance.hpp"

namespace pliant {

struct ScanPoseOptions {
  bool finds_scale = false;  ///< of the scan's unit, too: millimetres, inches, none
  int rotations = 1500;      ///< from which the search starts, spread evenly over all of them
};

/// Where a scan of an object at rest stands in a frame: world = motion(scale * scan).
struct ScanPose {
  RigidMotion motion;  ///< from the scan (in its unit times `scale` [m]) to the world
  double scale = 1.0;  ///< [m] a unit of the scan
  int points = 0;      ///< that were compared
  double rms = 0.0;    ///< of their distances to the surface [m], without the tenth that is farthest off
  double overlap =
      0.0;  ///< of what depth cameras saw and what they would have seen of the scan, as areas; 1 without them
  /// Cost of the best pose that is turned by more than 25 degrees against this one, over its own: near one where the
  /// object is symmetric, or too little of it is seen.
  double runner_up = 0.0;
};

/// The rigid pose of a scan, from any start: rotations spread over all of them, each followed to the nearest pose of
/// least squares to the points (Gauss and Newton on the signed distance, robust), the best of them judged by what each
/// depth camera would have seen: points beside the surface, surface where the sensor saw past it, and points where
/// there is none. Deterministic.
/// @param scan     closed; in any unit where the scale is found, else metres
/// @param seen     the object's points in one frame, as `observe` reads them
/// Throws InputError where the frame shows fewer than 50 points, std::invalid_argument for a scan without triangles.
ScanPose find_scan_pose(const TriangleMesh& scan, const Capture& capture, const ObservedFrame& seen,
                        const ScanPoseOptions& options = {});

/// Follows a rigid scan from frame to frame.
class ScanFollower {
 public:
  /// @param scan  closed [m]. Throws InputError where it encloses nothing
  explicit ScanFollower(const TriangleMesh& scan);
  const TriangleMesh& scan() const { return scan_; }

  /// The pose, from the scan to the world, of least squares to points on the object's surface nearest to a guess: Gauss
  /// and Newton on the signed distance, robust. Nothing where there are fewer than 50 points.
  [[nodiscard]] std::optional<RigidMotion> follow(const std::vector<Vector3>& seen, const RigidMotion& guess) const;

 private:
  TriangleMesh scan_;
  double unit_;  // its greatest extent [m]
  SignedDistance distance_;
};

/// How an object moves before it meets anything: the parabola that the centre of its volume follows.
struct Flight {
  int frames = 0;                          ///< from `start_frame` on
  Vector3 velocity = Vector3::Zero();      ///< [m/s] at `start_frame`
  Vector3 acceleration = Vector3::Zero();  ///< [m/s^2]
  /// Standard deviations of their coordinates, by how far the centres lie from the parabola.
  double velocity_std = 0.0, acceleration_std = 0.0;
};

/// The flight of a scanned object that nothing holds: its rigid scan is followed from `start_frame`, where it stands as
/// it was scanned, until it comes near a plane of the scene (2 % of its size), is not found, or leaves the parabola of
/// the frames before by as much. Nothing where that are fewer than six frames.
/// @param frames  as `observe` gives them
std::optional<Flight> free_flight(const Capture& capture, std::span<const ObservedFrame> frames);

/// Everything of an object that stands in its scan's frame, moved by the scan's pose: surface, regions, weights,
/// forces. Throws std::invalid_argument for boxes, which cannot be turned.
void place(Scene& scene, const ScanPose& pose);

/// What sensors saw in every frame, as `observe` reads it, of a capture whose scan is placed first where its pose is
/// unknown: that is known then.
/// @param found  the pose, where one was found; may be null
std::vector<ObservedFrame> observe_placed(Capture& capture, const ObserveOptions& options = {},
                                          const std::function<void(int, int)>& progress = {},
                                          std::optional<ScanPose>* found = nullptr);

/// A mesh moved by a pose.
TriangleMesh placed(const TriangleMesh& scan, const ScanPose& pose);

}  // namespace pliant
