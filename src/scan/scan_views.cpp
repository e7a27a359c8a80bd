#include "scan/scan_views.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "capture/depth_points.hpp"
#include "capture/find_plane.hpp"
#include "capture/segment.hpp"

namespace pliant {

namespace {

constexpr double trimmed = 3.0;                                    // deviations around the median that a mean takes
constexpr double moving = 4.0;                                     // deviations of a mean's change that are motion
constexpr double greatest_tilt = 40.0 / 180.0 * std::numbers::pi;  // of the plane from `up`
constexpr double least_share = 0.05;                               // of the object's readings, of a part that counts
constexpr int least_readings = 100;                                // on an object

[[noreturn]] void fail(const Capture& capture, const std::string& found, const std::string& expected,
                       const std::string& advice) {
  throw InputError(Problem{{capture.file}, found, expected, advice});
}

std::vector<int> frames_at_rest(const Capture& capture, const DepthCamera& camera, const ScanChoice& choice) {
  const int by_default =
      capture.scene.timing.is_static ? capture.frame_count() - 1 : std::max(0, capture.scene.timing.start_frame - 1);
  const int last = choice.last_frame.value_or(by_default);
  if (last < 0 || last >= capture.frame_count())
    fail(capture, "the last frame of the scan is " + std::to_string(last),
         "0 to " + std::to_string(capture.frame_count() - 1), "");
  std::vector<int> frames;
  for (int frame = 0; frame <= last; frame += camera.every) frames.push_back(frame);
  return frames;
}

// Mean of the readings near their median; 0 where fewer than half of the frames have one.
float central_mean(std::vector<float> readings, std::size_t frames, const DepthNoise& noise) {
  if (readings.empty() || 2 * readings.size() < frames) return 0.0f;
  const auto middle = readings.begin() + std::ptrdiff_t(readings.size() / 2);
  std::ranges::nth_element(readings, middle);
  const double median = *middle, reach = trimmed * noise.axial(median);
  double sum = 0.0;
  int count = 0;
  for (const float z : readings)
    if (std::abs(z - median) <= reach) sum += z, ++count;
  return float(sum / count);
}

struct Average {
  DepthImage depth, early, late;  // of all frames, of their first and their last third
  std::optional<Image<std::uint8_t>> mask;
  int frames = 0;
};

DepthImage average(std::span<const DepthImage> images, const DepthNoise& noise) {
  DepthImage result(images[0].width, images[0].height);
  std::vector<float> readings;
  for (std::size_t p = 0; p < result.pixels.size(); ++p) {
    readings.clear();
    for (const DepthImage& image : images)
      if (image.pixels[p] > 0) readings.push_back(image.pixels[p]);
    result.pixels[p] = central_mean(readings, images.size(), noise);
  }
  return result;
}

Average read_average(const Capture& capture, const DepthCamera& camera, const DepthNoise& noise,
                     const std::vector<int>& frames) {
  std::vector<DepthImage> images;
  std::vector<int> votes(std::size_t(camera.camera.width) * std::size_t(camera.camera.height), 0);
  for (const int frame : frames) {
    images.push_back(read_depth(capture, camera, frame));
    if (const auto mask = read_object_mask(capture, camera, frame))
      for (std::size_t p = 0; p < votes.size(); ++p) votes[p] += mask->pixels[p] != 0;
  }
  Average result;
  result.frames = int(images.size());
  result.depth = average(images, noise);
  const std::size_t third = std::max<std::size_t>(1, images.size() / 3);
  result.early = average(std::span(images).first(third), noise);
  result.late = average(std::span(images).last(third), noise);
  if (!camera.masks) return result;
  result.mask.emplace(camera.camera.width, camera.camera.height);
  for (std::size_t p = 0; p < votes.size(); ++p) result.mask->pixels[p] = 2 * votes[p] > result.frames ? 255 : 0;
  return result;
}

// Pixels on a plane of the scene that no mask gives to the object; 0 where those are fewer than half.
int free_pixels(const Segmentation& scene, int plane, const std::optional<Image<std::uint8_t>>& mask) {
  int all = 0, free = 0;
  for (std::size_t p = 0; p < scene.label.pixels.size(); ++p) {
    if (scene.label.pixels[p] != -2 - plane) continue;
    ++all;
    free += !mask || mask->pixels[p] == 0;
  }
  return 2 * free > all ? free : 0;
}

// The largest plane that is about level, of all cameras; a flat top of the object is none.
std::optional<FoundPlane> largest_level_plane(const Capture& capture, const std::vector<Segmentation>& scenes,
                                              const std::vector<Average>& averages) {
  std::optional<FoundPlane> best;
  for (std::size_t c = 0; c < scenes.size(); ++c)
    for (int i = 0; i < int(scenes[c].planes.size()); ++i) {
      const PlaneFit& fit = scenes[c].planes[std::size_t(i)];
      const double cosine = fit.normal.dot(capture.scene.world.up);
      const int pixels = free_pixels(scenes[c], i, averages[c].mask);
      if (std::abs(cosine) < std::cos(greatest_tilt) || pixels <= (best ? best->pixels : 0)) continue;
      best.emplace();
      best->point = fit.point, best->normal = cosine < 0 ? Vector3(-fit.normal) : fit.normal;
      best->rms = fit.rms, best->pixels = pixels;
    }
  return best;
}

void find_support(const Capture& capture, const std::vector<Segmentation>& scenes, const std::vector<Average>& averages,
                  ScanViews& result) {
  if (!capture.scene.planes.empty()) {
    const auto found = find_plane(capture, capture.scene.planes[0]);
    result.plane = capture.scene.planes[0];
    if (found) result.plane_rms = found->rms;
    if (found && !capture.scene.planes[0].known) result.plane = Plane(*found);
    return;
  }
  const auto found = largest_level_plane(capture, scenes, averages);
  if (!found)
    fail(capture, "no plane is seen on which the object could stand", "a large plane within 40 degrees of level",
         "declare it as [[plane]], check `up`, or say that the object stands on none (--floating)");
  result.plane = Plane(*found);
  result.plane_rms = found->rms;
}

Image<std::uint8_t> pixels_of(const Segmentation& scene, int object) {
  Image<std::uint8_t> result(scene.label.width, scene.label.height);
  for (std::size_t p = 0; p < result.pixels.size(); ++p) result.pixels[p] = scene.label.pixels[p] == object ? 255 : 0;
  return result;
}

Image<std::uint8_t> object_at_pixel(const Capture& capture, const Segmentation& scene,
                                    const std::array<int, 2>& pixel) {
  const std::string place = "(" + std::to_string(pixel[0]) + ", " + std::to_string(pixel[1]) + ")";
  if (!scene.label.contains(pixel[0], pixel[1]))
    fail(capture, "the pixel " + place + " lies outside the image", "", "");
  const int label = scene.label(pixel[0], pixel[1]);
  if (label < 0)
    fail(capture, "the pixel " + place + (label == -1 ? " has no reading" : " shows no object"),
         "column and row of a pixel on the object", "`pliant check CAPTURE --out DIR` pictures the objects");
  return pixels_of(scene, label);
}

// The largest object with its foot at the plane; of a floating one the largest of all.
std::optional<Image<std::uint8_t>> largest_object(const Segmentation& scene, const PinholeCamera& camera,
                                                  const DepthImage& depth, const std::optional<Plane>& plane) {
  constexpr double touching = 0.02;  // [m]
  for (int i = 0; i < int(scene.objects.size()); ++i) {
    if (!plane) return pixels_of(scene, i);
    double lowest = 1e300, highest = -1e300;
    for (int v = 0; v < depth.height; ++v)
      for (int u = 0; u < depth.width; ++u) {
        if (scene.label(u, v) != i) continue;
        const double height = plane->normal.dot(camera.unproject(u, v, depth(u, v)) - plane->point);
        lowest = std::min(lowest, height), highest = std::max(highest, height);
      }
    if (std::abs(lowest) < touching && highest > touching) return pixels_of(scene, i);
  }
  return std::nullopt;
}

using Pixels = std::vector<int>;

// Connected pixels (of eight neighbours) for which `joined(a, b)` holds, beginning with one.
template <class Joined>
Pixels connected(int seed, int width, int height, std::vector<char>& visited, const Joined& joined) {
  Pixels members{seed};
  visited[std::size_t(seed)] = 1;
  for (std::size_t next = 0; next < members.size(); ++next) {
    const int u = members[next] % width, v = members[next] / width;
    for (int b = std::max(0, v - 1); b <= std::min(height - 1, v + 1); ++b)
      for (int a = std::max(0, u - 1); a <= std::min(width - 1, u + 1); ++a) {
        const int p = b * width + a;
        if (visited[std::size_t(p)] || !joined(members[next], p)) continue;
        visited[std::size_t(p)] = 1;
        members.push_back(p);
      }
  }
  return members;
}

// Takes away what a mask holds beside the object: readings on the plane, and small parts behind a jump in depth.
void remove_other_surfaces(const DepthImage& depth, const ScanView& view, const std::optional<Plane>& plane,
                           Image<std::uint8_t>& silhouette) {
  constexpr double gap = 0.08;  // [m], as between a chin and the belly behind it
  const auto reads = [&](int p) { return silhouette.pixels[std::size_t(p)] != 0 && depth.pixels[std::size_t(p)] > 0; };
  const int count = int(depth.pixels.size());
  for (int p = 0; p < count && plane; ++p) {
    if (!reads(p)) continue;
    const double z = depth.pixels[std::size_t(p)];
    const Vector3 point = view.camera.unproject(p % depth.width, p / depth.width, z);
    if (plane->normal.dot(point - plane->point) < scan_plane_reach * view.noise.axial(z))
      silhouette.pixels[std::size_t(p)] = 0;
  }
  std::vector<char> visited(depth.pixels.size(), 0);
  std::vector<Pixels> parts;
  std::size_t total = 0;
  for (int p = 0; p < count; ++p) {
    if (visited[std::size_t(p)] || !reads(p)) continue;
    parts.push_back(connected(p, depth.width, depth.height, visited, [&](int a, int b) {
      return reads(b) && std::abs(depth.pixels[std::size_t(a)] - depth.pixels[std::size_t(b)]) < gap;
    }));
    total += parts.back().size();
  }
  for (const Pixels& part : parts)
    if (double(part.size()) < least_share * double(total))
      for (const int p : part) silhouette.pixels[std::size_t(p)] = 0;
}

// Fills holes of the outline through which nothing else is seen.
void fill_holes(const DepthImage& depth, Image<std::uint8_t>& silhouette) {
  std::vector<char> visited(depth.pixels.size(), 0);
  for (int p = 0; p < int(visited.size()); ++p) {
    if (visited[std::size_t(p)] || silhouette.pixels[std::size_t(p)] != 0) continue;
    const Pixels hole = connected(p, depth.width, depth.height, visited, [&](int a, int b) {
      const bool is_diagonal = a % depth.width != b % depth.width && a / depth.width != b / depth.width;
      return !is_diagonal && silhouette.pixels[std::size_t(b)] == 0;
    });
    const bool is_open = std::ranges::any_of(hole, [&](int q) {
      const int u = q % depth.width, v = q / depth.width;
      return u == 0 || v == 0 || u == depth.width - 1 || v == depth.height - 1;
    });
    const auto read = std::ranges::count_if(hole, [&](int q) { return depth.pixels[std::size_t(q)] > 0; });
    if (!is_open && double(read) < 0.2 * double(hole.size()))
      for (const int q : hole) silhouette.pixels[std::size_t(q)] = 255;
  }
}

// Readings inside the outline that lie on a smooth surface.
DepthImage smooth_readings(const DepthImage& depth, const ScanView& view) {
  DepthImage result(depth.width, depth.height);
  for (int v = 0; v < depth.height; ++v)
    for (int u = 0; u < depth.width; ++u) {
      const float z = depth(u, v);
      if (!(z > 0) || view.silhouette(u, v) == 0) continue;
      const double jump = view.noise.jump(z);
      if (is_supported(depth, u, v, jump) && !is_at_discontinuity(depth, u, v, jump)) result(u, v) = z;
    }
  return result;
}

double moved_share(const Average& average, const ScanView& view) {
  if (average.frames < 6) return 0.0;
  int moved = 0, count = 0;
  for (std::size_t p = 0; p < view.depth.pixels.size(); ++p) {
    const float z = view.depth.pixels[p], early = average.early.pixels[p], late = average.late.pixels[p];
    if (!(z > 0)) continue;
    ++count;
    moved += !(early > 0) || !(late > 0) || std::abs(late - early) > moving * view.noise.axial(z);
  }
  return count > 0 ? double(moved) / count : 0.0;
}

}  // namespace

ScanViews read_scan_views(const Capture& capture, const ScanChoice& choice) {
  if (capture.depth.empty() || capture.frame_count() == 0)
    fail(capture, "the capture has no depth camera", "[[depth]] images of the object at rest",
         "of a thin sheet that is seen as clouds, state its --thickness");
  require_standing_cameras(capture, "a scan of its images");
  std::vector<Average> averages;
  std::vector<Segmentation> scenes;
  for (const DepthCamera& camera : capture.depth) {
    const DepthNoise noise(camera, typical_depth(capture, camera.camera));
    averages.push_back(read_average(capture, camera, noise, frames_at_rest(capture, camera, choice)));
    scenes.push_back(segment(averages.back().depth, camera.camera, noise));
  }
  ScanViews result;
  if (!choice.floating) find_support(capture, scenes, averages, result);

  for (std::size_t c = 0; c < capture.depth.size(); ++c) {
    const DepthCamera& camera = capture.depth[c];
    const Average& average = averages[c];
    ScanView view{camera.camera, DepthNoise(camera, typical_depth(capture, camera.camera)), {}, {}, average.frames, 0};
    std::optional<Image<std::uint8_t>> object = average.mask;
    if (object && std::ranges::all_of(object->pixels, [](std::uint8_t m) { return m == 0; }))
      fail(capture, "the masks of camera \"" + camera.name + "\" show no object in the frames of the scan",
           "masks that are not zero on the object", "leave `masks` out to have the object found in the depth images");
    if (!object && choice.pixel && c == 0) object = object_at_pixel(capture, scenes[c], *choice.pixel);
    if (!object) object = largest_object(scenes[c], camera.camera, average.depth, result.plane);
    if (!object) continue;
    view.silhouette = *object;
    remove_other_surfaces(average.depth, view, result.plane, view.silhouette);
    fill_holes(average.depth, view.silhouette);
    view.depth = smooth_readings(average.depth, view);
    view.moved = moved_share(average, view);
    if (std::ranges::count_if(view.depth.pixels, [](float z) { return z > 0; }) >= least_readings)
      result.views.push_back(std::move(view));
  }
  if (result.views.empty())
    fail(capture, "no object is found " + std::string(result.plane ? "that stands on the plane" : "in the images"),
         "100 readings at least on an object that rises from its plane by 20 mm or more",
         "give masks, or a pixel on the object (--pixel)");
  return result;
}

}  // namespace pliant
