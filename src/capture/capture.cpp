#include "capture/capture.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>

namespace pliant {

namespace {

// Begin and end of the one "%06d" in a pattern; nothing where there is none, or something else after a percent sign.
std::optional<std::pair<std::size_t, std::size_t>> number_field(const std::string& pattern) {
  const std::size_t begin = pattern.find('%');
  if (begin == std::string::npos) return std::nullopt;
  std::size_t end = begin + 1;
  while (end < pattern.size() && std::isdigit(static_cast<unsigned char>(pattern[end]))) ++end;
  const bool is_wide = end - begin > 3;
  if (end >= pattern.size() || pattern[end] != 'd' || is_wide || pattern.find('%', end) != std::string::npos)
    return std::nullopt;
  return std::pair{begin, end + 1};
}

}  // namespace

const std::vector<std::string>& test_mode_names() {
  static const std::vector<std::string> names = {"uniaxial", "pure_shear",   "equibiaxial",
                                                 "biaxial",  "simple_shear", "confined"};
  return names;
}

const std::vector<std::string>& stress_measure_names() {
  static const std::vector<std::string> names = {"first", "second", "cauchy_difference"};
  return names;
}

bool has_silhouettes_alone(const Capture& capture) {
  return !capture.silhouettes.empty() && capture.depth.empty() && capture.clouds.empty() && capture.markers.empty();
}

bool has_time_offsets(const Capture& capture) {
  bool has = false;
  for_each_camera(capture, [&](const RecordingCamera& camera, auto, auto) { has |= camera.time_offset != 0.0; });
  return has && !capture.scene.timing.is_static;
}

bool has_moving_cameras(const Capture& capture) {
  bool has = false;
  for_each_camera(capture, [&](const RecordingCamera& camera, auto, auto) { has |= !camera.moved.empty(); });
  return has;
}

void require_standing_cameras(const Capture& capture, const std::string& what) {
  for (const DepthCamera& camera : capture.depth)
    if (!camera.moved.empty())
      throw InputError(Problem{{capture.file},
                               "camera \"" + camera.name + "\" moves while it records",
                               "a stationary camera, for " + what,
                               "put the sensor on a tripod; fits take cameras that move"});
}

Capture as_seen_from(Capture capture, const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const fs::path there = (fs::absolute(folder) / "").lexically_normal().parent_path();
  const auto lead = [&](FramePattern& pattern) {
    pattern.pattern = (capture.folder / pattern.pattern).lexically_normal().lexically_relative(there).generic_string();
  };
  for (DepthCamera& camera : capture.depth) {
    lead(camera.images);
    if (camera.masks) lead(*camera.masks);
  }
  for (SilhouetteCamera& camera : capture.silhouettes) lead(camera.masks);
  for (CloudSequence& cloud : capture.clouds) lead(cloud.points);
  capture.folder = there, capture.file = there / "capture.toml";
  return capture;
}

bool FramePattern::is_valid() const { return number_field(pattern).has_value(); }

std::filesystem::path FramePattern::operator()(int frame) const {
  const auto field = number_field(pattern);
  if (!field) return pattern;
  const std::string format = pattern.substr(field->first + 1, field->second - field->first - 2);
  const bool zeros = format.starts_with('0');
  const std::size_t width = format.empty() ? 0 : std::stoul(format);
  std::string number = std::to_string(frame);
  if (number.size() < width) number.insert(0, width - number.size(), zeros ? '0' : ' ');
  return pattern.substr(0, field->first) + number + pattern.substr(field->second);
}

}  // namespace pliant
