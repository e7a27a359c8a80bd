#include "scene/scene_toml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <sstream>

#include "base/files.hpp"
#include "geometry/solid_surface.hpp"
#include "scene/inner_body.hpp"
#include "scene/obstacle.hpp"
#include "scene/region.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr int most_frames_of_a_recording = 10'000'000;
constexpr const char* timestamps_name = "timestamps.txt";

std::string vertices_name(const char* kind, std::size_t number) { return fmt::format("{}_{}.txt", kind, number); }

// Calls `read` with each line of a file that is not empty, without spaces around it; where it answers false the line is
// complained about and the rest left unread.
template <class Read>
void read_lines(const fs::path& path, const char* expected, const Read& read) {
  std::istringstream lines(read_file(path));
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    line.erase(line.find_last_not_of(" \t\r") + 1);
    line.erase(0, line.find_first_not_of(" \t\r"));
    if (!line.empty() && !read(line))
      throw InputError(Problem{{path, number, 1}, "\"" + line.substr(0, 40) + "\"", expected, ""});
  }
}

// The whole text as a number.
template <class Number>
std::optional<Number> parsed(const std::string& text) {
  Number value{};
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || stop != text.data() + text.size()) return std::nullopt;
  return value;
}

std::vector<double> read_times(const fs::path& path) {
  std::vector<double> times;
  read_lines(path, "one time in seconds a line", [&](const std::string& line) {
    const auto time = parsed<double>(line);
    if (!time || !std::isfinite(*time)) return false;
    times.push_back(*time);
    return true;
  });
  if (times.empty()) throw InputError(Problem{{path}, "no times", "one time in seconds a line", ""});
  return times;
}

std::vector<int> read_indices(const fs::path& path) {
  std::vector<int> indices;
  read_lines(path, "one vertex index a line", [&](const std::string& line) {
    const auto index = parsed<int>(line);
    if (!index || *index < 0) return false;
    indices.push_back(*index);
    return true;
  });
  return indices;
}

std::vector<double> read_weights(const fs::path& path) {
  std::vector<double> weights;
  read_lines(path, "one weight from 0 a line", [&](const std::string& line) {
    const auto weight = parsed<double>(line);
    if (!weight || !std::isfinite(*weight) || *weight < 0.0) return false;
    weights.push_back(*weight);
    return true;
  });
  return weights;
}

std::optional<Region> read_box(TomlTable& table) {
  const auto min = table.required<Vector3>("min"), max = table.required<Vector3>("max");
  if (!min || !max) return std::nullopt;
  if ((min->array() > max->array()).any())
    table.context().reject(table.key(), "a box whose `min` lies above its `max`", "min <= max on each axis",
                           "swap them");
  return RegionBox{*min, *max};
}

std::optional<Region> read_sphere(TomlTable& table) {
  const auto centre = table.required<Vector3>("centre");
  const double radius =
      read_number(table, "radius", {.low = 0.0, .low_allowed = false, .meaning = "a radius in metres"});
  return centre ? std::optional<Region>(RegionSphere{*centre, radius}) : std::nullopt;
}

std::optional<Region> read_half_space(TomlTable& table) {
  const auto point = table.required<Vector3>("point");
  const auto normal = read_direction(table, "normal");
  return point && normal ? std::optional<Region>(RegionHalfSpace{*point, *normal}) : std::nullopt;
}

std::optional<Region> read_vertices(TomlTable& table, const NamedFiles& files) {
  const auto file = read_optional_path(table, "vertices", files);
  if (!file) return std::nullopt;
  std::optional<Region> region;
  read_file_of(table, "vertices", *file, [&](const fs::path& path) { region = RegionVertices{read_indices(path)}; });
  return region;
}

// Times of frames at a common rate, as far as rate and number make sense.
void count_times(TomlTable& table, double rate, std::optional<int> count, Timing& timing) {
  if (!table.has("frame_count"))
    table.context().reject(table.key_of("frame_count"), "[timing] has no `frame_count`", "the number of frames",
                           "count the images");
  if (count && (*count < 1 || *count > most_frames_of_a_recording)) {
    table.context().reject(table.key_of("frame_count"), fmt::format("`frame_count` is {}", *count),
                           fmt::format("1 to {}", most_frames_of_a_recording));
    return;
  }
  if (!(rate > 0.0))
    table.context().reject(table.key_of("frame_rate"), fmt::format("a frame rate of {} Hz", rate), "above 0");
  timing.times = evenly_timed(rate > 0.0 ? rate : 1.0, count.value_or(0)).times;
  timing.frame_rate = rate > 0.0 ? rate : 0.0;
}

void read_timestamps(TomlTable& table, const fs::path& file, std::optional<int> count, Timing& timing) {
  read_file_of(table, "timestamps", file, [&](const fs::path& path) { timing.times = read_times(path); });
  if (!count || timing.times.empty() || *count == timing.frame_count()) return;
  table.context().reject(table.key_of("frame_count"),
                         fmt::format("`frame_count` is {}, the timestamps are {}", *count, timing.times.size()),
                         "one time for each frame", "leave out `frame_count`");
  timing.times.clear();
}

std::string region_text(const Region& region, const std::string& vertices_file) {
  if (const auto* box = std::get_if<RegionBox>(&region))
    return "box = { min = " + toml_text(box->min) + ", max = " + toml_text(box->max) + " }\n";
  if (const auto* sphere = std::get_if<RegionSphere>(&region))
    return "sphere = { centre = " + toml_text(sphere->centre) + ", radius = " + toml_text(sphere->radius) + " }\n";
  if (const auto* half = std::get_if<RegionHalfSpace>(&region))
    return "half_space = { point = " + toml_text(half->point) + ", normal = " + toml_text(half->normal) + " }\n";
  return "vertices = " + toml_text(vertices_file) + "\n";
}

void write_vertices(const fs::path& file, const Region& region) {
  if (const auto* list = std::get_if<RegionVertices>(&region))
    write_file(file, fmt::format("{}\n", fmt::join(list->indices, "\n")));
}

}  // namespace

void read_object_facts(TomlTable& table, Object& object) {
  object.mass = table.optional<double>("mass");
  object.density = table.optional<double>("density");
  object.mass_std = table.optional<double>("mass_std");
  object.density_std = table.optional<double>("density_std");
  const auto shape_is = table.optional<std::string>("shape_is");
  if (shape_is && *shape_is != "reference" && *shape_is != "static")
    table.context().reject(table.key_of("shape_is"), "`shape_is` is \"" + *shape_is + "\"",
                           "\"reference\" or \"static\"",
                           "\"static\" means that the scan was taken sagging under gravity");
  object.shape_is = shape_is == "static" ? ShapeIs::Static : ShapeIs::Reference;
  object.surface_noise = table.optional<double>("surface_noise");
  object.stiffness_std =
      read_optional_number(table, "stiffness_std",
                           {0.0, 0.5, true, true, "a share of the stiffness; 0 where it is even, as of cast rubber"});
}

void read_object_shape(TomlTable& table, const NamedFiles& files, Object& object) {
  const auto surface = read_optional_path(table, "surface", files),
             volume = read_optional_path(table, "volume_mesh", files);
  if (table.has("surface") && table.has("volume_mesh")) {
    table.context().reject(table.key_of("volume_mesh"), "both `surface` and `volume_mesh`", "one of the two",
                           "leave out `surface`: the volume's boundary takes its place");
  } else if (surface) {
    object.file = *surface;
    read_file_of(table, "surface", *surface, [&](const fs::path& path) { object.surface = read_surface(path); });
  } else if (volume) {
    object.file = *volume;
    read_file_of(table, "volume_mesh", *volume, [&](const fs::path& path) {
      object.volume = read_volume_mesh(path);
      object.surface = boundary_surface(*object.volume);
    });
  }
}

void require_mass_or_density(TomlTable& table) {
  if (table.has("mass") == table.has("density"))
    table.context().reject(table.key(),
                           table.has("mass") ? "both `mass` and `density`" : "neither `mass` nor `density`",
                           "one of the two", "mass in kilograms, density in kg/m^3");
}

World read_world(TomlTable& table, bool gravity_is_required) {
  World world;
  world.gravity = gravity_is_required
                      ? table.required<Vector3>("gravity", "gravity = [x, y, z] in m/s^2, in world coordinates")
                      : table.optional<Vector3>("gravity");
  if (table.has("up"))
    world.up = read_direction(table, "up").value_or(world.up);
  else if (world.gravity && world.gravity->norm() > 0)
    world.up = -world.gravity->normalized();
  const NumberRule tilt{0.0, 0.5, true, true, "radians by which its direction is off; 0 where it is exact"};
  world.gravity_std = read_optional_number(table, "gravity_std", tilt);
  return world;
}

Timing read_timing(TomlTable& table, const NamedFiles& files) {
  Timing timing;
  const auto rate = table.optional<double>("frame_rate");
  const auto stamps = read_optional_path(table, "timestamps", files);
  const auto count = table.optional<int>("frame_count");
  timing.start_frame = table.optional<int>("start_frame").value_or(0);
  timing.is_static = table.optional<bool>("static").value_or(false);
  if (table.has("frame_rate") == table.has("timestamps"))
    table.context().reject(table.key(),
                           rate ? "both `frame_rate` and `timestamps`" : "neither `frame_rate` nor `timestamps`",
                           "one of the two", "write the one that the camera gives");
  else if (stamps)
    read_timestamps(table, *stamps, count, timing);
  else if (rate)
    count_times(table, *rate, count, timing);
  return timing;
}

Timing read_even_timing(TomlTable& table, int most_frames) {
  const double rate =
      read_number(table, "frame_rate", {.low = 0.0, .low_allowed = false, .meaning = "frames a second"});
  const int count = read_count(table, "frame_count", 1, most_frames);
  const int start = read_count(table, "start_frame", 0, std::max(0, count - 1), 0);
  const bool is_sound = count <= most_frames;
  return evenly_timed(rate, is_sound ? count : 0, start);
}

std::optional<Region> read_region(TomlTable& table, const NamedFiles& files) {
  int written = 0;
  for (const char* name : {"box", "sphere", "half_space", "vertices"}) written += table.has(name);
  std::optional<Region> region;
  table.with_table("box", [&](TomlTable& box) { region = read_box(box); });
  table.with_table("sphere", [&](TomlTable& sphere) { region = read_sphere(sphere); });
  table.with_table("half_space", [&](TomlTable& half_space) { region = read_half_space(half_space); });
  if (auto listed = read_vertices(table, files)) region = std::move(listed);
  if (written == 1) return region;
  table.context().reject(table.key(), written == 0 ? "no region" : std::to_string(written) + " regions in one block",
                         "one of `box`, `sphere`, `half_space`, `vertices`", "write a block for each region");
  return std::nullopt;
}

void check_vertex_lists(TomlContext& context, const Scene& scene) {
  if (!scene.object.surface) return;
  const int count = int(scene.object.surface->vertices.size());
  const auto check = [&](const Region& region, const std::string& key) {
    const auto* list = std::get_if<RegionVertices>(&region);
    if (!list || !context.is_sound(key)) return;
    const auto bad = std::ranges::find_if(list->indices, [&](int v) { return v < 0 || v >= count; });
    if (bad != list->indices.end())
      context.complain(key + ".vertices", fmt::format("vertex {} in the list", *bad), fmt::format("0 to {}", count - 1),
                       "indices count the surface file's vertices from 0");
  };
  for (std::size_t i = 0; i < scene.fixed.size(); ++i) check(scene.fixed[i].region, fmt::format("fixed[{}]", i));
  for (std::size_t i = 0; i < scene.led.size(); ++i) check(scene.led[i].region, fmt::format("led[{}]", i));
  for (std::size_t i = 0; i < scene.regions.size(); ++i) check(scene.regions[i].region, fmt::format("region[{}]", i));
}

namespace {

void check_material_name(TomlContext& context, const std::string& kind, const std::string& key, const std::string& name,
                         std::set<std::string>& names) {
  if (!names.insert(name).second)
    context.complain(key + ".name", "a second " + kind + " \"" + name + "\"", "different names");
  if (name.find('@') != std::string::npos)
    context.complain(key + ".name", "the name \"" + name + "\"", "a name without @",
                     "parameters are listed as name@region");
}

void check_weights(TomlContext& context, const Scene& scene) {
  const std::size_t vertices = scene.object.surface->vertices.size();
  std::vector<double> sum(vertices, 0.0);
  for (std::size_t i = 0; i < scene.controls.size(); ++i) {
    const std::vector<double>& weights = scene.controls[i].weights;
    const std::string key = fmt::format("control[{}]", i);
    if (weights.empty() != scene.controls.front().weights.empty())
      return context.complain(key, "control points with `point` and with `weights`", "all with the same", "");
    if (weights.empty()) continue;
    if (weights.size() != vertices)
      return context.complain(key + ".weights", fmt::format("{} weights", weights.size()),
                              fmt::format("{}, one for each vertex of the surface", vertices), "");
    for (std::size_t v = 0; v < vertices; ++v) sum[v] += weights[v];
  }
  const auto none = std::ranges::find(sum, 0.0);
  if (none != sum.end() && !scene.controls.front().weights.empty())
    context.complain("control", fmt::format("no weight at vertex {} of the surface", none - sum.begin()),
                     "at least one above 0 at each vertex", "weights are divided by their sum");
}

}  // namespace

void check_materials(TomlContext& context, const Scene& scene) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < scene.regions.size(); ++i) {
    const std::string key = fmt::format("region[{}]", i);
    if (!context.is_sound(key)) continue;
    check_material_name(context, "region", key, scene.regions[i].name, names);
    if (scene.object.surface && !scene.object.surface->vertices.empty() &&
        !touches_solid(scene.regions[i].region, *scene.object.surface))
      context.complain(key, "no point of the object lies in region \"" + scene.regions[i].name + "\"",
                       "a region that holds a part of it", "check its unit and the side of its normal");
  }
  for (std::size_t i = 0; i < scene.controls.size(); ++i) {
    const std::string key = fmt::format("control[{}]", i);
    if (!context.is_sound(key)) return;
    check_material_name(context, "control point", key, scene.controls[i].name, names);
  }
  if (scene.controls.empty()) return;
  if (!scene.regions.empty())
    return context.complain("control", "both [[control]] and [[region]]", "one of the two",
                            "regions are of one modulus each, control points blend");
  if (scene.controls.size() == 1)
    return context.complain("control", "one control point", "two at least", "one modulus needs none");
  if (scene.object.surface && !scene.object.surface->vertices.empty()) check_weights(context, scene);
}

FixedRegion read_fixed(TomlTable& block, const NamedFiles& files) {
  FixedRegion fixed;
  if (auto region = read_region(block, files)) fixed.region = std::move(*region);
  fixed.displaced_to = block.optional<RigidMotion>("displaced_to");
  return fixed;
}

MaterialRegion read_material_region(TomlTable& block, const NamedFiles& files) {
  MaterialRegion part;
  part.name = block.required<std::string>("name", "results are listed under it").value_or("");
  if (auto region = read_region(block, files)) part.region = std::move(*region);
  return part;
}

MaterialControl read_material_control(TomlTable& block, const NamedFiles& files) {
  MaterialControl control;
  control.name = block.required<std::string>("name", "results are listed under it").value_or("");
  const auto file = read_optional_path(block, "weights", files);
  const auto point = block.optional<Vector3>("point");
  if (point.has_value() == block.has("weights"))
    block.context().reject(block.key(), point ? "both `point` and `weights`" : "neither `point` nor `weights`",
                           "one of the two", "`weights` is a file with one number a line, one for each vertex");
  control.point = point.value_or(control.point);
  if (file) read_file_of(block, "weights", *file, [&](const fs::path& path) { control.weights = read_weights(path); });
  return control;
}

Plane read_plane(TomlTable& block) {
  Plane plane;
  plane.point = block.required<Vector3>("point").value_or(plane.point);
  plane.normal = read_direction(block, "normal").value_or(plane.normal);
  plane.known = block.optional<bool>("known").value_or(true);
  plane.knows_friction = block.has("friction");
  plane.friction = read_number(block, "friction", {.low = 0.0, .high = 5.0, .meaning = "Coulomb's coefficient"}, 0.0);
  return plane;
}

Weight read_weight(TomlTable& block) {
  Weight weight;
  weight.mass = block.required<double>("mass", "the attached point mass in kilograms").value_or(0.0);
  weight.at = block.required<Vector3>("at", "where it hangs, on the rest surface").value_or(Vector3::Zero());
  return weight;
}

void check_key_times(TomlTable& owner, const std::string& name, const std::vector<double>& times) {
  for (std::size_t k = 1; k < times.size(); ++k)
    if (!(times[k] > times[k - 1])) {
      owner.context().complain(owner.key_of(name) + fmt::format("[{}].time", k),
                               fmt::format("{} s after {} s", times[k], times[k - 1]),
                               "times that increase from key to key", "put the keys in order");
      return;
    }
}

std::vector<KeyFrames<3>::Key> read_key_frames(TomlTable& owner, const std::string& name, const std::string& value) {
  std::vector<KeyFrames<3>::Key> keys;
  std::vector<double> times;
  owner.each_block(name, [&](TomlTable& block) {
    times.push_back(read_number(block, "time", {.meaning = "a time in seconds"}));
    keys.push_back({times.back(), block.required<Vector3>(value).value_or(Vector3::Zero())});
  });
  check_key_times(owner, name, times);
  return keys;
}

void read_patch(TomlTable& table, Vector3& at, double& radius) {
  at = table.required<Vector3>("at", "a point of the surface at rest").value_or(Vector3::Zero());
  radius = read_number(table, "radius", {.low = 0.0, .meaning = "a length in metres"}, 0.0);
}

WindFacts read_wind(TomlTable& table, bool may_be_unknown) {
  WindFacts wind;
  wind.over_time = read_key_frames(table, "over_time", "velocity");
  if (wind.over_time.empty())
    wind.velocity = table.required<Vector3>("velocity", "of the air, in metres a second").value_or(Vector3::Zero());
  else
    for (const auto& key : wind.over_time) wind.velocity += key.value / double(wind.over_time.size());
  if (may_be_unknown) wind.known = table.optional<bool>("known").value_or(true);
  wind.air_density =
      read_number(table, "air_density", {.low = 0.0, .high = 2000.0, .low_allowed = false, .meaning = "in kg/m^3"},
                  wind.air_density);
  wind.normal = read_number(table, "normal", {.low = 0.0, .high = 10.0, .meaning = "a drag coefficient"}, wind.normal);
  wind.tangential = read_number(table, "tangential", {.low = 0.0, .high = 10.0, .meaning = "a friction coefficient"},
                                wind.tangential);
  table.with_table("gusts", [&](TomlTable& gusts) {
    wind.gust_intensity = read_number(
        gusts, "intensity", {.low = 0.0, .high = 1.0, .meaning = "standard deviation of the speed over its mean"}, 0.2);
    wind.gust_length = read_number(gusts, "length", {.low = 0.0, .low_allowed = false, .meaning = "a length in metres"},
                                   wind.gust_length);
    wind.seed = std::uint64_t(read_count(gusts, "seed", 0, 2'000'000'000, 1));
  });
  return wind;
}

AppliedForce read_force(TomlTable& block, bool may_be_unknown) {
  AppliedForce force;
  read_patch(block, force.at, force.radius);
  force.force = read_key_frames(block, "over_time", "force");
  if (force.force.empty())
    force.force = {
        {0.0, block.required<Vector3>("force", "in newtons, or blocks `over_time`").value_or(Vector3::Zero())}};
  if (may_be_unknown) force.known = block.optional<bool>("known").value_or(true);
  return force;
}

Initial read_initial(TomlTable& table, bool may_pull) {
  Initial initial;
  initial.linear_velocity = table.optional<Vector3>("linear_velocity").value_or(Vector3::Zero());
  initial.angular_velocity = table.optional<Vector3>("angular_velocity").value_or(Vector3::Zero());
  initial.known = table.optional<bool>("known").value_or(true);
  initial.released = table.optional<bool>("released").value_or(false);
  if (may_pull) {
    initial.pulls = table.optional<std::vector<Vector3>>("pulls").value_or(std::vector<Vector3>{});
    initial.pulled_at = table.optional<std::vector<Vector3>>("pulled_at").value_or(std::vector<Vector3>{});
    if (!initial.pulled_at.empty() && initial.pulled_at.size() != initial.pulls.size())
      table.context().complain(table.key_of("pulled_at"),
                               fmt::format("`pulled_at` with {} places", initial.pulled_at.size()),
                               fmt::format("one for each of {} `pulls`", initial.pulls.size()));
  }
  table.with_table("release_of", [&](TomlTable& weight) { initial.release_of = read_weight(weight); });
  return initial;
}

// ---- writing

void write_toml(std::ostream& out, const Object& object, const std::string& file) {
  out << "[object]\n";
  if (!file.empty()) out << (object.volume ? "volume_mesh" : "surface") << " = " << toml_text(file) << "\n";
  if (object.mass) out << "mass = " << toml_text(*object.mass) << "   # kg\n";
  if (object.mass_std) out << "mass_std = " << toml_text(*object.mass_std) << "   # kg\n";
  if (object.density) out << "density = " << toml_text(*object.density) << "   # kg/m^3\n";
  if (object.density_std) out << "density_std = " << toml_text(*object.density_std) << "   # kg/m^3\n";
  if (!object.pose_is_known) out << "pose = \"unknown\"   # of the scan: found in the start frame\n";
  if (!object.scale_is_known) out << "scale = \"unknown\"   # of the scan: any unit\n";
  if (object.scale_std) out << "scale_std = " << toml_text(*object.scale_std) << "   # of all lengths, a share\n";
  if (object.shape_is == ShapeIs::Static) out << "shape_is = \"static\"   # taken as it sagged under gravity\n";
  if (object.surface_noise) out << "surface_noise = " << toml_text(*object.surface_noise) << "   # m\n";
  if (object.stiffness_std) out << "stiffness_std = " << toml_text(*object.stiffness_std) << "   # a share\n";
  out << "\n";
}

void write_toml(std::ostream& out, const World& world) {
  out << "[world]\n";
  if (world.gravity) out << "gravity = " << toml_text(*world.gravity) << "   # m/s^2\n";
  const bool is_told = world.gravity && world.gravity->norm() > 0.0 && world.up == -world.gravity->normalized();
  if (!is_told) out << "up = " << toml_text(world.up) << "\n";
  if (world.gravity_std) out << "gravity_std = " << toml_text(*world.gravity_std) << "   # rad, of its direction\n";
  out << "\n";
}

void write_toml(std::ostream& out, const Timing& timing) {
  out << "[timing]\n";
  if (timing.frame_rate > 0.0)
    out << "frame_rate = " << toml_text(timing.frame_rate) << "\n";
  else
    out << "timestamps = " << toml_text(timestamps_name) << "\n";
  out << "frame_count = " << timing.frame_count() << "\nstart_frame = " << timing.start_frame << "\n";
  if (timing.is_static) out << "static = true\n";
  out << "\n";
}

void write_toml(std::ostream& out, const Plane& plane) {
  out << "[[plane]]\npoint = " << toml_text(plane.point) << "   # m\nnormal = " << toml_text(plane.normal)
      << "   # to the side where the object may be\nknown = " << (plane.known ? "true" : "false") << "\n";
  if (plane.knows_friction) out << "friction = " << toml_text(plane.friction) << "   # Coulomb's coefficient\n";
  out << "\n";
}

void write_toml(std::ostream& out, const Weight& weight) {
  out << "[[weight]]\nmass = " << toml_text(weight.mass)
      << "   # kg, attached point mass\nat = " << toml_text(weight.at) << "   # m, on the rest surface\n\n";
}

namespace {

void write_key_frames(std::ostream& out, const std::vector<KeyFrames<3>::Key>& keys, const char* value) {
  out << "over_time = [";
  for (std::size_t k = 0; k < keys.size(); ++k)
    out << (k > 0 ? ", " : " ") << "{ time = " << toml_text(keys[k].time) << ", " << value << " = "
        << toml_text(keys[k].value) << " }";
  out << " ]\n";
}

}  // namespace

void write_toml(std::ostream& out, const WindFacts& wind) {
  out << "[wind]\n";
  if (wind.over_time.empty())
    out << "velocity = " << toml_text(wind.velocity) << "   # m/s\n";
  else
    write_key_frames(out, wind.over_time, "velocity");
  if (!wind.known) out << "known = false\n";
  out << "air_density = " << toml_text(wind.air_density) << "   # kg/m^3\nnormal = " << toml_text(wind.normal)
      << "   # drag coefficient of a plate across it\ntangential = " << toml_text(wind.tangential)
      << "   # friction coefficient of a surface along it\n";
  if (wind.gust_intensity > 0.0)
    out << "gusts = { intensity = " << toml_text(wind.gust_intensity) << ", length = " << toml_text(wind.gust_length)
        << ", seed = " << wind.seed << " }\n";
  out << "\n";
}

void write_toml(std::ostream& out, const AppliedForce& force) {
  out << "[[force]]\nat = " << toml_text(force.at)
      << "   # m, on the rest surface\nradius = " << toml_text(force.radius) << "   # m, of the patch\n";
  if (force.force.size() == 1)
    out << "force = " << toml_text(force.force.front().value) << "   # N\n";
  else
    write_key_frames(out, force.force, "force");
  if (!force.known) out << "known = false\n";
  out << "\n";
}

void write_toml(std::ostream& out, const Initial& initial) {
  out << "[initial]\nlinear_velocity = " << toml_text(initial.linear_velocity)
      << "   # m/s, of the centre of mass\nangular_velocity = " << toml_text(initial.angular_velocity)
      << "   # rad/s\nknown = " << (initial.known ? "true" : "false")
      << "\nreleased = " << (initial.released ? "true" : "false") << "\n";
  if (!initial.pulls.empty()) {
    const auto write_list = [&](const char* name, const std::vector<Vector3>& list, const char* meaning) {
      out << name << " = [";
      for (std::size_t k = 0; k < list.size(); ++k) out << (k > 0 ? ", " : "") << toml_text(list[k]);
      out << "]   # " << meaning << "\n";
    };
    write_list("pulls", initial.pulls,
               "what holds the object until it is released, times its size about how far each moves it");
    if (!initial.pulled_at.empty()) write_list("pulled_at", initial.pulled_at, "m, where in the scan those act");
  }
  if (initial.release_of)
    out << "release_of = { mass = " << toml_text(initial.release_of->mass)
        << ", at = " << toml_text(initial.release_of->at) << " }   # kg and m: hangs until the object is released\n";
  out << "\n";
}

void write_region(std::ostream& out, const Region& region, const std::string& vertices_file) {
  out << region_text(region, vertices_file);
}

void write_region_file(const fs::path& file, const Region& region) { write_vertices(file, region); }

void write_toml_blocks(std::ostream& out, const Scene& scene) {
  for (const Plane& plane : scene.planes) write_toml(out, plane);
  write_inner_blocks(out, scene);
  write_obstacle_blocks(out, scene);
  for (std::size_t i = 0; i < scene.fixed.size(); ++i) {
    const FixedRegion& fixed = scene.fixed[i];
    out << "[[fixed]]\n" << region_text(fixed.region, vertices_name("fixed", i));
    if (fixed.displaced_to) out << "displaced_to = " << toml_text(*fixed.displaced_to) << "\n";
    out << "\n";
  }
  for (std::size_t i = 0; i < scene.regions.size(); ++i)
    out << "[[region]]\nname = " << toml_text(scene.regions[i].name) << "\n"
        << region_text(scene.regions[i].region, vertices_name("region", i)) << "\n";
  for (std::size_t i = 0; i < scene.controls.size(); ++i) {
    const MaterialControl& control = scene.controls[i];
    out << "[[control]]\nname = " << toml_text(control.name) << "\n";
    if (control.weights.empty())
      out << "point = " << toml_text(control.point) << "\n\n";
    else
      out << "weights = " << toml_text(vertices_name("control", i)) << "   # one for each vertex of the surface\n\n";
  }
  for (const Weight& weight : scene.weights) write_toml(out, weight);
  for (const AppliedForce& force : scene.forces) write_toml(out, force);
  if (scene.wind) write_toml(out, *scene.wind);
}

void write_scene_files(const fs::path& folder, const Scene& scene) {
  write_inner_files(folder, scene);
  write_obstacle_files(folder, scene);
  for (std::size_t i = 0; i < scene.fixed.size(); ++i)
    write_vertices(folder / vertices_name("fixed", i), scene.fixed[i].region);
  for (std::size_t i = 0; i < scene.regions.size(); ++i)
    write_vertices(folder / vertices_name("region", i), scene.regions[i].region);
  for (std::size_t i = 0; i < scene.controls.size(); ++i) {
    if (scene.controls[i].weights.empty()) continue;
    std::string lines;
    for (const double weight : scene.controls[i].weights) lines += fmt::format("{}\n", weight);
    write_file(folder / vertices_name("control", i), lines);
  }
  if (scene.timing.times.empty() || scene.timing.frame_rate > 0.0) return;
  std::string times;
  for (const double time : scene.timing.times) times += fmt::format("{}\n", time);
  write_file(folder / timestamps_name, times);
}

}  // namespace pliant
