#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "base/files.hpp"
#include "base/sha256.hpp"
#include "capture/capture.hpp"
#include "capture/capture_rules.hpp"
#include "capture/toml_table.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/volume_mesh.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

// Fills a Capture table by table. Each method reads one table of the format and finishes it.
class Reader {
 public:
  Reader(const fs::path& file, TomlContext& context) : context_(context) {
    capture_.file = file;
    capture_.folder = fs::absolute(file).parent_path().lexically_normal();
  }

  Capture read(const toml::table& table) {
    TomlTable root(table, "", context_);
    read_format(root);
    capture_.name = root.required<std::string>("name", "give the recording a name for reports").value_or("");
    if (auto object = root.table("object"))
      read_object(*object);
    else if (!root.has("object"))
      context_.complain("object", "no table [object]", "[object] with `surface` and `mass`");
    if (auto world = root.table("world"))
      read_world(*world);
    else if (!root.has("world"))
      context_.complain("world", "no table [world]", "[world] with `gravity`, or with `up`");
    if (auto timing = root.table("timing")) read_timing(*timing);
    read_blocks(root, "fixed", [&](TomlTable& block) { capture_.fixed.push_back(read_fixed(block)); });
    read_blocks(root, "region", [&](TomlTable& block) { capture_.regions.push_back(read_material_region(block)); });
    read_blocks(root, "plane", [&](TomlTable& block) { capture_.planes.push_back(read_plane(block)); });
    if (auto initial = root.table("initial")) read_initial(*initial);
    read_blocks(root, "depth", [&](TomlTable& block) { capture_.depth.push_back(read_depth(block)); });
    read_blocks(root, "cloud", [&](TomlTable& block) { capture_.clouds.push_back(read_cloud(block)); });
    read_blocks(root, "markers", [&](TomlTable& block) { capture_.markers.push_back(read_markers_block(block)); });
    read_blocks(root, "press", [&](TomlTable& block) { capture_.presses.push_back(read_press(block)); });
    read_blocks(root, "weight", [&](TomlTable& block) { capture_.weights.push_back(read_weight(block)); });
    read_blocks(root, "load", [&](TomlTable& block) { capture_.loads.push_back(read_load(block)); });
    root.finish();
    return std::move(capture_);
  }

 private:
  template <class Read>
  static void read_blocks(TomlTable& root, const char* name, const Read& read) {
    for (TomlTable& block : root.blocks(name)) {
      read(block);
      block.finish();
    }
  }

  void read_format(TomlTable& root) {
    const auto format = root.required<std::string>("format", "write format = \"capture/1\" first");
    if (format && *format != "capture/1")
      context_.complain("format", "the format \"" + *format + "\"", "\"capture/1\"",
                        "use a program that knows this format");
  }

  // A path of the capture, absolute; complains where nothing is there.
  std::optional<fs::path> existing(TomlTable& table, const std::string& name, const std::string& text) {
    if (fs::path(text).is_absolute()) {
      context_.reject(table.key_of(name), "the absolute path \"" + text + "\"",
                      "a path relative to the capture's folder",
                      "a capture must still be whole when its folder is moved");
      return std::nullopt;
    }
    const fs::path path = (capture_.folder / text).lexically_normal();
    if (!is_file(path)) {
      context_.reject(table.key_of(name), "the file \"" + text + "\" " + why_no_file(path),
                      "a file in " + capture_.folder.string(), "check the spelling, or copy the file");
      return std::nullopt;
    }
    return path;
  }

  std::optional<fs::path> optional_path(TomlTable& table, const std::string& name) {
    const auto text = table.optional<std::string>(name);
    return text ? existing(table, name, *text) : std::nullopt;
  }

  fs::path required_path(TomlTable& table, const std::string& name) {
    const auto text = table.required<std::string>(name);
    return text ? existing(table, name, *text).value_or(fs::path()) : fs::path();
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

  void read_object(TomlTable& object) {
    const auto surface = optional_path(object, "surface"), volume = optional_path(object, "volume_mesh");
    if (object.has("surface") && object.has("volume_mesh"))
      context_.reject("object.volume_mesh", "both `surface` and `volume_mesh`", "one of the two",
                      "leave out `surface`: the volume's boundary takes its place");
    else if (surface)
      read_file_into(*surface, "object.surface", [&] { capture_.surface = read_mesh(*surface); });
    else if (volume)
      read_file_into(*volume, "object.volume_mesh", [&] {
        capture_.volume = read_volume_mesh(*volume);
        capture_.surface = boundary_surface(*capture_.volume);
      });
    capture_.mass = object.optional<double>("mass");
    capture_.density = object.optional<double>("density");
    const auto shape_is = object.optional<std::string>("shape_is");
    if (shape_is && *shape_is != "reference" && *shape_is != "static")
      context_.reject("object.shape_is", "`shape_is` is \"" + *shape_is + "\"", "\"reference\" or \"static\"",
                      "\"static\" means that the scan was taken sagging under gravity");
    if (shape_is == "static") capture_.shape_is = ShapeIs::Static;
    object.finish();
  }

  template <class Read>
  void read_file_into(const fs::path& path, const char* key, const Read& read) {
    capture_.surface_file = path;
    try {
      read();
    } catch (const InputError& error) {
      for (const Problem& problem : error.problems()) context_.problems.push_back(problem);
      context_.broken.insert({"object", key});
    }
  }

  void read_world(TomlTable& world) {
    capture_.gravity = world.optional<Vector3>("gravity");
    const auto up = world.optional<Vector3>("up");
    if (up && up->norm() < 1e-9)
      context_.reject("world.up", "`up` has no length", "a direction like [0, 1, 0]");
    else if (up)
      capture_.up = up->normalized();
    else if (capture_.gravity && capture_.gravity->norm() > 0)
      capture_.up = -capture_.gravity->normalized();
    world.finish();
  }

  void read_timing(TomlTable& timing) {
    const auto rate = timing.optional<double>("frame_rate");
    const auto stamps = optional_path(timing, "timestamps");
    const auto count = timing.optional<int>("frame_count");
    capture_.start_frame = timing.optional<int>("start_frame").value_or(0);
    capture_.is_static = timing.optional<bool>("static").value_or(false);
    if (timing.has("frame_rate") == timing.has("timestamps"))
      context_.reject("timing", rate ? "both `frame_rate` and `timestamps`" : "neither `frame_rate` nor `timestamps`",
                      "one of the two", "write the one that the camera gives");
    else if (stamps)
      read_timestamps(*stamps, count);
    else if (rate)
      count_times(timing, *rate, count);
    timing.finish();
  }

  void count_times(TomlTable& timing, double rate, std::optional<int> count) {
    if (!timing.has("frame_count"))
      context_.reject("timing.frame_count", "[timing] has no `frame_count`", "the number of frames",
                      "count the images");
    if (count && (*count < 1 || *count > 10'000'000)) {
      context_.reject("timing.frame_count", "`frame_count` is " + std::to_string(*count), "1 to 10000000");
      return;
    }
    for (int frame = 0; frame < count.value_or(0); ++frame) capture_.times.push_back(frame / (rate > 0 ? rate : 1.0));
    if (!(rate > 0)) context_.reject("timing.frame_rate", "a frame rate of " + std::to_string(rate) + " Hz", "above 0");
  }

  void read_timestamps(const fs::path& path, std::optional<int> count) {
    const std::string content = read_file(path);
    int line_number = 0;
    for (std::size_t at = 0; at < content.size();) {
      const std::size_t end = std::min(content.find('\n', at), content.size());
      std::string_view line = std::string_view(content).substr(at, end - at);
      at = end + 1;
      ++line_number;
      while (!line.empty() && std::string_view(" \t\r").find(line.back()) != std::string_view::npos)
        line.remove_suffix(1);
      if (line.empty()) continue;
      double time = 0.0;
      const auto [stop, error] = std::from_chars(line.data(), line.data() + line.size(), time);
      if (error == std::errc() && stop == line.data() + line.size() && std::isfinite(time)) {
        capture_.times.push_back(time);
        continue;
      }
      reject_timestamps(
          {{path, line_number, 1}, "\"" + std::string(line.substr(0, 40)) + "\"", "one time in seconds a line", ""});
      return;
    }
    if (capture_.times.empty())
      reject_timestamps({{path}, "no times", "one time in seconds a line", ""});
    else if (count && *count != int(capture_.times.size()))
      reject_timestamps({context_.places("timing.frame_count"),
                         "`frame_count` is " + std::to_string(*count) + ", the timestamps are " +
                             std::to_string(capture_.times.size()),
                         "one time for each frame", "leave out `frame_count`"});
  }

  void reject_timestamps(Problem problem) {
    context_.problems.push_back(std::move(problem));
    context_.broken.insert({"timing", "timing.timestamps", "timing.frame_count"});
    capture_.times.clear();
  }

  std::optional<Region> read_region(TomlTable& table) {
    std::vector<Region> regions;
    int written = 0;
    for (const char* name : {"box", "sphere", "half_space", "vertices"}) written += table.has(name);
    if (auto box = table.table("box")) {
      const auto min = box->required<Vector3>("min"), max = box->required<Vector3>("max");
      if (min && max && (min->array() > max->array()).any())
        context_.reject(box->key(), "a box whose `min` lies above its `max`", "min <= max on each axis", "swap them");
      if (min && max) regions.push_back(RegionBox{*min, *max});
      box->finish();
    }
    if (auto sphere = table.table("sphere")) {
      const auto centre = sphere->required<Vector3>("centre");
      const auto radius = sphere->required<double>("radius");
      if (radius && *radius <= 0)
        context_.reject(sphere->key_of("radius"), "a radius of 0 or less", "a radius in metres");
      if (centre && radius) regions.push_back(RegionSphere{*centre, *radius});
      sphere->finish();
    }
    if (auto half = table.table("half_space")) {
      const auto point = half->required<Vector3>("point"), normal = half->required<Vector3>("normal");
      if (normal && normal->norm() < 1e-9)
        context_.reject(half->key_of("normal"), "a normal without length", "a direction");
      else if (point && normal)
        regions.push_back(RegionHalfSpace{*point, normal->normalized()});
      half->finish();
    }
    if (const auto list = optional_path(table, "vertices")) regions.push_back(RegionVertices{read_indices(*list)});
    if (written != 1)
      context_.reject(table.key(), written == 0 ? "no region" : std::to_string(written) + " regions in one block",
                      "one of `box`, `sphere`, `half_space`, `vertices`", "write a block for each region");
    return regions.size() == 1 ? std::optional(regions.front()) : std::nullopt;
  }

  std::vector<int> read_indices(const fs::path& path) {
    const std::string content = read_file(path);
    std::vector<int> indices;
    int line_number = 0;
    for (std::size_t at = 0; at < content.size();) {
      const std::size_t end = std::min(content.find('\n', at), content.size());
      std::string_view line = std::string_view(content).substr(at, end - at);
      at = end + 1;
      ++line_number;
      while (!line.empty() && std::string_view(" \t\r").find(line.back()) != std::string_view::npos)
        line.remove_suffix(1);
      if (line.empty()) continue;
      int index = 0;
      const auto [stop, error] = std::from_chars(line.data(), line.data() + line.size(), index);
      if (error != std::errc() || stop != line.data() + line.size()) {
        context_.problems.push_back(
            {{path, line_number, 1}, "\"" + std::string(line.substr(0, 40)) + "\"", "one vertex index a line", ""});
        break;
      }
      indices.push_back(index);
    }
    return indices;
  }

  FixedRegion read_fixed(TomlTable& block) {
    FixedRegion fixed;
    if (auto region = read_region(block)) fixed.region = *region;
    fixed.displaced_to = block.optional<RigidMotion>("displaced_to");
    return fixed;
  }

  MaterialRegion read_material_region(TomlTable& block) {
    MaterialRegion part;
    part.name = block.required<std::string>("name", "results are listed under it").value_or("");
    if (auto region = read_region(block)) part.region = *region;
    return part;
  }

  Plane read_plane(TomlTable& block) {
    Plane plane;
    plane.point = block.required<Vector3>("point").value_or(plane.point);
    if (const auto normal = block.required<Vector3>("normal")) {
      if (normal->norm() < 1e-9)
        context_.reject(block.key_of("normal"), "a normal without length", "a direction");
      else
        plane.normal = normal->normalized();
    }
    plane.known = block.optional<bool>("known").value_or(true);
    return plane;
  }

  void read_initial(TomlTable& table) {
    Initial& initial = capture_.initial;
    initial.linear_velocity = table.optional<Vector3>("linear_velocity").value_or(Vector3::Zero());
    initial.angular_velocity = table.optional<Vector3>("angular_velocity").value_or(Vector3::Zero());
    initial.known = table.optional<bool>("known").value_or(true);
    initial.released = table.optional<bool>("released").value_or(false);
    if (auto weight = table.table("release_of")) {
      initial.release_of = read_weight(*weight);
      weight->finish();
    }
    table.finish();
  }

  DepthCamera read_depth(TomlTable& block) {
    DepthCamera depth;
    PinholeCamera& camera = depth.camera;
    depth.name = block.required<std::string>("name", "give the camera a name, like \"front\"").value_or("");
    camera.width = block.required<int>("width").value_or(0);
    camera.height = block.required<int>("height").value_or(0);
    camera.fx = block.required<double>("fx", "the focal length in pixels").value_or(0);
    camera.fy = block.required<double>("fy", "the focal length in pixels").value_or(0);
    camera.cx = block.required<double>("cx", "the principal point in pixels").value_or(0);
    camera.cy = block.required<double>("cy", "the principal point in pixels").value_or(0);
    if (const auto pose = block.required<RigidMotion>("camera_to_world")) camera.camera_to_world = *pose;
    depth.images = required_pattern(block, "images");
    depth.depth_scale = block.required<double>("depth_scale", "1000 for millimetres").value_or(1000.0);
    if (!(depth.depth_scale > 0))
      context_.reject(block.key_of("depth_scale"), "a depth_scale of 0 or less", "raw units per metre");
    depth.masks = optional_pattern(block, "masks");
    depth.background = optional_path(block, "background");
    depth.every = block.optional<int>("every").value_or(1);
    depth.noise = block.optional<double>("noise");
    return depth;
  }

  CloudSequence read_cloud(TomlTable& block) {
    CloudSequence cloud;
    cloud.points = required_pattern(block, "points");
    cloud.every = block.optional<int>("every").value_or(1);
    cloud.noise = block.optional<double>("noise");
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
    if (auto contact = block.table("contact")) {
      press.contact_centre = contact->required<Vector3>("centre").value_or(Vector3::Zero());
      press.contact_radius = contact->required<double>("radius").value_or(0.0);
      contact->finish();
    } else if (!block.has("contact")) {
      context_.reject(block.key_of("contact"), "[" + block.key() + "] has no `contact`",
                      "contact = { centre = .., radius = .. }");
    }
    if (auto probe = block.table("probe")) {
      press.probe = read_plane_of_probe(*probe);
      probe->finish();
    }
    press.markers = required_path(block, "markers");
    press.markers_rest = required_path(block, "markers_rest");
    press.role = read_role(block);
    press.glued = block.optional<bool>("glued").value_or(true);
    return press;
  }

  Plane read_plane_of_probe(TomlTable& table) {
    Plane plane;
    plane.point = table.required<Vector3>("point").value_or(Vector3::Zero());
    if (const auto normal = table.required<Vector3>("normal"); normal && normal->norm() > 1e-9)
      plane.normal = normal->normalized();
    else if (normal)
      context_.reject(table.key_of("normal"), "a normal without length", "a direction into the object");
    return plane;
  }

  static Weight read_weight(TomlTable& block) {
    Weight weight;
    weight.mass = block.required<double>("mass", "the hung mass in kilograms").value_or(0.0);
    weight.at = block.required<Vector3>("at", "where it hangs, on the rest surface").value_or(Vector3::Zero());
    return weight;
  }

  Load read_load(TomlTable& block) {
    Load load;
    load.mass = block.required<double>("mass", "the hung mass in kilograms").value_or(0.0);
    load.at = block.required<Vector3>("at").value_or(Vector3::Zero());
    load.cloud = optional_path(block, "cloud");
    load.markers = optional_path(block, "markers");
    load.markers_rest = optional_path(block, "markers_rest");
    load.images = read_paths_by_camera(block, "images");
    load.masks = read_paths_by_camera(block, "masks");
    load.role = read_role(block);
    return load;
  }

  // images = { front = "load/000.png" }: keys are names of depth cameras.
  std::map<std::string, fs::path> read_paths_by_camera(TomlTable& block, const std::string& name) {
    std::map<std::string, fs::path> paths;
    auto table = block.table(name);
    if (!table) return paths;
    for (const std::string& camera : table->take_all_keys())
      if (const auto path = optional_path(*table, camera)) paths[camera] = *path;
    return paths;
  }

  TomlContext& context_;
  Capture capture_;
};

fs::path toml_file(const fs::path& path) {
  const fs::path file = is_folder(path) ? path / "capture.toml" : path;
  if (!is_file(file))
    throw InputError(Problem{
        {file}, "the file " + why_no_file(file), "a folder with a capture.toml in it", "name the recording's folder"});
  return file;
}

// In the order of the file; problems of other files last. Within a line as found.
void sort_by_place(std::vector<Problem>& problems, const fs::path& own) {
  std::ranges::stable_sort(problems, {}, [&](const Problem& problem) {
    return problem.place.file == own ? std::pair(0, problem.place.line) : std::pair(1, 0);
  });
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
  if (!context.problems.empty()) {
    sort_by_place(context.problems, file);
    throw InputError(std::move(context.problems));
  }
  capture.sha256 = sha256({content, capture.surface_file.empty() ? std::string() : read_file(capture.surface_file)});
  return capture;
}

}  // namespace pliant
