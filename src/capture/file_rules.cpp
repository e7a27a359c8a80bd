#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "base/files.hpp"
#include "base/median.hpp"
#include "capture/capture_rules.hpp"
#include "capture/curves.hpp"
#include "capture/image_io.hpp"
#include "capture/markers.hpp"
#include "capture/point_cloud.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double farthest_markers = 100.0;  // sizes of the object from where they rest (median)
constexpr double rate_tolerance = 5e-4;     // tells 59.94 Hz from 60 Hz

std::string size_text(int width, int height) { return std::to_string(width) + " x " + std::to_string(height); }

constexpr std::size_t most_missing = 10000;  // frames: a wrong count of millions is told without a look at each

// Frames whose file is not there, the first ones where they are too many.
std::vector<int> missing_frames(const Capture& capture, const FramePattern& pattern, const std::vector<int>& frames) {
  std::vector<int> missing;
  for (auto frame = frames.begin(); frame != frames.end() && missing.size() < most_missing; ++frame)
    if (!is_file(capture.folder / pattern(*frame))) missing.push_back(*frame);
  return missing;
}

bool complain_missing(RuleContext& context, const std::string& key, const FramePattern& pattern,
                      const std::vector<int>& frames) {
  const std::vector<int> missing = missing_frames(context.capture, pattern, frames);
  if (missing.empty()) return false;
  const std::string of = " of " + std::to_string(frames.size());
  context.toml.reject(
      key,
      missing.size() == frames.size() ? "no file \"" + pattern(frames.front()).string() + "\", nor for any other frame"
                                      : "no file for " + std::string(missing.size() < most_missing ? "" : "at least ") +
                                            std::to_string(missing.size()) + of + " frames: " + ranges_text(missing),
      "a file for each frame from 0 to " + std::to_string(frames.back()),
      "correct the pattern or `frame_count`, or give `every` where images exist for every n-th frame only");
  return true;
}

enum class Kind { Depth, Mask };

// What is wrong with an image's header; "" where nothing is.
std::string header_fault(const fs::path& path, const PinholeCamera& camera, Kind kind) {
  try {
    const ImageHeader header = read_image_header(path);
    if (header.width != camera.width || header.height != camera.height)
      return size_text(header.width, header.height) + " pixels";
    if (kind == Kind::Depth && (header.bits != 16 || header.channels != 1))
      return std::to_string(header.bits) + " bits, " + std::to_string(header.channels) + " channels";
    if (kind == Kind::Mask && header.bits > 8) return std::to_string(header.bits) + " bits a channel";
    return "";
  } catch (const InputError& error) {
    return error.problems().front().found;
  }
}

void check_header(RuleContext& context, const std::string& key, const fs::path& path, const PinholeCamera& camera,
                  Kind kind) {
  const std::string fault = header_fault(path, camera, kind);
  if (fault.empty()) return;
  context.toml.reject(
      key, "\"" + path.lexically_relative(context.capture.folder).string() + "\" has " + fault,
      size_text(camera.width, camera.height) + (kind == Kind::Depth ? " pixels of 16-bit grey" : " pixels of 8 bits"),
      fault == size_text(camera.height, camera.width) + " pixels"
          ? "the images are turned by 90 degrees against the camera: write them again as the sensor sees them"
          : "correct the camera's size, or write the images again");
}

// The first fault of a sequence, with the number of files that share it.
void check_sequence(RuleContext& context, const RecordingCamera& camera, const std::string& key,
                    const FramePattern& pattern, Kind kind) {
  const std::vector<int> frames = frames_of(context.capture.frame_count(), camera.every);
  if (frames.empty() || complain_missing(context, key, pattern, frames)) return;
  for (const int frame : frames) {
    const fs::path path = context.capture.folder / pattern(frame);
    if (header_fault(path, camera.camera, kind).empty()) continue;
    check_header(context, key, path, camera.camera, kind);
    return;
  }
}

void check_markers_on_object(RuleContext& context, const std::string& key, const MarkerSet& markers) {
  if (!context.capture.scene.object.surface) return;
  const Box box = bounding_box(*context.capture.scene.object.surface);
  const double margin = 0.1 * box.extent().maxCoeff();
  for (Eigen::Index i = 0; i < markers.rest.rows(); ++i) {
    const Vector3 p = markers.rest.row(i);
    if ((p.array() >= box.min.array() - margin).all() && (p.array() <= box.max.array() + margin).all()) continue;
    context.toml.complain(key, "marker \"" + markers.ids[std::size_t(i)] + "\" at rest lies outside the object",
                          "markers on or in the object", "give markers in metres, in the surface's coordinates");
    return;
  }
}

// Followed markers in another unit than those at rest: far beyond where the object can have got.
void check_marker_unit(RuleContext& context, const std::string& key, const MarkerSet& markers) {
  if (!context.capture.scene.object.surface) return;
  const double size = bounding_box(*context.capture.scene.object.surface).extent().maxCoeff();
  std::vector<double> ways;
  for (const Points& frame : markers.frames)
    for (Eigen::Index i = 0; i < frame.rows(); ++i)
      if (const double way = (frame.row(i) - markers.rest.row(i)).norm(); std::isfinite(way)) ways.push_back(way);
  const double way = median(std::move(ways));
  if (way > std::max(farthest_markers * size, 2.0))
    context.toml.complain(key, "markers " + text_of(way, "m") + " away from where they rest (median)",
                          "positions near the object", "give markers in metres, in the surface's coordinates");
}

// The capture's facts and those of the track's file must be one recording.
void check_marker_rate(RuleContext& context, const std::string& key, const fs::path& track, const MarkerSet& markers) {
  const std::vector<double>& times = context.capture.scene.timing.times;
  if (!markers.frame_rate || times.size() < 2 || !context.toml.is_sound("timing")) return;
  const double rate = double(times.size() - 1) / (times.back() - times.front());
  if (std::abs(*markers.frame_rate / rate - 1.0) <= rate_tolerance) return;
  const std::string stated = context.toml.places.has("timing.timestamps") ? "`timestamps` are at " : "`frame_rate` is ";
  context.toml.complain(key,
                        "\"" + track.filename().string() + "\" has frames at " + text_of(*markers.frame_rate, "Hz") +
                            " (POINT:RATE), " + stated + text_of(rate, "Hz"),
                        "one rate", "correct [timing], or export the track at the rate of the other sensors");
}

void check_marker_pair(RuleContext& context, const std::string& block, const fs::path& rest, const fs::path& under_load,
                       const std::optional<fs::path>& deviations = {}) {
  try_file(context, block, [&] {
    const MarkerSet markers = read_marker_pair(rest, under_load);
    if (deviations) (void)read_marker_deviations(*deviations, markers.ids);
    check_markers_on_object(context, block + ".markers_rest", markers);
    check_marker_unit(context, block + ".markers", markers);
  });
}

}  // namespace

void add_problems(RuleContext& context, const std::string& key, const InputError& error) {
  std::vector<Problem>& told = context.toml.problems;
  for (const Problem& problem : error.problems()) {
    const auto is_same = [&](const Problem& other) { return to_string(other) == to_string(problem); };
    if (std::ranges::none_of(told, is_same)) told.push_back(problem);
  }
  context.toml.broken.insert(key);
}

std::vector<int> frames_of(int frame_count, int every) {
  std::vector<int> frames;
  for (int frame = 0; every > 0 && frame < frame_count; frame += every) frames.push_back(frame);
  return frames;
}

std::string ranges_text(std::span<const int> numbers) {
  constexpr int most_runs = 8;
  std::string text;
  int runs = 0;
  for (std::size_t begin = 0; begin < numbers.size();) {
    std::size_t end = begin;
    while (end + 1 < numbers.size() && numbers[end + 1] == numbers[end] + 1) ++end;
    if (++runs > most_runs) return text + ", and " + std::to_string(numbers.size() - begin) + " more";
    text += (text.empty() ? "" : ", ") + std::to_string(numbers[begin]);
    if (end > begin) text += "-" + std::to_string(numbers[end]);
    begin = end + 1;
  }
  return text;
}

namespace {

void check_depth_files(RuleContext& context) {
  for_each_sound(context, "depth", context.capture.depth, [&](const DepthCamera& camera, const std::string& key) {
    check_sequence(context, camera, key + ".images", camera.images, Kind::Depth);
    if (camera.masks) check_sequence(context, camera, key + ".masks", *camera.masks, Kind::Mask);
    if (camera.background) check_header(context, key + ".background", *camera.background, camera.camera, Kind::Depth);
  });
}

void check_silhouette_files(RuleContext& context) {
  for_each_sound(context, "silhouette", context.capture.silhouettes, [&](const auto& camera, const std::string& key) {
    check_sequence(context, camera, key + ".masks", camera.masks, Kind::Mask);
  });
}

void check_clouds(RuleContext& context) {
  for_each_sound(context, "cloud", context.capture.clouds, [&](const CloudSequence& cloud, const std::string& key) {
    const std::vector<int> frames = frames_of(context.capture.frame_count(), cloud.every);
    if (frames.empty() || complain_missing(context, key + ".points", cloud.points, frames)) return;
    try_file(context, key, [&] {
      for (const int frame : frames) (void)read_point_count(context.capture.folder / cloud.points(frame));
      if (cloud.background) (void)read_point_count(*cloud.background);
    });
  });
}

void check_markers(RuleContext& context) {
  if (context.capture.scene.timing.times.empty()) return;
  for_each_sound(context, "markers", context.capture.markers, [&](const MarkerTrack& files, const std::string& key) {
    try_file(context, key, [&] {
      const MarkerSet markers = read_markers(files, context.capture.frame_count());
      check_markers_on_object(context, key + ".rest", markers);
      check_marker_unit(context, key + ".track", markers);
      check_marker_rate(context, key + ".track", files.track, markers);
    });
  });
}

void check_press_markers(RuleContext& context) {
  for_each_sound(context, "press", context.capture.presses, [&](const Press& press, const std::string& key) {
    check_marker_pair(context, key, press.markers_rest, press.markers, press.markers_std);
  });
}

/// Against a whole set of forces, markers next to where they act move only where the forces are the sensor's:
/// reactions.
void check_force_signs(RuleContext& context) {
  constexpr double against = -0.2;  // cosine between force and motion
  const Capture& capture = context.capture;
  int fitted = 0, reversed = 0;
  for_each_sound(context, "press", capture.presses, [&](const Press& press, const std::string& key) {
    if (!is_fitted(press.role)) return;
    try_file(context, key, [&] {
      const MarkerSet markers = read_marker_pair(press.markers_rest, press.markers);
      std::vector<std::pair<double, int>> nearest;
      for (int i = 0; i < markers.marker_count(); ++i)
        if (markers.is_seen(0, i))
          nearest.emplace_back((markers.rest.row(i).transpose() - press.contact_centre).norm(), i);
      std::ranges::sort(nearest);
      nearest.resize(std::min(nearest.size(), std::max<std::size_t>(3, nearest.size() / 10)));
      double work = 0.0, most = 0.0;
      for (const auto& [distance, i] : nearest) {
        const Vector3 way = markers.frames[0].row(i) - markers.rest.row(i);
        work += way.dot(press.force), most += way.norm() * press.force.norm();
      }
      ++fitted, reversed += work < against * most;
    });
  });
  if (fitted > 0 && reversed == fitted)
    context.toml.complain(
        "press[0].force",
        fitted == 1 ? "the markers next to the contact move against the force"
                    : "the markers next to the contact move against the force, under all " + std::to_string(fitted) +
                          " presses",
        "the force of the probe on the object",
        "a force sensor behind the probe reads the reaction, which has the opposite sign: turn it round");
  fitted = reversed = 0;
  for_each_sound(context, "grip", capture.grips, [&](const Grip& grip, const std::string&) {
    if (!grip.force || !is_fitted(grip.role) || grip.displacement.isZero()) return;
    const Vector3 direction = grip.force_direction.isZero() ? grip.displacement : grip.force_direction;
    ++fitted, reversed += *grip.force * direction.dot(grip.displacement) < 0.0;
  });
  if (fitted > 1 && reversed == fitted)
    context.toml.complain("grip[0].force", "all " + std::to_string(fitted) + " forces pull against the displacements",
                          "the force of the grip on the object",
                          "a load cell reads the reaction, which has the opposite sign: turn it round");
}

void check_load_files(RuleContext& context) {
  for_each_sound(context, "load", context.capture.loads, [&](const Load& load, const std::string& key) {
    if (load.markers && load.markers_rest) check_marker_pair(context, key, *load.markers_rest, *load.markers);
    for (const DepthCamera& camera : context.capture.depth) {
      if (load.images.contains(camera.name))
        check_header(context, key + ".images", load.images.at(camera.name), camera.camera, Kind::Depth);
      if (load.masks.contains(camera.name))
        check_header(context, key + ".masks", load.masks.at(camera.name), camera.camera, Kind::Mask);
    }
    try_file(context, key, [&] {
      if (load.cloud) (void)read_point_count(*load.cloud);
    });
  });
}

constexpr double greatest_stretch = 20.0;  // of a material that people test
constexpr double about_rest = 0.02;        // [-] of a stretch from 1, within which residual stresses may have any sign
constexpr double small_stress = 0.02;      // of the greatest, likewise

/// Stretches that are percents or strains: 1 is the unloaded length, above it stresses pull and below it they press.
void check_stretches(RuleContext& context, const std::string& key, const StressCurve& curve) {
  const char* advice = "percents p are the stretches 1 + p / 100, strains e are 1 + e";
  const auto [least, greatest] = std::ranges::minmax(curve.stretches);
  if (greatest > greatest_stretch)
    return context.toml.complain(key, "stretches up to " + text_of(greatest, ""), "lengths over the unloaded one",
                                 advice);
  double most = 0.0;
  for (const double s : curve.stresses) most = std::max(most, std::abs(s));
  int pressed = 0, pulled = 0;
  for (std::size_t i = 0; i < curve.stretches.size(); ++i) {
    if (curve.stretches[i] > 1.0 - about_rest || std::abs(curve.stresses[i]) < small_stress * most) continue;
    ++(curve.stresses[i] < 0.0 ? pressed : pulled);
  }
  if (pulled > pressed)
    context.toml.complain(key, "stresses that pull at stretches below 1, from " + text_of(least, "") + " on",
                          "negative stresses of a compressed specimen", advice);
}

void check_curve_files(RuleContext& context) {
  const Capture& capture = context.capture;
  for_each_sound(context, "indentation", capture.indentations, [&](const Indentation& test, const std::string& key) {
    try_file(context, key, [&] { (void)read_force_curve(test.curve); });
  });
  for_each_sound(context, "material_curve", capture.material_curves, [&](const auto& test, const std::string& key) {
    try_file(context, key, [&] {
      const StressCurve curve =
          read_stress_curve(test.curve, test.mode == TestMode::Biaxial, test.mode == TestMode::SimpleShear);
      if (std::ranges::all_of(curve.stresses, [](double s) { return s == 0.0; }))
        context.toml.complain(key + ".curve", "a curve whose stresses are all zero", "a measured stress",
                              "stresses are in pascals");
      const bool is_along_x = test.measure == StressMeasure::First && test.mode != TestMode::Biaxial;
      if (is_along_x && test.mode != TestMode::SimpleShear) check_stretches(context, key + ".curve", curve);
    });
  });
}

void check_grip_markers(RuleContext& context) {
  for_each_sound(context, "grip", context.capture.grips, [&](const Grip& grip, const std::string& key) {
    if (grip.markers && grip.markers_rest) check_marker_pair(context, key, *grip.markers_rest, *grip.markers);
  });
}

}  // namespace

std::span<const Rule> capture_rules() {
  static const std::vector<Rule> rules = [] {
    std::vector<Rule> all = fact_rules();
    all.insert(all.end(), {check_depth_files, check_silhouette_files, check_clouds, check_markers, check_press_markers,
                           check_force_signs, check_load_files, check_curve_files, check_grip_markers});
    std::ranges::copy(sight_rules(), std::back_inserter(all));
    return all;
  }();
  return rules;
}

}  // namespace pliant
