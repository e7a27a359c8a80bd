#include "estimation/followed.hpp"

#include <utility>

namespace pliant {

namespace {

FitOptions for_following(const Capture& capture, FitOptions options) {
  if (!options.element && capture.shape_is == ShapeIs::Static) options.element = ElementKind::Tetrahedron;
  if (options.control_points == FitOptions::automatic) options.control_points = 1;
  return options;
}

}  // namespace

FollowedRecording::FollowedRecording(RecordedCapture recorded, const FitOptions& options,
                                     std::vector<std::string>& notes)
    : observed_(recorded.observed),
      recordings_({recorded}, for_following(recorded.capture, options), notes),
      grid_(recordings_.grid(options.cells, options.steps)),
      start_(recordings_.front().own(recordings_.parameters().reference())) {}

Track FollowedRecording::follow(const VectorX& theta, const std::function<bool(int, int)>& progress,
                                const TrackOptions& options) const {
  const Discretisation& d = grid_.recording.front();
  const Recording& r = recordings_.front();
  return track(r.capture, d.body, d.simulation, theta, observed_, r.tracked.rest, r.tracked.frames, options, progress);
}

}  // namespace pliant
