#include "capture/new_capture.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "base/files.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_noise.hpp"
#include "capture/frame_numbers.hpp"
#include "capture/point_cloud.hpp"
#include "capture/segment.hpp"
#include "geometry/solid_surface.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

constexpr double gravity = 9.81;  // [m/s^2]

std::string number_name(const NumberedFiles& files, int number) {
  return FramePattern{files.pattern}(number).generic_string();
}

/// What is being put together.
struct Draft {
  const fs::path& folder;
  const FolderSurvey& survey;
  const NewCaptureFacts& facts;
  NewCapture made = {};

  template <class Value>
  Value ask(const std::optional<Value>& said, const char* option, const char* question, Value otherwise) {
    if (!said) made.missing.push_back({option, question});
    return said.value_or(otherwise);
  }
  void say(std::string sentence) { made.seen.push_back(std::move(sentence)); }
};

void refuse_painted_depth(const fs::path& folder, const FolderSurvey& survey) {
  for (const NumberedFiles& files : survey.pictures)
    if (files.pattern.find("depth") != std::string::npos)
      throw InputError({{folder / number_name(files, files.first())},
                        fmt::format("colourised depth: an image of {} bits and {} channels", files.header.bits,
                                    files.header.channels),
                        "16-bit grey images of depth",
                        "export the sensor's depth as it is, not as it is shown: colours hold no metres"});
}

/// The floor that a camera sees: the largest plane whose normal is within 60 degrees of the camera's upward axis.
std::optional<PlaneFit> floor_of(const DepthCamera& camera, const fs::path& image) {
  const DepthImage depth = read_depth(camera, image);
  const Segmentation scene = segment(depth, camera.camera, DepthNoise(camera, 1.0));
  for (const PlaneFit& plane : scene.planes)
    if (-plane.normal.y() > 0.5) return plane;
  return std::nullopt;
}

void take_camera(Draft& draft) {
  const NumberedFiles& files = draft.survey.depth.front();
  const NewCaptureFacts& facts = draft.facts;
  DepthCamera camera;
  camera.name = "camera";
  camera.camera.width = files.header.width, camera.camera.height = files.header.height;
  std::optional<double> fx = facts.fx;
  if (!fx && facts.field_of_view_deg) fx = focal_length(*facts.field_of_view_deg, files.header.width);
  camera.camera.fx = draft.ask(fx, "--fx PIXELS (or --fov DEGREES)", "the camera's focal length in pixels", 1.0);
  camera.camera.fy = facts.fy.value_or(camera.camera.fx);
  camera.camera.cx = facts.cx.value_or(0.5 * (files.header.width - 1));
  camera.camera.cy = facts.cy.value_or(0.5 * (files.header.height - 1));
  camera.depth_scale = draft.ask(facts.depth_scale, "--depth-scale UNITS",
                                 "how many raw units of a depth image are one metre (1000: millimetres)", 1000.0);
  camera.images.pattern = files.pattern;
  draft.say(fmt::format("depth: {} images {} of {} x {} pixels", files.count(), files.pattern, files.header.width,
                        files.header.height));
  if (draft.survey.depth.size() > 1)
    draft.say(fmt::format("{} further sets of depth images are left out: give each a [[depth]] of its own",
                          draft.survey.depth.size() - 1));
  for (const NumberedFiles& pictures : draft.survey.pictures)
    if (pictures.pattern.find("mask") != std::string::npos && pictures.count() == files.count() &&
        pictures.first() == files.first() && pictures.header.width == files.header.width) {
      camera.masks = FramePattern{pictures.pattern};
      draft.say("masks: " + pictures.pattern);
    }
  for (const fs::path& name : {fs::path("background.png"), fs::path(files.pattern).parent_path() / "background.png"})
    if (!camera.background && is_file(draft.folder / name)) {
      camera.background = fs::absolute(draft.folder / name).lexically_normal();
      draft.say("background: " + name.generic_string());
    }
  draft.made.capture.depth.push_back(camera);
}

/// Where up is, the floor, and where the camera stands.
void take_world(Draft& draft) {
  Capture& capture = draft.made.capture;
  Vector3 up = draft.facts.up.value_or(Vector3(0.0, capture.depth.empty() ? 1.0 : -1.0, 0.0));
  if (!capture.depth.empty() && draft.made.missing.empty()) {
    DepthCamera& camera = capture.depth.front();
    const NumberedFiles& files = draft.survey.depth.front();
    const auto floor = floor_of(camera, draft.folder / number_name(files, files.first()));
    if (floor && !draft.facts.up) up = floor->normal;
    if (floor) {
      draft.say(fmt::format("floor: a plane {:.2f} m from the camera, which looks down by {:.0f} degrees",
                            std::abs(floor->height(Vector3::Zero())),
                            std::asin(std::clamp(-up.z(), -1.0, 1.0)) * 180.0 / std::numbers::pi));
      capture.scene.planes.push_back({floor->point, floor->normal, false, 0.0, false});
    } else if (!draft.facts.up) {
      draft.say("no floor is seen: the camera is taken to stand level (say otherwise by --up)");
    }
    if (!capture.scene.object.surface) {  // the world is ours to choose: up is y, the floor at zero
      RigidMotion to_world;
      to_world.rotation = Eigen::Quaterniond::FromTwoVectors(up, Vector3::UnitY()).toRotationMatrix();
      if (floor) to_world.translation = Vector3::UnitY() * floor->height(Vector3::Zero());
      camera.camera.camera_to_world = to_world;
      for (Plane& plane : capture.scene.planes) {
        plane.point = Vector3::Zero();
        plane.normal = draft.facts.up ? Vector3(to_world.rotation * plane.normal) : Vector3(0.0, 1.0, 0.0);
      }
      up = Vector3::UnitY();
    }
  }
  capture.scene.world.up = up.normalized();
  capture.scene.world.gravity = Vector3::Zero() - gravity * up.normalized();  // no negative zeros
}

void take_surface(Draft& draft) {
  Object& object = draft.made.capture.scene.object;
  std::optional<fs::path> surface = draft.facts.surface;
  if (!surface && draft.survey.surfaces.size() == 1) surface = draft.survey.surfaces.front();
  if (!surface && draft.survey.surfaces.size() > 1) {
    std::string names;
    for (const fs::path& path : draft.survey.surfaces) names += (names.empty() ? "" : ", ") + path.generic_string();
    draft.made.missing.push_back({"--surface FILE", "which mesh is the object at rest (" + names + ")"});
  }
  if (!surface) {
    for (const fs::path& path : draft.survey.open_surfaces)
      draft.say(path.generic_string() + " is no closed surface, and is left out");
    if (draft.survey.surfaces.empty())
      draft.say("no closed surface of the object at rest: `pliant scan` makes one of frames in which it rests");
    return;
  }
  object.file = fs::absolute(draft.folder / *surface).lexically_normal();
  object.surface = read_surface(object.file);
  draft.say("surface: " + surface->generic_string());
  const Capture& capture = draft.made.capture;
  const bool finds_pose = !capture.depth.empty() && (capture.depth[0].masks || capture.depth[0].background);
  object.pose_is_known = !finds_pose;
  if (finds_pose)
    draft.say("the surface's pose is found in the start frame");
  else
    draft.say("the surface must stand where the object is in the start frame, in the axes of " +
              std::string(capture.depth.empty() ? "the clouds" : "the camera (x right, y down, z forward, metres)"));
}

}  // namespace

double focal_length(double field_of_view_deg, int width) {
  return 0.5 * width / std::tan(field_of_view_deg * std::numbers::pi / 360.0);
}

NewCapture new_capture(const fs::path& folder, const FolderSurvey& survey, const NewCaptureFacts& facts) {
  Draft draft{folder, survey, facts};
  if (survey.depth.empty() && survey.clouds.empty()) {
    refuse_painted_depth(folder, survey);
    throw InputError({{folder},
                      "neither depth images nor clouds lie there",
                      "16-bit grey PNG or PGM files with numbers in their names, or PLY or PCD files",
                      "`pliant import` reads what sensors and phones record; docs/recording.md says how to record"});
  }
  Capture& capture = draft.made.capture;
  capture.folder = fs::absolute(folder).lexically_normal();
  capture.file = capture.folder / "capture.toml";
  const fs::path own_name = (capture.folder / "").parent_path().filename();
  capture.name = facts.name.empty() ? own_name.string() : facts.name;
  if (!survey.depth.empty()) take_camera(draft);
  if (survey.depth.empty()) {
    const NumberedFiles& files = survey.clouds.front();
    capture.clouds.push_back({FramePattern{files.pattern}, 1, {}, {}});
    draft.say(fmt::format("clouds: {} files {}", files.count(), files.pattern));
  }
  const NumberedFiles& files = survey.depth.empty() ? survey.clouds.front() : survey.depth.front();
  if (!files.count_from_zero())
    draft.say(fmt::format("files are numbered from {}: they are copied, numbered from 0", files.first()));
  const double rate = draft.ask(facts.frame_rate, "--rate HZ", "frames a second", 30.0);
  capture.scene.timing = evenly_timed(rate, files.count(), facts.start_frame.value_or(0));
  if (const std::vector<int> periods = periods_of(files.numbers); periods.empty()) {
    draft.say("the numbers of the files do not grow evenly: they are taken to be evenly spaced in time");
  } else if (periods.back() + 1 > files.count()) {
    draft.say(note_of_gaps(periods, "the numbers of the files"));
    capture.scene.timing.frame_rate = 0.0;
    for (std::size_t i = 0; i < periods.size(); ++i) capture.scene.timing.times[i] = periods[i] / rate;
  }
  capture.scene.object.mass = facts.mass;
  capture.scene.object.density = facts.density;
  if (!facts.mass && !facts.density)
    draft.made.missing.push_back({"--mass KG (or --density KG/M3)", "the object's mass in kg"});
  take_surface(draft);
  take_world(draft);
  if (!facts.start_frame)
    draft.say("the object is taken to move freely from the first frame on (--start-frame says otherwise)");
  return draft.made;
}

std::string renumbered(const fs::path& folder, const NumberedFiles& files, const std::string& to) {
  if (files.count_from_zero()) return files.pattern;
  make_folder(folder / to);
  const std::string extension = fs::path(files.pattern).extension().string();
  const FramePattern pattern{to + "/%06d" + extension};
  for (int at = 0; at < files.count(); ++at) {
    const fs::path source = folder / number_name(files, int(files.numbers[std::size_t(at)]));
    std::error_code error;
    fs::copy_file(source, folder / pattern(at), fs::copy_options::overwrite_existing, error);
    if (error) throw InputError({{source}, "it cannot be copied: " + error.message(), "", "make room in " + to});
  }
  return pattern.pattern;
}

}  // namespace pliant
