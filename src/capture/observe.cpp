#include "capture/observe.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>

#include "base/parallel.hpp"
#include "capture/capture_rules.hpp"
#include "capture/cloud_kinds.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_points.hpp"
#include "capture/pixel_kinds.hpp"
#include "capture/pixel_scatter.hpp"
#include "capture/point_cloud.hpp"

namespace pliant {

namespace {

void append_pixels(ObservedFrame& frame, const PixelSorter& sorter, const PinholeCamera& lens, int index,
                   const DepthImage& depth, const Image<PixelKind>& kinds) {
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u) {
      if (kinds(u, v) != PixelKind::Object) continue;
      const double z = depth(u, v);
      const Vector3 point = lens.unproject(u, v, z);
      const Vector3 view = (point - lens.camera_to_world.translation).normalized();
      const Vector3 normal = surface_normal(depth, lens, u, v, sorter.jump(z));
      const double cosine = normal.isZero() ? 1.0 : std::min(1.0, -normal.dot(view));
      frame.points.push_back(point);
      frame.noise.push_back(float(sorter.noise().along_normal(z, std::acos(cosine))));
      frame.view.push_back(view);
      frame.camera.push_back(index);
      frame.pixel.push_back(v * depth.width + u);
    }
  frame.scatter.resize(std::size_t(index) + 1, 0.0);
  frame.scatter[std::size_t(index)] = pixel_scatter(depth, kinds, lens, sorter.noise());
}

void append_camera(ObservedFrame& frame, const Capture& capture, const PixelSorter& sorter, int index) {
  const DepthCamera& camera = capture.depth[std::size_t(index)];
  const DepthImage depth = read_depth(capture, camera, frame.frame);
  const auto mask = read_object_mask(capture, camera, frame.frame);
  const PinholeCamera lens = camera.at(frame.frame);
  const double time = capture.scene.timing.times[std::size_t(frame.frame)] + camera.time_offset;
  append_pixels(frame, sorter, lens, index, depth, sorter.sort(depth, mask, &lens, time));
}

void append_points(ObservedFrame& frame, const std::vector<Vector3>& points, std::optional<double> noise) {
  for (const Vector3& point : points) {
    frame.points.push_back(point);
    frame.noise.push_back(float(noise.value_or(default_cloud_noise)));
    frame.view.push_back(Vector3::Zero());
    frame.camera.push_back(-1);
    frame.pixel.push_back(-1);
  }
}

template <class T>
void keep_every(std::vector<T>& values, std::size_t wanted) {
  for (std::size_t i = 0; i < wanted; ++i) values[i] = values[i * values.size() / wanted];
  values.resize(wanted);
}

void append_outline(ObservedFrame& frame, const Capture& capture, int index, int most) {
  const SilhouetteCamera& camera = capture.silhouettes[std::size_t(index)];
  Outline outline = outline_of(read_object_mask(capture, camera, frame.frame), camera.camera);
  if (const std::size_t wanted = std::size_t(most); most > 0 && outline.points.size() > wanted) {
    keep_every(outline.points, wanted);
    keep_every(outline.normals, wanted);
  }
  frame.outlines.push_back({index, std::move(outline)});
}

void thin_out(ObservedFrame& frame, int most) {
  const std::size_t wanted = std::size_t(most);
  if (most <= 0 || frame.points.size() <= wanted) return;
  keep_every(frame.points, wanted);
  keep_every(frame.noise, wanted);
  keep_every(frame.view, wanted);
  keep_every(frame.camera, wanted);
  keep_every(frame.pixel, wanted);
}

std::vector<int> observed_frames(const Capture& capture) {
  std::set<int> frames;
  for_each_camera(capture, [&](const RecordingCamera& camera, auto, auto) {
    for (const int frame : frames_of(capture.frame_count(), camera.every)) frames.insert(frame);
  });
  for (const CloudSequence& cloud : capture.clouds)
    for (const int frame : frames_of(capture.frame_count(), cloud.every)) frames.insert(frame);
  return {frames.begin(), frames.end()};
}

}  // namespace

std::vector<ObservedFrame> observe(const Capture& capture, const ObserveOptions& options,
                                   const std::function<void(int, int)>& progress) {
  std::vector<PixelSorter> sorters;
  for (const DepthCamera& camera : capture.depth) sorters.emplace_back(capture, camera, options);
  std::vector<CloudSorter> cloud_sorters;
  for (const CloudSequence& cloud : capture.clouds) cloud_sorters.emplace_back(capture, &cloud, options);
  const std::vector<int> numbers = observed_frames(capture);
  std::vector<ObservedFrame> frames(numbers.size());
  std::mutex mutex;
  int done = 0;
  parallel_for(std::size_t(0), numbers.size(), [&](std::size_t i) {
    ObservedFrame& frame = frames[i];
    frame.frame = numbers[i];
    for (std::size_t c = 0; c < capture.depth.size(); ++c)
      if (frame.frame % capture.depth[c].every == 0) append_camera(frame, capture, sorters[c], int(c));
    for (std::size_t c = 0; c < capture.silhouettes.size(); ++c)
      if (frame.frame % capture.silhouettes[c].every == 0)
        append_outline(frame, capture, int(c), options.max_points_per_frame);
    for (std::size_t k = 0; k < capture.clouds.size(); ++k) {
      const CloudSequence& cloud = capture.clouds[k];
      if (frame.frame % cloud.every == 0)
        append_points(frame,
                      cloud_sorters[k].sorted(read_points(capture.folder / cloud.points(frame.frame)), frame.cloud,
                                              capture.scene.timing.times[std::size_t(frame.frame)]),
                      cloud.noise);
    }
    thin_out(frame, options.max_points_per_frame);
    if (!progress) return;
    const std::lock_guard lock(mutex);
    progress(++done, int(numbers.size()));
  });
  return frames;
}

ObservedLoad observe_load(const Capture& capture, const Load& load, const ObserveOptions& options) {
  ObservedLoad observed;
  observed.seen.frame = -1;
  for (std::size_t c = 0; c < capture.depth.size(); ++c) {
    const DepthCamera& camera = capture.depth[c];
    const auto image = load.images.find(camera.name), mask_file = load.masks.find(camera.name);
    if (image == load.images.end()) continue;
    const PixelSorter sorter(capture, camera, options);
    const DepthImage depth = read_depth(camera, image->second);
    std::optional<Image<std::uint8_t>> mask;
    if (mask_file != load.masks.end()) mask = read_object_mask(camera, mask_file->second);
    append_pixels(observed.seen, sorter, camera.camera, int(c), depth, sorter.sort(depth, mask));
  }
  if (load.cloud) {
    const CloudSorter sorter(capture, nullptr, options);
    const std::vector<Vector3> kept = sorter.sorted(read_points(*load.cloud), observed.seen.cloud);
    observed.outliers = observed.seen.cloud.isolated;
    append_points(observed.seen, kept, capture.clouds.empty() ? std::nullopt : capture.clouds.front().noise);
  }
  thin_out(observed.seen, options.max_points_per_frame);
  return observed;
}

}  // namespace pliant
