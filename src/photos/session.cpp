#include "photos/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/solid_surface.hpp"
#include "scene/inner_body.hpp"
#include "scene/scene_toml.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double least_diameter = 1e-4, greatest_diameter = 0.1;  // [m] of a dot

NumberRule positive(const char* meaning) { return {.low = 0.0, .low_allowed = false, .meaning = meaning}; }

class Reader {
 public:
  Reader(const fs::path& file, TomlContext& context) : context_(context) {
    session_.file = file;
    session_.folder = fs::absolute(file).parent_path().lexically_normal();
    files_.folder = session_.folder;
  }

  PhotoSession read(const toml::table& table) {
    TomlTable root(table, "", context_);
    check_format(root, "markers/1");
    session_.name = root.required<std::string>("name", "give the recording a name").value_or("");
    read_part(root, "object", &Reader::read_object);
    read_part(root, "world", &Reader::read_gravity);
    root.each_block("fixed", [&](TomlTable& block) { session_.scene.fixed.push_back(read_fixed(block, files_)); });
    root.each_block("inner", [&](TomlTable& block) { session_.scene.inner.push_back(read_inner(block, files_)); });
    cut_out_inner_bodies(context_, session_.scene);
    check_vertex_lists(context_, session_.scene);
    read_part(root, "markers", &Reader::read_markers);
    read_part(root, "probe", &Reader::read_probe);
    read_part(root, "force", &Reader::read_force);
    root.each_block("camera", [&](TomlTable& block) { read_camera(block); });
    read_part(root, "rest", &Reader::read_rest);
    root.each_block("press", [&](TomlTable& block) { read_press(block); });
    check_counts(root);
    check_presses();
    root.finish();
    if (context_.problems.empty()) check_photographs();
    return std::move(session_);
  }

 private:
  void read_part(TomlTable& root, const std::string& name, void (Reader::*read_it)(TomlTable&)) {
    root.with_table(
        name, [&](TomlTable& table) { (this->*read_it)(table); }, "[" + name + "]", "see docs/markers.md");
  }

  // Runs a reader of another file; what it throws joins the problems.
  template <class Read>
  void gather(const std::string& key, const Read& read_it) {
    try {
      read_it();
    } catch (const InputError& error) {
      for (const Problem& problem : error.problems()) context_.problems.push_back(problem);
      context_.broken.insert(key);
    }
  }

  void read_object(TomlTable& object) {
    Object& own = session_.scene.object;
    if (const auto file = read_path(object, "surface", files_)) {
      own.file = *file;
      read_file_of(object, "surface", *file, [&](const fs::path& path) {
        own.surface = read_surface(path);
        const MeshReport report = examine(*own.surface);
        if (!report.is_closed_solid)
          context_.reject("object.surface", report.complaints.front(), "a closed surface that faces outwards",
                          report.cure);
      });
    }
    read_object_facts(object, own);
    require_mass_or_density(object);
  }

  void read_gravity(TomlTable& world) { session_.scene.world = read_world(world, true); }

  DotKind read_kind(TomlTable& table, const char* usual) {
    DotKind kind;
    const std::string name = table.optional<std::string>("colour").value_or(usual);
    if (const auto colour = dot_colour(name))
      kind.colour = *colour;
    else
      context_.reject(table.key_of("colour"), "the colour \"" + name + "\"",
                      "dark, light, red, green, blue, yellow, magenta or cyan");
    kind.diameter = read_number(table, "diameter",
                                {.low = least_diameter, .high = greatest_diameter, .meaning = "of a dot, in metres"});
    kind.least_contrast = read_number(table, "least_contrast",
                                      {.low = 0.02, .high = 0.9, .meaning = "a share of the brightest level"}, 0.1);
    return kind;
  }

  void read_markers(TomlTable& table) {
    session_.markers = read_kind(table, "dark");
    session_.tolerance = read_number(table, "tolerance",
                                     {.low = 0.05, .high = 20.0, .meaning = "in pixels: what calibration leaves"}, 1.0);
    session_.least_views = read_count(table, "least_views", 2, 100, 3);
  }

  void read_probe(TomlTable& table) {
    session_.probe_dots = read_kind(table, "red");
    session_.probe.dots_apart =
        read_number(table, "dots_apart", positive("metres between the middles of its two dots"));
    session_.probe.tip = read_number(
        table, "tip", {.low = 0.0, .meaning = "metres from the dot nearer the tip to the tip, along the shaft"});
    session_.probe.radius = read_number(table, "radius", positive("of the disc at the tip, in metres"));
    if (context_.is_sound("probe.colour") && session_.probe_dots.colour == session_.markers.colour)
      context_.reject("probe.colour", "the probe's dots have the markers' colour", "another colour",
                      "paint the two dots on the shaft red, say, where markers are dark");
  }

  void read_force(TomlTable& table) {
    const auto log = read_path(table, "log", files_);
    ForceLogOptions options;
    options.scale = table.optional<double>("scale").value_or(1.0);
    if (options.scale == 0) context_.reject("force.scale", "a scale of 0", "newtons of one unit of the log");
    options.zero_until = table.optional<double>("zero_until");
    session_.force_window = read_number(table, "window", {.low = 0.0, .meaning = "seconds to take the mean over"}, 0.1);
    session_.greatest_gap = read_number(table, "greatest_gap", {.low = 0.0, .meaning = "seconds between samples"}, 0.5);
    if (log) gather("force.log", [&] { session_.log = read_force_log(*log, options); });
    if (const auto times = read_optional_path(table, "times", files_))
      gather("force.times", [&] { times_ = read_photograph_times(*times); });
  }

  void read_camera(TomlTable& block) {
    const std::string name = block.required<std::string>("name", "give the camera a name").value_or("");
    const auto calibration = read_path(block, "calibration", files_);
    const auto extrinsics = block.has("extrinsics") ? read_path(block, "extrinsics", files_) : calibration;
    const double unit = read_number(block, "unit", positive("metres of one unit of T"), 1.0);
    const auto images = block.required<std::string>("images", "a pattern like \"left/%03d.png\"");
    const FramePattern pattern{images.value_or("")};
    if (images && (!pattern.is_valid() || fs::path(*images).is_absolute()))
      context_.reject(block.key_of("images"), "the pattern \"" + *images + "\"",
                      "a path relative to this file with one %03d where the photograph's number stands");
    block.finish();
    if (!names_.insert(name).second)
      context_.complain(block.key_of("name"), "a second camera \"" + name + "\"", "different names");
    LensCamera camera;
    if (calibration && extrinsics)
      gather(block.key(), [&] { camera = read_lens_camera(*calibration, *extrinsics, unit); });
    camera.name = name;
    session_.cameras.push_back(camera);
    session_.images.push_back(pattern);
  }

  void read_rest(TomlTable& table) { session_.rest_number = read_count(table, "number", 0, 100'000'000); }

  void read_press(TomlTable& block) {
    PhotographedPress press;
    press.number = read_count(block, "number", 0, 100'000'000);
    const auto time = block.optional<double>("time");
    const auto listed = times_.find(press.number);
    if (time && listed != times_.end())
      context_.reject(block.key_of("time"), "both `time` and a row of `force.times`", "one of the two");
    else if (!time && listed == times_.end() && context_.is_sound("force.times"))
      context_.reject(block.key_of("time"), fmt::format("photograph {} has no time", press.number),
                      "`time` in seconds of the force log's clock, or a row of `force.times`");
    press.time = time ? *time : listed != times_.end() ? listed->second : 0.0;
    press.role = block.optional<std::string>("role").value_or("fit");
    if (press.role != "fit" && press.role != "test")
      context_.reject(block.key_of("role"), "the role \"" + press.role + "\"", "\"fit\" or \"test\"");
    press.contact = block.optional<Vector3>("contact");
    press.glued = block.optional<bool>("glued");
    block.finish();
    session_.presses.push_back(press);
  }

  void check_counts(TomlTable& root) {
    if (session_.cameras.size() < 3)
      context_.complain(
          "camera", fmt::format("{} camera{}", session_.cameras.size(), session_.cameras.size() == 1 ? "" : "s"),
          "three blocks [[camera]] or more", "two views leave open which dot is which; the third one decides");
    if (session_.presses.empty() && !root.has("press"))
      context_.complain("press", "no press", "a block [[press]] for each", "what is to be measured?");
    if (session_.least_views > std::max(3, int(session_.cameras.size())))
      context_.complain("markers.least_views", fmt::format("`least_views` is {}", session_.least_views),
                        fmt::format("2 to {}, the number of cameras", session_.cameras.size()));
  }

  void check_presses() {
    std::set<int> numbers{session_.rest_number};
    for (std::size_t i = 0; i < session_.presses.size(); ++i) {
      const PhotographedPress& press = session_.presses[i];
      const std::string key = fmt::format("press[{}]", i);
      if (context_.is_sound(key) && !numbers.insert(press.number).second)
        context_.complain(key + ".number", fmt::format("photograph {} a second time", press.number),
                          "a photograph of its own for the rest and for each press");
      if (!context_.is_sound(key) || !context_.is_sound("force.log") || session_.log.times.empty()) continue;
      const auto force = force_at(session_.log, press.time, session_.force_window, session_.greatest_gap);
      if (!force)
        context_.complain(key, fmt::format("no force at {} s", press.time),
                          fmt::format("a sample of the log within `greatest_gap`; it runs from {} to {} s",
                                      session_.log.times.front(), session_.log.times.back()),
                          "do both clocks start alike?");
      else if (force->force == 0)
        context_.complain(key, fmt::format("a force of 0 at {} s", press.time), "a force", "nothing presses there");
    }
  }

  void check_photographs() {
    std::vector<int> numbers{session_.rest_number};
    for (const PhotographedPress& press : session_.presses) numbers.push_back(press.number);
    for (int c = 0; c < int(session_.cameras.size()); ++c)
      for (const int number : numbers)
        if (const fs::path file = session_.photograph(c, number); !is_file(file))
          context_.complain(
              fmt::format("camera[{}].images", c),
              "the file \"" + session_.images[std::size_t(c)](number).string() + "\" " + why_no_file(file),
              "a photograph of the rest and of each press by each camera", "check the pattern and the numbers");
  }

  TomlContext& context_;
  NamedFiles files_;
  PhotoSession session_;
  std::map<int, double> times_;
  std::set<std::string> names_;
};

}  // namespace

fs::path PhotoSession::photograph(int camera, int number) const { return folder / images[std::size_t(camera)](number); }

PhotoSession read_photo_session(const fs::path& path) {
  const fs::path file = is_folder(path) ? path / "markers.toml" : path;
  const toml::table table = parse_toml(read_file(file), file);
  TomlContext context{TomlPlaces(file), {}, {}};
  PhotoSession session = Reader(file, context).read(table);
  context.throw_problems();
  return session;
}

}  // namespace pliant
