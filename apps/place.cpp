#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "base/files.hpp"
#include "capture/observe.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "geometry/mesh_io.hpp"
#include "rays/ray_scene.hpp"
#include "report/picture.hpp"
#include "scan/scan_pose.hpp"
#include "speech.hpp"

namespace pliant::apps {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string capture, out;
  int frame = -1;
  bool scale = false;
};

std::string matrix_text(const RigidMotion& motion) {
  std::string text = "[";
  for (int i = 0; i < 3; ++i)
    text += formatted("[%.9f, %.9f, %.9f, %.9f], ", motion.rotation(i, 0), motion.rotation(i, 1), motion.rotation(i, 2),
                      motion.translation[i]);
  return text + "[0, 0, 0, 1]]";
}

const ObservedFrame& frame_of(const Capture& capture, const std::vector<ObservedFrame>& seen, int frame) {
  const auto first = std::ranges::find_if(seen, [&](const ObservedFrame& f) { return f.frame >= frame; });
  if (first == seen.end())
    throw InputError({{capture.file},
                      "no frame from " + std::to_string(frame) + " on shows the object",
                      "a frame that was recorded",
                      "choose another by --frame"});
  return *first;
}

void run(const Arguments& arguments) {
  const Capture capture = read_capture(arguments.capture);
  if (!capture.scene.object.surface)
    throw InputError({{capture.file}, "no scan of the object", "[object] with `surface`", "name the mesh"});
  std::cout << capture.name << '\n';
  const std::vector<ObservedFrame> seen = observe(capture);
  const int start = arguments.frame >= 0 ? arguments.frame : capture.scene.timing.start_frame;
  const ObservedFrame& frame = frame_of(capture, seen, start);
  ScanPoseOptions options;
  options.finds_scale = arguments.scale || !capture.scene.object.scale_is_known;
  const TriangleMesh& scan = *capture.scene.object.surface;
  const ScanPose pose = find_scan_pose(scan, capture, frame, options);
  say("frame", formatted("%d, %zu points", frame.frame, frame.points.size()));
  if (options.finds_scale) say("scale", formatted("a unit of the scan is %.5g m", pose.scale));
  const double turn = Eigen::AngleAxisd(pose.motion.rotation).angle();
  say("pose", formatted("turned by %.2f degrees", 180.0 / 3.14159265358979 * turn));
  say("residual", formatted("%.2f mm rms of nine tenths of %d points", 1e3 * pose.rms, pose.points));
  if (!capture.depth.empty())
    say("outline", formatted("%.1f %% of what is seen and what would be seen overlap", 100.0 * pose.overlap));
  if (pose.runner_up > 0.0 && pose.runner_up < 1.3)
    say("", "note: another pose fits nearly as well: the object is symmetric, or too little of it is seen");
  std::cout << "\nFor the object's scan, row by row (object_to_world):\n" << matrix_text(pose.motion) << '\n';

  const fs::path out = arguments.out;
  const TriangleMesh mesh = placed(scan, pose);
  write_mesh(out / "rest.ply", mesh);
  PictureScene scene{vertex_points(mesh), mesh.triangles, capture.scene.planes, frame.points, {}};
  const Box box = bounding_box(mesh);
  constexpr int width = 800, height = 600;
  if (!capture.depth.empty())
    write_png(out / "place_front.png", draw(scene, framed(capture.depth.front().camera, box, width, height)));
  write_png(out / "place_side.png", draw(scene, view_of(box, capture.scene.world.up, width, height, 2.0, 0.3)));
  nlohmann::ordered_json json = {{"format", "place/1"}, {"capture", capture.name}, {"frame", frame.frame}};
  for (int i = 0; i < 4; ++i) {
    auto row = nlohmann::ordered_json::array();
    for (int k = 0; k < 4; ++k)
      row.push_back(i < 3 ? (k < 3 ? pose.motion.rotation(i, k) : pose.motion.translation[i]) : k < 3 ? 0.0 : 1.0);
    json["object_to_world"].push_back(row);
  }
  json["scale"] = pose.scale, json["points"] = pose.points, json["rms"] = pose.rms;
  json["overlap"] = pose.overlap, json["runner_up"] = pose.runner_up;
  write_file(out / "place.json", json.dump(2) + "\n");
  std::cout << arguments.out << "/rest.ply is the scan where it stands; place_front.png shows it with the points\n";
}

constexpr const char* footer = R"(Examples:
  pliant place recordings/teddy --out placed
  pliant place recordings/teddy --scale --out placed      # a scan in millimetres, or in no unit

The scan may stand anywhere and in any way. The folder gets rest.ply (the scan in the pose of the start frame, in metres), pictures, and
place.json (pose, scale, residual). `pliant fit` does the same by itself where the capture says `pose = "unknown"` in [object].)";

}  // namespace

void add_place(CommandLine& line, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  Command command = line.add_command("place", "Find the pose of a scan in a recording's first frame");
  command.option("capture", arguments->capture, "the capture's folder, or its capture.toml").required();
  command.option("--out", arguments->out, "folder for rest.ply, place.json and pictures").required().type_name("DIR");
  command.option("--frame", arguments->frame, "in which it is looked for (default: start_frame)").range(0, 1000000000);
  command.flag("--scale", arguments->scale, "find the scan's unit as well");
  command.footer(footer);
  command.callback([arguments, &exit_code] {
    run(*arguments);
    exit_code = Fine;
  });
}

}  // namespace pliant::apps
