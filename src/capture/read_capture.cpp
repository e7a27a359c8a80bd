#include <algorithm>

#include "base/files.hpp"
#include "base/sha256.hpp"
#include "capture/camera_poses.hpp"
#include "capture/capture.hpp"
#include "capture/capture_rules.hpp"
#include "capture/folder_survey.hpp"
#include "scene/inner_body.hpp"
#include "scene/obstacle.hpp"
#include "scene/scene_toml.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

// Fills a Capture table by table. Each method reads one table of the format and finishes it.
class Reader {
 public:
  Reader(const fs::path& file, TomlContext& context) : context_(context) {
    capture_.file = file;
    capture_.folder = fs::absolute(file).parent_path().lexically_normal();
    files_ = {capture_.folder, true};
  }

  Capture read(const toml::table& table) {
    TomlTable root(table, "", context_);
    check_format(root, "capture/1");
    capture_.name = root.required<std::string>("name", "give the recording a name for reports").value_or("");
    read_scene(root);
    root.each_block("depth", [&](TomlTable& block) { capture_.depth.push_back(read_depth(block)); });
    root.each_block("silhouette", [&](TomlTable& block) { capture_.silhouettes.push_back(read_silhouette(block)); });
    root.each_block("cloud", [&](TomlTable& block) { capture_.clouds.push_back(read_cloud(block)); });
    root.each_block("markers", [&](TomlTable& block) { capture_.markers.push_back(read_markers_block(block)); });
    root.each_block("press", [&](TomlTable& block) { capture_.presses.push_back(read_press(block)); });
    root.each_block("load", [&](TomlTable& block) { capture_.loads.push_back(read_load(block)); });
    root.each_block("indentation", [&](TomlTable& block) { capture_.indentations.push_back(read_indentation(block)); });
    root.each_block("grip", [&](TomlTable& block) { capture_.grips.push_back(read_grip(block)); });
    root.each_block("material_curve",
                    [&](TomlTable& block) { capture_.material_curves.push_back(read_material_curve(block)); });
    root.finish();
    return std::move(capture_);
  }

 private:
  void read_scene(TomlTable& root) {
    Scene& scene = capture_.scene;
    const auto read_object = [&](TomlTable& object) {
      read_object_shape(object, files_, scene.object);
      read_object_facts(object, scene.object);
      scene.object.pose_is_known = read_choice(object, "pose", {"known", "unknown"}) == "known";
      scene.object.scale_is_known = read_choice(object, "scale", {"known", "unknown"}) == "known";
      const NumberRule scale{0.0, 0.2, true, true, "a share of all lengths; 0 where they are exact"};
      scene.object.scale_std = read_optional_number(object, "scale_std", scale);
    };
    const auto read_own_world = [&](TomlTable& world) { scene.world = read_world(world); };
    if (is_of_curves_alone(root)) {  // a specimen needs neither shape nor place
      root.with_table("object", read_object);
      root.with_table("world", read_own_world);
    } else {
      root.with_table("object", read_object, "[object] with `surface` and `mass`", "");
      root.with_table("world", read_own_world, "[world] with `gravity`, or with `up`", "");
    }
    root.with_table("timing", [&](TomlTable& timing) { scene.timing = read_timing(timing, files_); });
    root.each_block("fixed", [&](TomlTable& block) { scene.fixed.push_back(read_fixed(block, files_)); });
    root.each_block("region", [&](TomlTable& block) { scene.regions.push_back(read_material_region(block, files_)); });
    root.each_block("control",
                    [&](TomlTable& block) { scene.controls.push_back(read_material_control(block, files_)); });
    root.each_block("plane", [&](TomlTable& block) { scene.planes.push_back(read_plane(block)); });
    root.each_block("obstacle",
                    [&](TomlTable& block) { scene.obstacles.push_back(read_obstacle(block, files_, true)); });
    root.each_block("led", [&](TomlTable& block) { scene.led.push_back(read_led(block, files_)); });
    root.each_block("inner", [&](TomlTable& block) { scene.inner.push_back(read_inner(block, files_)); });
    root.each_block("weight", [&](TomlTable& block) { scene.weights.push_back(read_weight(block)); });
    root.with_table("wind", [&](TomlTable& wind) { scene.wind = read_wind(wind, true); });
    root.each_block("force", [&](TomlTable& block) { scene.forces.push_back(read_force(block, true)); });
    root.with_table("initial", [&](TomlTable& initial) { scene.initial = read_initial(initial); });
    cut_out_inner_bodies(context_, scene);
  }

  static bool is_of_curves_alone(const TomlTable& root) {
    for (const char* other : {"depth", "silhouette", "cloud", "markers", "press", "load", "indentation", "grip"})
      if (root.has(other)) return false;
    return root.has("material_curve");
  }

  std::optional<fs::path> optional_path(TomlTable& table, const std::string& name) {
    return read_optional_path(table, name, files_);
  }

  fs::path required_path(TomlTable& table, const std::string& name) {
    return read_path(table, name, files_).value_or(fs::path());
  }

  FramePattern checked_pattern(TomlTable& table, const std::string& name, const std::optional<std::string>& text) {
    const FramePattern pattern{text.value_or("")};
    if (text && !pattern.is_valid() && !(pattern.is_plain() && capture_.frame_count() == 1))
      context_.reject(table.key_of(name), "the pattern \"" + *text + "\"", "one %06d where the frame's number stands",
                      "name the files \"000000.png\", \"000001.png\" and write \"%06d.png\"");
    if (text && fs::path(*text).is_absolute())
      context_.reject(table.key_of(name), "the absolute path \"" + *text + "\"",
                      "a path relative to the capture's folder");
    return pattern;
  }

  FramePattern required_pattern(TomlTable& table, const std::string& name) {
    return checked_pattern(table, name, table.required<std::string>(name, "write a pattern like \"front/%06d.png\""));
  }

  std::optional<FramePattern> optional_pattern(TomlTable& table, const std::string& name) {
    const auto text = table.optional<std::string>(name);
    return text ? std::optional(checked_pattern(table, name, text)) : std::nullopt;
  }

  /// What all kinds of cameras have.
  void read_camera(TomlTable& block, RecordingCamera& recording) {
    PinholeCamera& camera = recording.camera;
    recording.name = block.required<std::string>("name", "give the camera a name, like \"front\"").value_or("");
    camera.width = block.required<int>("width").value_or(0);
    camera.height = block.required<int>("height").value_or(0);
    camera.fx = block.required<double>("fx", "the focal length in pixels").value_or(0);
    camera.fy = block.required<double>("fy", "the focal length in pixels").value_or(0);
    camera.cx = block.required<double>("cx", "the principal point in pixels").value_or(0);
    camera.cy = block.required<double>("cy", "the principal point in pixels").value_or(0);
    recording.every = block.optional<int>("every").value_or(1);
    if (block.has("poses"))
      read_poses(block, recording);
    else if (const auto pose = block.required<RigidMotion>("camera_to_world"))
      camera.camera_to_world = *pose;
    camera.lens = read_lens(block);
    recording.time_offset = block.optional<double>("time_offset").value_or(0.0);
    recording.pose_std = read_pose_std(block).value_or(PoseStd());
  }

  DepthCamera read_depth(TomlTable& block) {
    DepthCamera depth;
    read_camera(block, depth);
    depth.images = required_pattern(block, "images");
    depth.depth_scale = block.required<double>("depth_scale", "1000 for millimetres").value_or(1000.0);
    if (!(depth.depth_scale > 0))
      context_.reject(block.key_of("depth_scale"), "a depth_scale of 0 or less", "raw units per metre");
    depth.masks = optional_pattern(block, "masks");
    depth.background = optional_path(block, "background");
    depth.noise = block.optional<double>("noise");
    const NumberRule range{0.0, 0.2, true, true, "metres by which all ranges are off; 0 where they are exact"};
    const NumberRule share{0.0, 0.2, true, true, "a share, like 0.003; 0 where it is exact"};
    depth.range_std = read_optional_number(block, "range_std", range);
    depth.range_scale_std = read_number(block, "range_scale_std", share, depth.range_scale_std);
    depth.focal_std = read_number(block, "focal_std", share, depth.focal_std);
    return depth;
  }

  SilhouetteCamera read_silhouette(TomlTable& block) {
    SilhouetteCamera silhouette;
    read_camera(block, silhouette);
    silhouette.masks = required_pattern(block, "masks");
    const NumberRule outline{0.05, 50.0, true, true, "pixels by which points of the masks' outlines err"},
        error{0.0, 20.0, true, true, "pixels by which masks reach beyond the object, or not as far"};
    silhouette.outline_std = read_number(block, "outline_std", outline, silhouette.outline_std);
    silhouette.outline_error_std = read_number(block, "outline_error_std", error, silhouette.outline_error_std);
    return silhouette;
  }

  std::optional<PoseStd> read_pose_std(TomlTable& block) {
    std::optional<PoseStd> std;
    block.with_table("pose_std", [&](TomlTable& table) {
      std.emplace();
      const NumberRule turn{0.0, 0.5, true, true, "radians about each axis; 0 where it is exact"};
      const NumberRule shift{0.0, 0.5, true, true, "metres along each axis; 0 where it is exact"};
      std->turn = read_number(table, "turn", turn, std->turn);
      std->shift = read_number(table, "shift", shift, std->shift);
    });
    return std;
  }

  /// Where a camera that moves was at each frame.
  void read_poses(TomlTable& block, RecordingCamera& camera) {
    camera.poses = optional_path(block, "poses");
    const std::string key = block.key_of("poses");
    if (block.has("camera_to_world"))
      context_.reject(key, "both `poses` and `camera_to_world`", "one of the two",
                      "a stationary camera has `camera_to_world`");
    if (!camera.poses || capture_.frame_count() == 0) return;
    try {
      camera.moved = read_camera_poses(*camera.poses, capture_.frame_count(), camera.every);
      camera.camera.camera_to_world = camera.moved.front();
    } catch (const InputError& error) {
      context_.reject(key, error.problems());
    }
  }

  CloudSequence read_cloud(TomlTable& block) {
    CloudSequence cloud;
    cloud.points = required_pattern(block, "points");
    cloud.every = block.optional<int>("every").value_or(1);
    cloud.noise = block.optional<double>("noise");
    cloud.background = optional_path(block, "background");
    cloud.pose_std = read_pose_std(block);
    return cloud;
  }

  MarkerTrack read_markers_block(TomlTable& block) {
    MarkerTrack track;
    track.rest = required_path(block, "rest");
    track.track = required_path(block, "track");
    return track;
  }

  std::string read_role(TomlTable& block) {
    const auto role = block.optional<std::string>("role");
    if (role && *role != "fit" && *role != "test")
      context_.reject(block.key_of("role"), "the role \"" + *role + "\"", "\"fit\" or \"test\"");
    return role.value_or("fit");
  }

  Press read_press(TomlTable& block) {
    Press press;
    press.force =
        block.required<Vector3>("force", "the whole force on the object in newtons").value_or(Vector3::Zero());
    const auto read_contact = [&](TomlTable& contact) {
      press.contact_centre = contact.required<Vector3>("centre").value_or(Vector3::Zero());
      press.contact_radius = contact.required<double>("radius").value_or(0.0);
    };
    if (!block.with_table("contact", read_contact) && !block.has("contact"))
      context_.reject(block.key_of("contact"), "[" + block.key() + "] has no `contact`",
                      "contact = { centre = .., radius = .. }");
    block.with_table("probe", [&](TomlTable& probe) {
      press.probe.emplace();
      press.probe->point = probe.required<Vector3>("point").value_or(Vector3::Zero());
      press.probe->normal = read_direction(probe, "normal", "it points into the object").value_or(Vector3::UnitY());
    });
    press.markers = required_path(block, "markers");
    press.markers_rest = required_path(block, "markers_rest");
    press.markers_std = optional_path(block, "markers_std");
    press.role = read_role(block);
    press.glued = block.optional<bool>("glued").value_or(true);
    return press;
  }

  Load read_load(TomlTable& block) {
    Load load;
    const Weight weight = read_weight(block);
    load.mass = weight.mass, load.at = weight.at;
    load.cloud = optional_path(block, "cloud");
    load.markers = optional_path(block, "markers");
    load.markers_rest = optional_path(block, "markers_rest");
    load.images = read_paths_by_camera(block, "images");
    load.masks = read_paths_by_camera(block, "masks");
    load.role = read_role(block);
    return load;
  }

  /// Number of a word among those known, 0 and a complaint where it is none of them.
  int read_word(TomlTable& block, const std::string& name, const std::vector<std::string>& known,
                std::optional<std::string> text) {
    const auto found = std::ranges::find(known, text.value_or(known.front()));
    if (found != known.end()) return int(found - known.begin());
    std::string list;
    for (const std::string& word : known) list += (list.empty() ? "\"" : ", \"") + word + "\"";
    context_.reject(block.key_of(name), "\"" + *text + "\"", "one of " + list);
    return 0;
  }

  Indentation read_indentation(TomlTable& block) {
    Indentation test;
    test.name = block.optional<std::string>("name").value_or("");
    test.probe = IndenterShape(
        read_word(block, "probe", {"ball", "punch"}, block.required<std::string>("probe", "the probe's shape")));
    test.radius = block.required<double>("radius", "of the ball, or of the punch's flat end, in metres").value_or(0.0);
    test.contact = block.required<Vector3>("contact", "the point of the undeformed surface that is touched first")
                       .value_or(Vector3::Zero());
    test.direction = read_direction(block, "direction", "the direction in which the probe advances, into the object")
                         .value_or(test.direction);
    test.contact_std = block.optional<double>("contact_std").value_or(0.0);
    test.curve = required_path(block, "curve");
    test.role = read_role(block);
    return test;
  }

  Grip read_grip(TomlTable& block) {
    Grip test;
    test.name = block.optional<std::string>("name").value_or("");
    if (auto region = read_region(block, files_)) test.region = std::move(*region);
    test.displacement =
        block.required<Vector3>("displacement", "of the gripped part from rest in metres").value_or(Vector3::Zero());
    test.force = block.optional<double>("force");
    test.force_std = block.optional<double>("force_std");
    if (block.has("force_direction"))
      test.force_direction = read_direction(block, "force_direction").value_or(test.force_direction);
    test.markers = optional_path(block, "markers");
    test.markers_rest = optional_path(block, "markers_rest");
    test.markers_std = block.optional<double>("markers_std");
    if (block.has("unseen")) test.unseen = read_direction(block, "unseen");
    test.role = read_role(block);
    return test;
  }

  MaterialCurve read_material_curve(TomlTable& block) {
    MaterialCurve test;
    test.name = block.optional<std::string>("name").value_or("");
    test.mode = TestMode(read_word(block, "mode", test_mode_names(),
                                   block.required<std::string>("mode", "how the specimen is deformed")));
    test.measure =
        StressMeasure(read_word(block, "measure", stress_measure_names(), block.optional<std::string>("measure")));
    test.prestretch = block.optional<double>("prestretch").value_or(1.0);
    test.curve = required_path(block, "curve");
    test.role = read_role(block);
    return test;
  }

  // images = { front = "load/000.png" }: keys are names of depth cameras.
  std::map<std::string, fs::path> read_paths_by_camera(TomlTable& block, const std::string& name) {
    std::map<std::string, fs::path> paths;
    block.with_table(name, [&](TomlTable& table) {
      for (const std::string& camera : table.take_all_keys())
        if (const auto path = optional_path(table, camera)) paths[camera] = *path;
    });
    return paths;
  }

  TomlContext& context_;
  NamedFiles files_;
  Capture capture_;
};

fs::path toml_file(const fs::path& path) {
  const fs::path file = is_folder(path) ? path / "capture.toml" : path;
  if (!is_file(file)) {
    const bool is_recorded = is_folder(path) && survey_folder(path, false).has_frames();
    throw InputError(Problem{{file},
                             "the file " + why_no_file(file),
                             "a folder with a capture.toml in it",
                             is_recorded ? "`pliant new " + path.string() + "` writes one for what lies there"
                                         : "name the recording's folder"});
  }
  return file;
}

}  // namespace

Capture read_capture(const fs::path& path) {
  const fs::path file = toml_file(path);
  const std::string content = read_file(file);
  if (content.empty())
    throw InputError(Problem{{file}, "the file is empty", "a capture", "begin with format = \"capture/1\""});
  const toml::table table = parse_toml(content, file);
  TomlContext context{TomlPlaces(file), {}, {}};
  Capture capture = Reader(file, context).read(table);
  RuleContext rules{capture, context};
  for (const Rule rule : capture_rules()) rule(rules);
  context.throw_problems();
  const fs::path& shape = capture.scene.object.file;
  std::string surfaces = shape.empty() ? std::string() : read_file(shape);
  for (const InnerBody& body : capture.scene.inner) surfaces += read_file(body.file);
  for (const RigidObstacle& obstacle : capture.scene.obstacles)
    if (const auto* mesh = std::get_if<ShapeMesh>(&obstacle.shape)) surfaces += read_file(mesh->file);
  std::ostringstream motions;  // they may stand in files of their own
  write_obstacle_blocks(motions, capture.scene);
  surfaces += motions.str();
  capture.sha256 = sha256({content, surfaces});
  return capture;
}

}  // namespace pliant
