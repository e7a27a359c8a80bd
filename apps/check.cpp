#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <string>

#include "base/error.hpp"
#include "base/files.hpp"
#include "capture/capture.hpp"
#include "capture/capture_rules.hpp"
#include "capture/depth_frame.hpp"
#include "capture/depth_picture.hpp"
#include "capture/pixel_kinds.hpp"
#include "capture/point_cloud.hpp"
#include "capture/survey.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/solid_surface.hpp"
#include "plan.hpp"
#include "scan/calibrate.hpp"
#include "scan/scan_pose.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

struct Arguments {
  std::string capture, out, compare_masks, plan;
  int pictures = 3;
};

std::string vector_text(const Vector3& v) { return formatted("[%.4g, %.4g, %.4g]", v.x(), v.y(), v.z()); }

Json vector_json(const Vector3& v) { return Json::array({v.x(), v.y(), v.z()}); }

double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

void describe_object(const Capture& capture, Json& json) {
  if (!capture.scene.object.surface) {
    say("object", "no scan of it at rest");
    return;
  }
  const MeshReport mesh = examine(*capture.scene.object.surface);
  const Vector3 extent = mesh.box.extent();
  say("object", formatted("%.4g x %.4g x %.4g m, volume %.4g m^3", extent.x(), extent.y(), extent.z(), mesh.volume));
  if (const auto mass = capture.scene.object.total_mass())
    say("", formatted("mass %.4g kg, density %.4g kg/m^3 (%s given)", *mass, *mass / mesh.volume,
                      capture.scene.object.mass ? "mass" : "density"));
  else
    say("", "mass and density unknown");
  say("surface",
      formatted("%zu vertices, %zu triangles, closed, %d part%s, %d triangles without area, %d vertices unused",
                capture.scene.object.surface->vertices.size(), capture.scene.object.surface->triangles.size(),
                mesh.components, mesh.components == 1 ? "" : "s", mesh.degenerate_triangles, mesh.unused_vertices));
  if (!capture.scene.object.volume)
    for (const std::string& remark : mend(read_mesh(capture.scene.object.file)).remarks) say("", "note: " + remark);
  for (const std::string& complaint : mesh.complaints) say("", "note: " + complaint);
  json["object"] = {{"extent", vector_json(extent)}, {"volume", mesh.volume}, {"parts", mesh.components}};
  if (const auto mass = capture.scene.object.total_mass()) json["object"]["mass"] = *mass;
}

void describe_world(const Capture& capture) {
  say("gravity", capture.scene.world.gravity ? vector_text(*capture.scene.world.gravity) + " m/s^2"
                                             : "unknown; up is " + vector_text(capture.scene.world.up));
  if (!capture.scene.timing.times.empty())
    say("frames", formatted("%d in %.4g s, free from frame %d%s", capture.frame_count(),
                            capture.scene.timing.times.back() - capture.scene.timing.times.front(),
                            capture.scene.timing.start_frame,
                            capture.scene.timing.is_static ? ", all of one equilibrium (static)" : ""));
  if (const auto& inner = capture.scene.inner; !inner.empty())
    say("inside", formatted("%zu rigid bod%s", inner.size(), inner.size() == 1 ? "y" : "ies"));
  if (const auto& obstacles = capture.scene.obstacles; !obstacles.empty())
    say("obstacles", formatted("%zu beside planes, %zu of them moving", obstacles.size(),
                               obstacles.size() - std::size_t(std::ranges::count_if(
                                                      obstacles, [](const auto& o) { return o.motion.empty(); }))));
  if (const auto& led = capture.scene.led; !led.empty())
    say("led", formatted("%zu region%s", led.size(), led.size() == 1 ? "" : "s"));
  if (!capture.scene.fixed.empty())
    say("held", formatted("%zu region%s", capture.scene.fixed.size(), capture.scene.fixed.size() == 1 ? "" : "s"));
  if (!capture.scene.weights.empty()) {
    double mass = 0.0;
    for (const Weight& weight : capture.scene.weights) mass += weight.mass;
    say("masses", formatted("%.4g kg at %zu point%s", mass, capture.scene.weights.size(),
                            capture.scene.weights.size() == 1 ? "" : "s"));
  }
  if (const auto& weight = capture.scene.initial.release_of)
    say("start", formatted("released from equilibrium under a weight of %.4g kg", weight->mass));
  else if (capture.scene.initial.released)
    say("start", "released from a held, deformed pose");
}

void describe_sensors(const Capture& capture) {
  for_each_camera(capture, [&](const RecordingCamera& camera, const char* kind, std::size_t i) {
    const PinholeCamera& lens = camera.camera;
    const double fov = 2.0 * degrees(std::atan(0.5 * lens.width / lens.fx));
    const DepthCamera* depth = kind == std::string("depth") ? &capture.depth[i] : nullptr;
    say("camera", formatted("\"%s\" %d x %d, view of %.0f degrees%s, %s%s", camera.name.c_str(), lens.width,
                            lens.height, fov, lens.lens.bends() ? " through a lens that bends" : "",
                            !depth              ? "silhouettes alone"
                            : depth->masks      ? "masks"
                            : depth->background ? "background image"
                                                : "neither masks nor background",
                            camera.every > 1 ? formatted(", every %d frames", camera.every).c_str() : ""));
  });
  for_each_camera(capture, [](const RecordingCamera& camera, auto, auto) {
    if (camera.time_offset != 0.0)
      say("", formatted("\"%s\" takes its images %.2f ms after their frames", camera.name.c_str(),
                        1e3 * camera.time_offset));
    if (!camera.moved.empty()) say("", formatted("\"%s\" moves: a pose for each image", camera.name.c_str()));
  });
  for (const CloudSequence& cloud : capture.clouds) say("clouds", cloud.points.pattern);
  const auto is_test = [](const auto& item) { return item.role == "test"; };
  if (!capture.presses.empty())
    say("presses", formatted("%zu, of them %d for test only", capture.presses.size(),
                             int(std::ranges::count_if(capture.presses, is_test))));
  const auto say_tests = [&](const char* what, const auto& tests) {
    if (!tests.empty())
      say(what, formatted("%zu, of them %d for test only", tests.size(), int(std::ranges::count_if(tests, is_test))));
  };
  say_tests("indentations", capture.indentations);
  say_tests("grips", capture.grips);
  say_tests("stress-strain curves", capture.material_curves);
  if (!capture.loads.empty())
    say("loads", formatted("%zu, of them %d for test only", capture.loads.size(),
                           int(std::ranges::count_if(capture.loads, is_test))));
}

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t most_shown = 10;
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), most_shown); ++i)
    text += (i == 0 ? "\"" : ", \"") + names[i] + "\"";
  return names.size() > most_shown ? text + formatted(" and %zu more", names.size() - most_shown) : text;
}

void describe_markers(const Capture& capture, const Survey& seen, Json& json) {
  for (std::size_t i = 0; i < seen.markers.size(); ++i) {
    const MarkerSurvey& markers = seen.markers[i];
    const std::string file = capture.markers[i].track.filename().string();
    const int frames_seen = markers.frames - int(markers.empty_frames.size());
    say("markers", formatted("%d of \"%s\", seen in %d of %d frames, %.3g %% of positions missing", markers.markers,
                             file.c_str(), frames_seen, markers.frames, 100.0 * markers.missing));
    say("", formatted("they move by up to %.3g m", markers.travel) +
                (markers.noise ? formatted("; noise about %.2g mm a coordinate", 1e3 * *markers.noise) : ""));
    if (!markers.empty_frames.empty()) say("", "note: no marker in frames " + ranges_text(markers.empty_frames));
    if (!markers.never_seen.empty()) say("", "note: never seen: " + listed(markers.never_seen));
    for (const std::string& doubt : markers.doubts) say("", "note: " + doubt);
    if (!markers.left_out.empty()) say("", "left out, not among those at rest: " + listed(markers.left_out));
    json["markers"].push_back({{"file", file},
                               {"markers", markers.markers},
                               {"frames", frames_seen},
                               {"missing", markers.missing},
                               {"travel", markers.travel}});
    if (markers.noise) json["markers"].back()["noise"] = *markers.noise;
    if (markers.frame_rate) json["markers"].back()["frame_rate"] = *markers.frame_rate;
  }
  if (!seen.loaded_markers) return;
  const MarkerSurvey& loaded = *seen.loaded_markers;
  say("markers", formatted("%d under %d presses and loads, %.3g %% of positions missing, moved by up to %.3g m",
                           loaded.markers, loaded.frames, 100.0 * loaded.missing, loaded.travel));
  for (const std::string& doubt : loaded.doubts) say("", "note: " + doubt);
  json["loaded_markers"] = {{"markers", loaded.markers},
                            {"measurements", loaded.frames},
                            {"missing", loaded.missing},
                            {"travel", loaded.travel}};
}

void describe_outlines(const Capture& capture, const Survey& seen, Json& json) {
  for (std::size_t i = 0; i < seen.outlines.size(); ++i) {
    const OutlineSurvey& own = seen.outlines[i];
    const std::string& name = capture.silhouettes[i].name;
    say("outlines", formatted("%d to %d points a frame of \"%s\"; noise %.2g mm at the object, moving across the view "
                              "by up to %.3g m",
                              own.points.least, own.points.greatest, name.c_str(), 1e3 * own.noise, own.travel));
    if (!own.points.empty_frames.empty()) say("", "note: no outline in frames " + ranges_text(own.points.empty_frames));
    if (!own.cut_frames.empty())
      say("", "note: the object reaches the picture's border in frames " + ranges_text(own.cut_frames) +
                  "; only what lies inside counts");
    json["outlines"].push_back({{"camera", name},
                                {"least", own.points.least},
                                {"median", own.points.median},
                                {"greatest", own.points.greatest},
                                {"noise", own.noise},
                                {"travel", own.travel},
                                {"empty_frames", own.points.empty_frames},
                                {"cut_frames", own.cut_frames}});
  }
  if (!seen.outlines.empty() && capture.depth.empty() && capture.clouds.empty() && seen.first_contact)
    say("", formatted("first contact with a plane about frame %d", *seen.first_contact));
}

void describe_cleaning(const std::vector<ObservedFrame>& frames, Json& json) {
  CloudCounts all;
  for (const ObservedFrame& frame : frames) {
    all.read += frame.cloud.read, all.out_of_reach += frame.cloud.out_of_reach, all.on_plane += frame.cloud.on_plane;
    all.background += frame.cloud.background, all.isolated += frame.cloud.isolated;
  }
  if (all.read == 0) return;
  const auto percent = [&](int count) { return 100.0 * count / all.read; };
  say("", formatted("left out of the clouds: %.1f %% far away, %.1f %% on planes, %.1f %% background, %.1f %% alone",
                    percent(all.out_of_reach), percent(all.on_plane), percent(all.background), percent(all.isolated)));
  json["clouds_left_out"] = {{"read", all.read},
                             {"out_of_reach", all.out_of_reach},
                             {"on_plane", all.on_plane},
                             {"background", all.background},
                             {"isolated", all.isolated}};
}

/// Whether the first frames show the scanned object where its scan stands, as far as that can be told.
bool shows_the_scan(const Survey& seen) {
  constexpr double least = 0.05;  // of the surface; one camera sees a quarter to a half
  return !seen.seen_share || *seen.seen_share >= least;
}

void describe_observations(const Capture& capture, const Survey& seen, Json& json) {
  if (!capture.scene.object.surface || seen.points.greatest == 0) return;
  const std::string count = seen.points.least == seen.points.greatest
                                ? std::to_string(seen.points.least)
                                : formatted("%d to %d a frame", seen.points.least, seen.points.greatest);
  say("points", count + formatted(" on the object; noise %.2g mm", 1e3 * seen.median_noise));
  if (!seen.points.empty_frames.empty())
    say("", "note: no point on the object in frames " + ranges_text(seen.points.empty_frames));
  for (std::size_t i = 0; i < seen.repeated_images.size(); ++i)
    if (const std::vector<int>& frames = seen.repeated_images[i]; !frames.empty() && !capture.scene.timing.is_static)
      say("", "note: \"" + capture.depth[i].name +
                  "\" shows the same as the frame before, to the last bit, in frames " + ranges_text(frames) +
                  ": an image that was delivered twice has a wrong time");
  if (seen.seen_share) say("", formatted("%.0f %% of the surface is seen at the start", 100.0 * *seen.seen_share));
  if (!shows_the_scan(seen))
    say("",
        "note: the scan is not where the object is seen at the start: it is of another object, in another unit or "
        "place (`pliant place` finds both), or the camera stands elsewhere (`camera_to_world`, `depth_scale`)");
  if (!capture.scene.timing.is_static)
    say("motion",
        (seen.moves ? formatted("the seen points move by up to %.3g m", seen.travel) : std::string("none seen")) +
            (seen.first_contact ? formatted(", first contact with a plane about frame %d", *seen.first_contact) : ""));
  json["points"] = {{"least", seen.points.least}, {"median", seen.points.median}, {"greatest", seen.points.greatest}};
  json["noise"] = seen.median_noise;
  json["travel"] = seen.travel;
  json["moves"] = seen.moves;
  if (seen.seen_share) json["seen_share"] = *seen.seen_share;
  if (seen.first_contact) json["first_contact"] = *seen.first_contact;
}

/// How the object flies, against the gravity and the velocity that are stated: it tells of a wrong direction, clock or
/// unit before a fit.
void describe_flight(const Capture& capture, const std::vector<ObservedFrame>& frames, Json& json) {
  // Of gravity: damping by the air takes a tenth, and turns it where the object was thrown.
  constexpr double least = 0.75, greatest = 1.1, across = 0.15, held = 0.05;
  constexpr double fast = 0.1, certain = 5.0;  // [m/s] of velocities; standard deviations
  std::optional<Flight> flight;
  try {
    flight = free_flight(capture, frames);
  } catch (const InputError&) {  // too thin for a grid of distances
  }
  if (!flight) return;
  const Vector3& flown = flight->acceleration;
  say("flight", formatted("%d frames, from %s m/s (+- %.2g) accelerated by %s m/s^2 (+- %.2g)", flight->frames,
                          vector_text(flight->velocity).c_str(), flight->velocity_std, vector_text(flown).c_str(),
                          flight->acceleration_std));
  json["flight"] = {{"frames", flight->frames},
                    {"velocity", vector_json(flight->velocity)},
                    {"velocity_std", flight->velocity_std},
                    {"acceleration", vector_json(flown)},
                    {"acceleration_std", flight->acceleration_std}};
  const World& world = capture.scene.world;
  const Vector3 down = world.gravity ? Vector3(world.gravity->normalized()) : Vector3(-world.up);
  const double strength = world.gravity ? world.gravity->norm() : flown.norm(),
               doubt = certain * flight->acceleration_std;
  const double along = flown.dot(down);
  if (flown.norm() < held * strength)
    say("",
        "note: it does not fall freely: it is let go after `start_frame`, or what holds it is not stated ([[fixed]], "
        "[[plane]])");
  else if (strength > 0.0 &&
           (along < 0.0 || (flown - along * down).norm() > across * std::max(along, strength) + doubt))
    say("",
        formatted("note: %.0f degrees from the direction of gravity that is stated: `%s` of [world], or where the "
                  "sensor stands, is wrong",
                  degrees(std::acos(std::clamp(along / flown.norm(), -1.0, 1.0))), world.gravity ? "gravity" : "up"));
  else if (strength > 0.0 && (along < least * strength - doubt || along > greatest * strength + doubt))
    say("",
        formatted("note: %.2g times the gravity that is stated: frames %.2g times as far apart in time would agree, "
                  "or readings %.2g times as long",
                  along / strength, std::sqrt(along / strength), strength / along));
  const Initial& initial = capture.scene.initial;
  if (initial.known && (flight->velocity - initial.linear_velocity).norm() > fast + certain * flight->velocity_std)
    say("", "note: `linear_velocity` of [initial] is stated as " + vector_text(initial.linear_velocity) +
                " and `known`; `known = false` has it estimated");
}

void describe_planes(const Capture& capture, const Survey& seen, Json& json) {
  for (std::size_t i = 0; i < capture.scene.planes.size(); ++i) {
    const PlaneSurvey& plane = seen.planes[i];
    const Vector3 up = capture.scene.world.up;
    const std::string known = capture.scene.planes[i].known ? "known" : "roughly known";
    const std::string from_up =
        capture.scene.planes.size() > 1 || capture.scene.is_held() || up.dot(capture.scene.planes[i].normal) > 0.2
            ? ""
            : formatted(
                  "note: its normal is %.0f degrees from up: nothing falls on it; are gravity "
                  "and plane in the same axes (y up, z up)?",
                  degrees(std::acos(std::clamp(up.dot(capture.scene.planes[i].normal), -1.0, 1.0))));
    if (!plane.seen) {
      say("plane", known + ", not seen by any camera");
      if (!from_up.empty()) say("", from_up);
      continue;
    }
    say("plane", known + formatted(", seen with %.2f mm rms, %.2f degrees and %.1f mm from what is declared",
                                   1e3 * plane.seen->rms, degrees(plane.angle), 1e3 * plane.distance));
    if (!from_up.empty()) say("", from_up);
    json["planes"].push_back({{"rms", plane.seen->rms},
                              {"point", vector_json(plane.seen->point)},
                              {"normal", vector_json(plane.seen->normal)},
                              {"angle_to_declared_deg", degrees(plane.angle)},
                              {"distance_to_declared", plane.distance}});
  }
}

/// Where the object at rest asks each depth camera to stand, where the capture shows it as it was scanned.
void describe_poses(const Capture& capture, Json& json) {
  constexpr double doubtful = 3.0;
  if (capture.depth.empty() || capture.scene.timing.is_static) return;
  std::vector<SensorCalibration> found;
  try {
    CalibrationOptions options;
    options.finds_lenses = false;
    found = calibrate_by_object(capture, options);
  } catch (const InputError&) {  // no frame shows it so, or its shape leaves a pose open
    return;
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    const SensorCalibration& s = found[i];
    const PoseStd& stated = capture.depth[i].pose_std;
    say("pose", formatted("the object at rest asks \"%s\" to turn by %.2f degrees (+- %.2f) and to shift by %.1f mm "
                          "(+- %.1f)",
                          s.name.c_str(), degrees(s.turned), degrees(s.turn_std), 1e3 * s.moved, 1e3 * s.shift_std));
    if (s.turned > doubtful * std::hypot(stated.turn, s.turn_std) ||
        s.moved > doubtful * std::hypot(stated.shift, s.shift_std))
      say("", formatted("note: more than three times its pose_std of %.2f degrees and %.1f mm; where it, or the scan, "
                        "stands is wrong, or pose_std too small",
                        degrees(stated.turn), 1e3 * stated.shift));
    json["poses"].push_back({{"camera", s.name},
                             {"turned", s.turned},
                             {"turn_std", s.turn_std},
                             {"shifted", s.moved},
                             {"shift_std", s.shift_std},
                             {"pose_std", {{"turn", stated.turn}, {"shift", stated.shift}}}});
  }
}

void describe_scene(const Segmentation& scene, const std::string& camera, Json& json) {
  Json own = {{"camera", camera}};
  for (const PlaneFit& plane : scene.planes) {
    say("scene", formatted("a plane of %d pixels, %.2f mm rms", plane.inliers, 1e3 * plane.rms));
    own["planes"].push_back({{"pixels", plane.inliers},
                             {"rms", plane.rms},
                             {"point", vector_json(plane.point)},
                             {"normal", vector_json(plane.normal)}});
  }
  constexpr std::size_t most_shown = 6;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const SceneObject& object = scene.objects[i];
    if (i == most_shown) say("", formatted("and %zu smaller ones", scene.objects.size() - i));
    if (i < most_shown)
      say("", formatted(
                  "an object of %d pixels, %.3g x %.3g x %.3g m seen%s", object.pixels, object.extent.x(),
                  object.extent.y(), object.extent.z(),
                  object.stands_on_plane ? formatted(", %.3g m high on the first plane", object.height).c_str() : ""));
    own["objects"].push_back({{"pixels", object.pixels},
                              {"extent", vector_json(object.extent)},
                              {"centroid", vector_json(object.centroid)},
                              {"stands_on_plane", object.stands_on_plane},
                              {"height", object.height}});
  }
  json["scenes"].push_back(own);
}

void describe_cloud(const CloudScene& scene, Json& json) {
  const Vector3 extent = scene.box.extent();
  say("cloud", formatted("%d points, %.3g x %.3g x %.3g m", scene.points, extent.x(), extent.y(), extent.z()));
  Json own = {{"points", scene.points}, {"extent", vector_json(extent)}};
  if (scene.plane) {
    const double share = double(scene.plane->inliers) / scene.points;
    say("", formatted("%.0f %% of them on a plane, %.2f mm rms", 100.0 * share, 1e3 * scene.plane->rms));
    own["plane"] = {{"share", share}, {"rms", scene.plane->rms}};
  }
  json["clouds"].push_back(own);
}

void describe_identifiability(const Identifiability& identifiability, Json& json) {
  std::cout << '\n';
  for (const std::string& text : identifiability.possible) std::cout << "+ " << text << '\n';
  for (const std::string& text : identifiability.impossible) std::cout << "- " << text << '\n';
  json["possible"] = identifiability.possible;
  json["impossible"] = identifiability.impossible;
}

// A few frames spread over the recording, among those of the camera; the start is one of them.
std::vector<int> chosen_frames(const Capture& capture, const DepthCamera& camera, int wanted) {
  const std::vector<int> all = frames_of(capture.frame_count(), camera.every);
  std::vector<int> chosen;
  const int count = std::min(wanted, int(all.size()));
  for (int i = 0; i < count; ++i)
    chosen.push_back(all[std::size_t(count == 1 ? 0 : std::size_t(i) * (all.size() - 1) / std::size_t(count - 1))]);
  return chosen;
}

std::string frame_name(const std::string& camera, int frame) { return camera + formatted("_%06d", frame); }

void write_sorted_pictures(const Capture& capture, const Arguments& arguments) {
  for (const DepthCamera& camera : capture.depth) {
    const PixelSorter sorter(capture, camera, {});
    for (const int frame : chosen_frames(capture, camera, arguments.pictures)) {
      const DepthImage depth = read_depth(capture, camera, frame);
      const PinholeCamera lens = camera.at(frame);
      const auto kinds = sorter.sort(depth, read_object_mask(capture, camera, frame), &lens,
                                     capture.scene.timing.times[std::size_t(frame)] + camera.time_offset);
      write_png(fs::path(arguments.out) / (frame_name(camera.name, frame) + ".png"), picture(depth, kinds));
    }
  }
}

void write_cloud_picture(const std::vector<ObservedFrame>& frames, const Arguments& arguments) {
  const auto seen = std::ranges::find_if(frames, [](const ObservedFrame& frame) { return !frame.points.empty(); });
  if (seen == frames.end()) return;
  write_png(fs::path(arguments.out) / formatted("points_%06d.png", seen->frame), picture(seen->points));
}

void write_clouds(const std::vector<ObservedFrame>& frames, const Arguments& arguments) {
  for (const ObservedFrame& frame : frames)
    write_points(fs::path(arguments.out) / "points" / formatted("%06d.ply", frame.frame), frame.points);
}

void write_scene(const DepthCamera& camera, int frame, const DepthImage& depth, const Segmentation& scene,
                 const Arguments& arguments) {
  const fs::path out = arguments.out;
  const std::string name = frame_name(camera.name, frame);
  write_png(out / (name + ".png"), picture(depth, scene));
  for (int i = 0; i < int(scene.objects.size()); ++i) {
    std::vector<Vector3> points;
    for (int v = 0; v < depth.height; ++v)
      for (int u = 0; u < depth.width; ++u)
        if (scene.label(u, v) == i) points.push_back(camera.camera.unproject(u, v, depth(u, v)));
    write_points(out / (name + formatted("_object%d.ply", i + 1)), points);
  }
}

struct Overlap {
  int both = 0, either = 0;
  double ratio() const { return either > 0 ? double(both) / either : 0.0; }
};

// The object that agrees best with a reference mask, over the pixels with a reading.
std::pair<int, Overlap> best_overlap(const DepthImage& depth, const Segmentation& scene,
                                     const Image<std::uint8_t>& mask) {
  std::pair<int, Overlap> best{-1, {}};
  for (int i = 0; i < int(scene.objects.size()); ++i) {
    Overlap overlap;
    for (std::size_t p = 0; p < depth.pixels.size(); ++p) {
      const bool own = scene.label.pixels[p] == i, reference = mask.pixels[p] != 0 && depth.pixels[p] > 0;
      overlap.both += own && reference;
      overlap.either += own || reference;
    }
    if (best.first < 0 || overlap.ratio() > best.second.ratio()) best = {i, overlap};
  }
  return best;
}

void compare_with_masks(const Capture& capture, const Arguments& arguments, Json& json) {
  const FramePattern pattern{arguments.compare_masks};
  if (!pattern.is_valid())
    throw InputError(Problem{
        {arguments.compare_masks}, "the pattern of --compare-masks", "one %06d where the frame's number stands", ""});
  for (const DepthCamera& camera : capture.depth)
    for (const int frame : chosen_frames(capture, camera, arguments.pictures)) {
      stop_if_interrupted();
      const DepthImage depth = read_depth(capture, camera, frame);
      const Segmentation scene = segment(depth, camera.at(frame), DepthNoise(camera, 1.0));
      const auto mask = read_mask(capture.folder / pattern(frame));
      if (mask.width != depth.width || mask.height != depth.height)
        throw InputError(Problem{
            {capture.folder / pattern(frame)}, "a mask of another size than the depth image", "the same size", ""});
      const auto [object, overlap] = best_overlap(depth, scene, mask);
      say("mask", formatted("frame %d: object %d, intersection over union %.3f", frame, object + 1, overlap.ratio()));
      json["mask_overlap"].push_back(
          {{"camera", camera.name}, {"frame", frame}, {"object", object + 1}, {"iou", overlap.ratio()}});
    }
}

void write_scenes(const Capture& capture, const Arguments& arguments) {
  for (const DepthCamera& camera : capture.depth)
    for (const int frame : chosen_frames(capture, camera, arguments.pictures)) {
      const DepthImage depth = read_depth(capture, camera, frame);
      write_scene(camera, frame, depth, segment(depth, camera.at(frame), DepthNoise(camera, 1.0)), arguments);
    }
}

void check(const Arguments& arguments) {
  Capture capture = read_capture(arguments.capture);
  const auto frames = observe_placed(capture, {}, [](int done, int total) {
    stop_if_interrupted();
    show_progress("reading frames", done, total);
  });
  const Survey seen = survey(capture, frames);
  Json json = {{"capture", capture.name}, {"sha256", capture.sha256}, {"frames", capture.frame_count()}};
  std::cout << capture.name << '\n';
  describe_object(capture, json);
  describe_world(capture);
  describe_sensors(capture);
  describe_markers(capture, seen, json);
  describe_observations(capture, seen, json);
  describe_outlines(capture, seen, json);
  if (shows_the_scan(seen)) describe_flight(capture, frames, json);
  describe_cleaning(frames, json);
  describe_planes(capture, seen, json);
  describe_poses(capture, json);
  for (std::size_t i = 0; i < seen.scenes.size(); ++i) describe_scene(seen.scenes[i], capture.depth[i].name, json);
  for (const CloudScene& scene : seen.clouds) describe_cloud(scene, json);
  if (!arguments.compare_masks.empty()) compare_with_masks(capture, arguments, json);
  describe_identifiability(identifiability(capture, seen), json);
  if (arguments.out.empty()) return;
  if (capture.scene.object.surface)
    write_sorted_pictures(capture, arguments);
  else
    write_scenes(capture, arguments);
  if ((capture.scene.object.surface || capture.depth.empty()) && seen.points.greatest > 0)
    write_clouds(frames, arguments);
  if (!capture.clouds.empty()) write_cloud_picture(frames, arguments);
  write_file(fs::path(arguments.out) / "check.json", json.dump(2) + "\n");
}

constexpr const char* footer = R"(Examples:
  pliant check recordings/bear
  pliant check recordings/bear --out look --pictures 8
  pliant check --plan scene.toml          (before anything is recorded: docs/recording.md)

Without --out nothing is written. With it, the folder gets check.json (the figures), a picture of a few frames of each
depth camera (the object from yellow to violet by depth; planes blue; pixels removed at edges red; the rest grey), and
the points on the object as PLY files. A capture without a scan of the object at rest is split into planes and objects.)";

}  // namespace

void add_check(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("check", "Validate a capture and say what can be estimated from it");
  command.option("capture", arguments->capture, "the capture's folder, or its capture.toml");
  command
      .option("--plan", arguments->plan,
              "instead of a capture, a scene (docs/scene.md) of a recording that is not made yet: say what a fit of it "
              "would tell, with 90 % intervals")
      .type_name("SCENE.toml");
  command.option("--out", arguments->out, "folder for pictures, point clouds and figures");
  command.option("--pictures", arguments->pictures, "frames of each camera to picture").show_default().range(1, 100000);
  command.option("--compare-masks", arguments->compare_masks,
                 "pattern of reference masks, relative to the capture: report how well found objects agree with them");
  command.footer(footer);
  command.callback([arguments, &exit_code] {
    if (arguments->capture.empty() == arguments->plan.empty())
      throw InputError(
          {{}, "check was given neither or both of a capture and --plan", "one of them", "pliant check --help"});
    if (!arguments->plan.empty())
      plan(arguments->plan, arguments->out);
    else
      check(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
