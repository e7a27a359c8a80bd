#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "base/files.hpp"
#include "capture/capture_rules.hpp"
#include "capture/point_cloud.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "geometry/mesh_io.hpp"
#include "rays/ray_scene.hpp"
#include "report/picture.hpp"
#include "scan/rest_scan.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Arguments {
  std::string capture, out;
  int until = -1, frame = -1;
  std::vector<int> pixel;
  bool floating = false;
  double depth = 0.0, thickness = 0.0;
  int resolution = 60;
};

Json vector_json(const Vector3& v) { return Json::array({v.x(), v.y(), v.z()}); }

std::string toml_vector(const Vector3& v) { return formatted("[%.5f, %.5f, %.5f]", v.x(), v.y(), v.z()); }

void describe_views(const Capture& capture, const ScanViews& views, Json& json) {
  constexpr double restless = 0.1;
  for (const ScanView& view : views.views) {
    say("seen", formatted("in %d frame%s by a camera of %d x %d pixels", view.frames, view.frames == 1 ? "" : "s",
                          view.camera.width, view.camera.height));
    if (view.moved > restless)
      say("", formatted("note: %.0f %% of its readings change from the first frames to the last: does it rest?",
                        100.0 * view.moved));
  }
  if (views.views.size() < capture.depth.size())
    say("", formatted("%zu cameras do not see it", capture.depth.size() - views.views.size()));
  if (!views.plane) return;
  say("plane", "through " + toml_vector(views.plane->point) + " with the normal " + toml_vector(views.plane->normal) +
                   formatted(", %.2f mm rms", 1e3 * views.plane_rms));
  json["plane"] = {{"point", vector_json(views.plane->point)},
                   {"normal", vector_json(views.plane->normal)},
                   {"rms", views.plane_rms}};
}

void describe_surface(const RestScan& scan, Json& json) {
  const MeshReport report = examine(scan.mesh);
  if (!report.is_closed_solid)
    throw std::runtime_error("the scan's surface is not closed: " +
                             (report.complaints.empty() ? std::string() : report.complaints[0]));
  say("surface", formatted("%zu vertices, %zu triangles, closed, %.4g m^3", scan.mesh.vertices.size(),
                           scan.mesh.triangles.size(), report.volume));
  json["vertices"] = scan.mesh.vertices.size();
  json["triangles"] = scan.mesh.triangles.size();
  json["volume"] = report.volume;
  json["spacing"] = scan.spacing;
  json["seen_share"] = scan.seen_share;
}

void describe_scan(const RestScan& scan, Json& json) {
  say("size", formatted("%.1f mm wide, %.1f mm high, %.1f mm deep along the view", 1e3 * scan.width, 1e3 * scan.height,
                        1e3 * scan.depth));
  say("seen", formatted("%.0f %% of the surface; %.0f %% rests on the plane, the other %.0f %% is completed",
                        100.0 * scan.seen_share, 100.0 * scan.resting_share,
                        100.0 * (1.0 - scan.seen_share - scan.resting_share)));
  say("", scan.mirror ? "by mirroring what was seen about an upright plane across the view: a guess"
                      : "by going straight on from what was seen: a guess");
  say("readings", formatted("%d, %.2f mm rms from the surface", scan.readings, 1e3 * scan.readings_rms));
  if (scan.kept_from_mirror > 0.02)
    say("", formatted("note: the mirror image contradicts %.0f %% of them and gives way there: the object is not "
                      "symmetric front to back",
                      100.0 * scan.kept_from_mirror));
  json["width"] = scan.width;
  json["height"] = scan.height;
  json["depth"] = scan.depth;
  json["resting_share"] = scan.resting_share;
  json["readings"] = scan.readings;
  json["readings_rms"] = scan.readings_rms;
  json["contradicting_mirror"] = scan.kept_from_mirror;
  if (scan.mirror)
    json["mirror"] = {{"point", vector_json(scan.mirror->point)}, {"normal", vector_json(scan.mirror->normal)}};
}

std::vector<Vector3> points_of(const ScanView& view) {
  std::vector<Vector3> points;
  for (int v = 0; v < view.depth.height; ++v)
    for (int u = 0; u < view.depth.width; ++u)
      if (view.depth(u, v) > 0) points.push_back(view.camera.unproject(u, v, view.depth(u, v)));
  return points;
}

void write_pictures(const fs::path& out, const RestScan& scan, const std::vector<Vector3>& points,
                    const std::optional<Plane>& plane, const std::optional<PinholeCamera>& camera, const Vector3& up) {
  constexpr int width = 800, height = 600;
  PictureScene scene{vertex_points(scan.mesh), scan.mesh.triangles, {}, points, {}};
  if (plane) scene.planes.push_back(*plane);
  const Box box = bounding_box(scan.mesh);
  if (camera) write_png(out / "scan_front.png", draw(scene, framed(*camera, box, width, height)));
  write_png(out / "scan_side.png", draw(scene, view_of(box, up, width, height, 2.0, 0.3)));
}

Capture read(const Arguments& arguments) {
  if (arguments.out.empty()) throw InputError(Problem{{}, "no folder for the scan", "--out DIR", ""});
  return read_capture(arguments.capture);
}

void scan_object(const Capture& capture, const Arguments& arguments) {
  ScanChoice choice;
  if (arguments.until >= 0) choice.last_frame = arguments.until;
  if (!arguments.pixel.empty()) choice.pixel = {arguments.pixel[0], arguments.pixel[1]};
  choice.floating = arguments.floating;
  RestScanOptions options;
  options.resolution = arguments.resolution;
  if (arguments.depth > 0.0) options.depth = arguments.depth;
  Json json = {{"format", "scan/1"}, {"capture", capture.name}};
  std::cout << capture.name << '\n';
  const ScanViews views = read_scan_views(capture, choice);
  describe_views(capture, views, json);
  stop_if_interrupted();
  const RestScan scan = scan_rest_surface(views, capture.scene.world.up, options, capture.file);
  describe_surface(scan, json);
  describe_scan(scan, json);
  const fs::path out = arguments.out;
  std::vector<Vector3> points;
  for (const ScanView& view : views.views)
    for (const Vector3& point : points_of(view)) points.push_back(point);
  write_scan(out / "rest.ply", scan);
  write_points(out / "seen.ply", points);
  write_pictures(out, scan, points, views.plane, views.views[0].camera, capture.scene.world.up);
  write_file(out / "scan.json", json.dump(2) + "\n");
  if (!views.plane || !capture.scene.planes.empty()) return;
  std::cout << "\nFor the capture:\n[[plane]]\npoint = " << toml_vector(views.plane->point)
            << "\nnormal = " << toml_vector(views.plane->normal) << "\nknown = true\n";
}

void scan_cloud(const Capture& capture, const Arguments& arguments) {
  if (capture.clouds.empty())
    throw InputError(
        Problem{{capture.file}, "no [[cloud]] to make a sheet of", "point clouds", "leave out --thickness"});
  const CloudSequence& cloud = capture.clouds[0];
  const int frame = std::max(0, arguments.frame);
  if (frame >= capture.frame_count() || frame % cloud.every != 0)
    throw InputError(Problem{{capture.file}, "no cloud of frame " + std::to_string(frame), "a frame with a cloud", ""});
  const fs::path file = capture.folder / cloud.points(frame);
  std::cout << capture.name << '\n';
  const std::vector<Vector3> points = read_points(file);
  const RestScan scan = scan_sheet(points, arguments.thickness, file);
  Json json = {{"format", "scan/1"}, {"capture", capture.name}, {"frame", frame}, {"thickness", arguments.thickness}};
  describe_surface(scan, json);
  say("sheet", formatted("%d of %zu points, %.2f mm rms from its middle", scan.readings, points.size(),
                         1e3 * scan.readings_rms));
  const fs::path out = arguments.out;
  write_scan(out / "rest.ply", scan);
  write_pictures(out, scan, points, std::nullopt, std::nullopt, capture.scene.world.up);
  write_file(out / "scan.json", json.dump(2) + "\n");
}

void run(const Arguments& arguments) {
  const Capture capture = read(arguments);
  if (arguments.thickness > 0.0)
    scan_cloud(capture, arguments);
  else
    scan_object(capture, arguments);
}

constexpr const char* footer = R"(Examples:
  pliant scan recordings/ball --until 30 --out recordings/ball/scan
  pliant scan recordings/ball --pixel 110 130 --out scan
  pliant scan recordings/cloth --frame 10 --thickness 0.004 --out scan

The folder gets rest.ply (closed; its vertices have the column `seen`: 1 seen, 0 completed), seen.ply (the readings),
pictures of both, and scan.json (the figures). From one side the back is a guess: the front, mirrored.)";

}  // namespace

void add_scan(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("scan", "Make a closed rest surface of a recording's first frames");
  command.option("capture", arguments->capture, "the capture's folder, or its capture.toml").required();
  command.option("--out", arguments->out, "folder for rest.ply, seen.ply, scan.json and pictures")
      .required()
      .type_name("DIR");
  command.option("--until", arguments->until, "last frame in which the object rests (default: before start_frame)")
      .range(0, 1000000000);
  command.option("--pixel", arguments->pixel, "column and row of a pixel of the first camera on the object")
      .expected(2)
      .type_name("U V");
  command.flag("--floating", arguments->floating, "the object stands on no plane");
  command.option("--depth", arguments->depth, "the object's extent along the view, level, where it is known [m]")
      .positive();
  command.option("--resolution", arguments->resolution, "edges of the mesh across the object")
      .show_default()
      .range(10, 200);
  command
      .option("--thickness", arguments->thickness,
              "the object is a thin sheet, seen as a cloud: make a slab of this thickness [m]")
      .positive();
  command.option("--frame", arguments->frame, "of the cloud with --thickness").range(0, 1000000000);
  command.footer(footer);
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
