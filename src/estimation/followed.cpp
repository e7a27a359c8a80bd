#include "estimation/followed.hpp"

#include <algorithm>
#include <utility>

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

}  // namespace pliant
