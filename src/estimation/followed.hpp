#pragma once

#include <functional>
#include <string>
#include <vector>

#include "estimation/recordings.hpp"
#include "tracking/tracker.hpp"

namespace pliant {

/// A recording whose object is followed through its points: the scene that it takes, with a body of its own. Where
/// the scan was taken sagging and no element is chosen that is one of linear tetrahedra: they are too stiff in bending
/// to estimate by, and good enough to follow by.
class FollowedRecording {
 public:
  /// Throws InputError where the recording cannot be followed, with the reason.
  /// @param notes  what the user should know about how it was read is added
  FollowedRecording(const RecordedCapture& recorded, const FitOptions& options, std::vector<std::string>& notes);

  /// Parameters at which nothing is known: the capture's facts, the options' choices, and middling guesses. Young's
  /// modulus is then at least so high that the object's weight hardly bends it: what is too soft hangs too low, while
  /// what is too stiff is drawn to where it was seen.
  const VectorX& start() const { return start_; }
  const Recording& recording() const { return recordings_.front(); }
  const Discretisation& discretisation() const { return grid_.recording.front(); }
  /// Where a parameter vector of this recording alone has its Young's moduli and Poisson's ratio.
  const MaterialBlocks& material() const { return recordings_.material(); }
  /// @param theta     of this recording
  /// @param progress  frames done and their total; false stops. May be empty
  [[nodiscard]] Track follow(const VectorX& theta, const std::function<bool(int, int)>& progress = {},
                             const TrackOptions& options = {}) const;

 private:
  void stiffen();
  std::vector<ObservedFrame> observed_;
  Recordings recordings_;
  Grid grid_;
  VectorX start_;
};

/// Points of a track's surface where and when it was supported by what was seen.
TrackedPoints supported_points(const Track& track, double size);

/// The pose from which an object is released, and where it is held in it.
struct RegisteredPose {
  TrackedPoints points;                 ///< of its surface, in the last frame in which it was held
  std::vector<Vector3> pulled_at = {};  ///< places [m], in the scan, see `pull_places`; none: not known
};

/// That pose where the tracker registered it in the frames in which the object was held, from as scanned. It may lie as
/// far from the scan as the object is large, where the nearest surface of what was seen is that of another part; it is
/// no more than where to look for what held the object. None where nothing is released or seen, where markers are
/// followed or a known weight held it, and where it is not found.
/// @param interrupted  asked on the way; may be empty
std::optional<RegisteredPose> registered_pose(const RecordedCapture& recorded, const FitOptions& options,
                                              const std::function<bool()>& interrupted = {});

}  // namespace pliant
