#include "capture/fuse.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/median.hpp"
#include "capture/capture_rules.hpp"
#include "capture/observe.hpp"
#include "capture/point_cloud.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

int nearest_frame(const std::vector<double>& times, double time) {
  const auto next = std::ranges::upper_bound(times, time);
  if (next == times.begin()) return 0;
  const int before = int(next - times.begin()) - 1;
  return next != times.end() && *next - time < time - times[std::size_t(before)] ? before + 1 : before;
}

/// The least number of frames between clouds with which each has a point.
int common_step(const std::vector<std::vector<Vector3>>& clouds) {
  for (int every = 1; every <= int(clouds.size()); ++every) {
    const std::vector<int> frames = frames_of(int(clouds.size()), every);
    if (std::ranges::all_of(frames, [&](int frame) { return !clouds[std::size_t(frame)].empty(); })) return every;
  }
  return 0;
}

/// Clouds of a recording's frames.
class Fusion {
 public:
  Fusion(const Capture& capture, const std::function<void(int, int)>& progress)
      : clouds_(std::size_t(capture.frame_count())) {
    const Timing& timing = capture.scene.timing;
    const double interval = (timing.times.back() - timing.times.front()) / std::max(1, timing.frame_count() - 1);
    for (const ObservedFrame& seen : observe(capture, {}, progress))
      for (std::size_t i = 0; i < seen.points.size(); ++i) {
        const double offset =
            timing.is_static || seen.camera[i] < 0 ? 0.0 : capture.depth[std::size_t(seen.camera[i])].time_offset;
        const double time = timing.times[std::size_t(seen.frame)] + offset;
        const int frame = offset == 0.0 ? seen.frame : nearest_frame(timing.times, time);
        const double delay = timing.is_static ? 0.0 : std::abs(time - timing.times[std::size_t(frame)]);
        if (delay > 0.5 * interval + 1e-9) continue;  // before the first frame, or after the last
        delay_ = std::max(delay_, delay);
        clouds_[std::size_t(frame)].push_back(seen.points[i]);
        noise_.push_back(seen.noise[i]);
      }
  }

  void write(const fs::path& folder, FusedClouds& result) {
    result.every = common_step(clouds_);
    if (result.every == 0)
      throw InputError({{result.capture.file},
                        "no point of the object in the first frame",
                        "a recording whose first frame shows the object",
                        "`pliant check` says what is seen"});
    result.greatest_delay = delay_;
    for (const int frame : frames_of(int(clouds_.size()), result.every)) {
      write_points(folder / fmt::format("clouds/{:06}.ply", frame), clouds_[std::size_t(frame)]);
      result.points += clouds_[std::size_t(frame)].size();
    }
    result.capture.clouds = {
        {{"clouds/%06d.ply"}, result.every, std::stod(fmt::format("{:.3g}", double(median(noise_))))}};
  }

 private:
  std::vector<std::vector<Vector3>> clouds_;
  std::vector<float> noise_;
  double delay_ = 0.0;
};

}  // namespace

FusedClouds fuse_clouds(const fs::path& folder, const Capture& capture, const std::function<void(int, int)>& progress) {
  if (capture.depth.empty() && capture.clouds.empty())
    throw InputError({{capture.file}, "neither [[depth]] nor [[cloud]]", "something to fuse", ""});
  if (!capture.scene.object.pose_is_known)
    throw InputError({{capture.file},
                      "a scan whose pose is unknown",
                      "a scan in its place: clouds have no masks by which it could be found",
                      "run `pliant place` first, and name its rest.ply"});
  FusedClouds result;
  result.capture = capture;
  result.capture.depth.clear(), result.capture.clouds.clear();
  if (capture.frame_count() > 0) Fusion(capture, progress).write(folder, result);
  for (std::size_t i = 0; i < capture.loads.size(); ++i) {
    Load& load = result.capture.loads[i];
    if (load.images.empty() && !load.cloud) continue;
    const fs::path file = fs::absolute(folder / fmt::format("load/{:03}.ply", i)).lexically_normal();
    write_points(file, observe_load(capture, capture.loads[i]).seen.points);
    load.cloud = file, load.images.clear(), load.masks.clear();
  }
  write_capture(folder, result.capture, "Clouds of all sensors, fused by pliant from " + capture.name + ".");
  return result;
}

}  // namespace pliant
