#include "estimation/followed.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.hpp"
#include "estimation/pull_places.hpp"
#include "motion/linear_statics.hpp"

namespace pliant {

namespace {

FitOptions for_following(const Capture& capture, FitOptions options) {
  if (!options.element && capture.scene.object.shape_is == ShapeIs::Static) options.element = ElementKind::Tetrahedron;
  options.control_points = options.controls();
  return options;
}

}  // namespace

FollowedRecording::FollowedRecording(const RecordedCapture& recorded, const FitOptions& options,
                                     std::vector<std::string>& notes)
    : observed_(recorded.observed),
      recordings_({recorded}, for_following(recorded.capture, options), notes),
      grid_(recordings_.grid(options.cells, options.steps)),
      start_(recordings_.parameters().reference()) {
  const auto given = options.parameters.find("youngs_modulus");
  if (given == options.parameters.end() || !given->second.start) stiffen();
}

void FollowedRecording::stiffen() {
  constexpr double sag_of_size = 0.005;
  const Discretisation& d = grid_.recording.front();
  const LinearStatics statics(d.body, held_nodes(*d.body, d.simulation.holds), d.simulation.blocks, start_);
  if (!statics.is_held()) return;
  const double sag =
      statics.greatest_displacement(scan_load(*d.body, d.simulation.blocks, start_, d.simulation.weights));
  const double factor = std::max(1.0, sag / (sag_of_size * recording().size));
  d.simulation.blocks.scale_moduli(start_, factor);
}

Track FollowedRecording::follow(const VectorX& theta, const std::function<bool(int, int)>& progress,
                                const TrackOptions& options) const {
  const Discretisation& d = grid_.recording.front();
  const Recording& r = recordings_.front();
  return track(r.capture, d.body, d.simulation, theta, observed_, r.tracked.rest, r.tracked.frames, options, progress);
}

TrackedPoints supported_points(const Track& track, double size) {
  constexpr int fewest = 2;             // points about a mark
  constexpr double least_noise = 5e-4;  // times the size
  TrackedPoints tracked;
  tracked.rest = track.marks;
  const Embedding marks(*track.body, track.marks);
  for (const TrackedFrame& frame : track.frames) {
    if (frame.is_lost || frame.points == 0) continue;
    std::vector<TrackObservation> seen;
    for (int m = 0; m < marks.point_count(); ++m)
      if (frame.mark_points[std::size_t(m)] >= fewest) seen.push_back({m, marks.position(m, frame.nodes), 0.0, 0});
    if (seen.empty()) continue;
    // Neighbouring marks err together, as neighbouring pixels do: a frame counts as much as its points would.
    const double together = std::max(1.0, 3.0 * double(seen.size()) / ObjectiveOptions{}.independent_points);
    for (TrackObservation& mark : seen)
      mark.noise = std::max(frame.surface_rms, least_noise * size) * std::sqrt(together);
    tracked.frames[frame.frame] = std::move(seen);
  }
  return tracked;
}

std::optional<RegisteredPose> registered_pose(const RecordedCapture& recorded, const FitOptions& options,
                                              const std::function<bool()>& interrupted) {
  const Scene& scene = recorded.capture.scene;
  const int last = scene.timing.start_frame;
  const bool is_seen = std::ranges::any_of(
      recorded.observed, [&](const ObservedFrame& f) { return f.frame <= last && !f.points.empty(); });
  if (!scene.initial.released || scene.initial.release_of || recorded.followed || !recorded.capture.markers.empty() ||
      !is_seen)
    return std::nullopt;
  try {
    std::vector<std::string> ignored;
    const FollowedRecording held(recorded, options, ignored);
    const Track found =
        held.follow(held.start(), [&](int done, int) { return done <= last && !(interrupted && interrupted()); });
    RegisteredPose pose{supported_points(found, held.recording().size)};
    std::erase_if(pose.points.frames, [&](const auto& frame) { return frame.first != last; });
    if (pose.points.frames.empty()) return std::nullopt;
    const auto there = std::ranges::find(found.frames, last, &TrackedFrame::frame);
    pose.pulled_at = pull_places(held, found, *there, pose.points.frames.begin()->second, options.pull_points);
    return pose;
  } catch (const InputError&) {  // of a recording that cannot be tracked: its surface tells where it was held
  }
  return std::nullopt;
}

}  // namespace pliant
