#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "base/files.hpp"
#include "geometry/solid_surface.hpp"
#include "scene/obstacle.hpp"
#include "scene/scene_toml.hpp"
#include "situation/situation.hpp"

namespace pliant {

namespace {

constexpr double degree = std::numbers::pi / 180.0;

const NumberRule positive_metres{.low = 0.0, .low_allowed = false, .meaning = "a length in metres"};
const NumberRule any_time{.meaning = "a time in seconds"};

void check_times(TomlTable& owner, const std::string& name, const std::vector<KeyFrames<6>::Key>& keys) {
  std::vector<double> times;
  for (const auto& key : keys) times.push_back(key.time);
  check_key_times(owner, name, times);
}

std::uint64_t read_seed(TomlTable& table) { return std::uint64_t(read_count(table, "seed", 0, 2'000'000'000, 1)); }

RainOptions read_rain(TomlTable& table, double duration) {
  RainOptions rain;
  rain.rate = read_number(
      table, "rate", {.low = 0.0, .high = 1e7, .low_allowed = false, .meaning = "drops a square metre and second"});
  rain.diameter = read_number(
      table, "diameter", {.low = 0.0, .high = 0.02, .low_allowed = false, .meaning = "of a drop in metres"}, 0.003);
  rain.velocity = table.optional<Vector3>("velocity").value_or(rain.velocity);
  if (!(rain.velocity.norm() > 0.0))
    table.context().complain(table.key_of("velocity"), "no velocity",
                             "how fast and where drops fall, in metres a second");
  rain.from = read_number(table, "from", any_time, 0.0);
  rain.until = read_number(table, "until", any_time, duration);
  rain.stays = read_number(table, "stays", {.low = 0.0, .high = 1.0, .meaning = "part of the water that stays"}, 0.0);
  rain.runs_off =
      read_number(table, "runs_off", {.low = 0.0, .low_allowed = false, .meaning = "a time in seconds"}, 1.0);
  rain.seed = read_seed(table);
  return rain;
}

Hand read_hand(TomlTable& table, const NamedFiles& files) {
  Hand hand;
  read_patch(table, hand.at, hand.radius);
  hand.stiffness = read_number(table, "stiffness", {.low = 0.0, .meaning = "in newtons a metre"}, 0.0);
  read_span(table, hand.from, hand.until);
  hand.motion = read_motion(table, files);
  hand.path = read_key_frames(table, "path", "at");
  if (hand.motion.empty() == hand.path.empty())
    table.context().complain(
        table.key(), hand.path.empty() ? "a hand without `motion` and `path`" : "a hand with `motion` and `path`",
        "one of them: how it moves since it took hold, or where it is");
  return hand;
}

using Led = ProbeFacts::Led;

/// What of a probe's path a key of the file or the header of a table names.
struct PathForm {
  Led led;
  const char* key;     // of `path`
  const char* header;  // of a table
  int numbers;         // of a line, beside its time
};
constexpr PathForm path_forms[] = {{Led::Displacement, "shift", "time,x,y,z", 3},
                                   {Led::Displacement, "shift", "time,x,y,z,turn_x,turn_y,turn_z", 6},
                                   {Led::Depth, "depth", "time,depth", 1},
                                   {Led::Force, "force", "time,fx,fy,fz", 3},
                                   {Led::Push, "push", "time,push", 1}};

/// Keys such as { time = 1, depth = 0.01, turn_deg = [0, 0, 10] }, all of one form.
void read_path_keys(TomlTable& table, ProbeFacts& probe) {
  const PathForm* form = nullptr;
  table.each_block("path", [&](TomlTable& block) {
    KeyFrames<6>::Key key{read_number(block, "time", any_time), KeyFrames<6>::Value::Zero()};
    key.value.tail<3>() = degree * block.optional<Vector3>("turn_deg").value_or(Vector3::Zero());
    int count = 0;
    for (const PathForm& f : path_forms) {
      if (f.numbers == 6 || !block.has(f.key)) continue;
      if (f.numbers == 1)
        key.value[0] = read_number(block, f.key, {});
      else
        key.value.head<3>() = block.required<Vector3>(f.key).value_or(Vector3::Zero());
      if (form && form != &f)
        block.context().complain(block.key_of(f.key), std::string("a path by `") + form->key + "` and `" + f.key + "`",
                                 "one of them throughout", "lead another probe by the other");
      form = &f, ++count;
    }
    if (count != 1)
      block.context().complain(block.key(), fmt::format("a key of a path with {} of them", count),
                               "one of `shift`, `depth` [m], `force`, `push` [N]");
    probe.path.push_back(key);
  });
  if (form) probe.led = form->led;
  check_times(table, "path", probe.path);
}

/// A path as a table: see `path_forms`.
void read_path_file(const std::filesystem::path& file, ProbeFacts& probe) {
  std::vector<KeyTable> tables;
  for (const PathForm& f : path_forms) tables.push_back({f.header, f.numbers});
  probe.led = path_forms[read_key_table(file, tables, probe.path)].led;
}

ProbeFacts read_probe(TomlTable& table, const NamedFiles& files) {
  ProbeFacts probe;
  const std::string kind = read_choice(table, "kind", {"disc", "punch", "ball", "capsule", "mesh"});
  probe.kind = kind == "disc"      ? ProbeKind::BondedDisc
               : kind == "punch"   ? ProbeKind::Punch
               : kind == "ball"    ? ProbeKind::Ball
               : kind == "capsule" ? ProbeKind::Capsule
                                   : ProbeKind::Shape;
  probe.at = table.required<Vector3>("at", "where it touches the surface at rest, in metres").value_or(Vector3::Zero());
  if (table.has("axis")) probe.axis = read_direction(table, "axis");
  if (probe.kind != ProbeKind::Shape) probe.radius = read_number(table, "radius", positive_metres);
  if (probe.kind == ProbeKind::Capsule) {
    probe.rod =
        table.required<Vector3>("rod", "from the centre of one end to that of the other").value_or(Vector3::UnitX());
    if (!(probe.rod.norm() > 0.0))
      table.context().complain(table.key_of("rod"), "a capsule without length", "its two ends apart", "or use a ball");
  }
  if (probe.kind == ProbeKind::Shape)
    if (const auto file = read_path(table, "mesh", files))
      read_file_of(table, "mesh", *file, [&](const auto& path) { probe.mesh = read_surface(path); });
  if (const auto file = read_optional_path(table, "path_file", files)) {
    read_file_of(table, "path_file", *file, [&](const auto& path) { read_path_file(path, probe); });
    if (table.has("path"))
      table.context().complain(table.key_of("path"), "`path` and `path_file`", "one of them: how the probe is led");
  } else if (!table.has("path_file")) {
    read_path_keys(table, probe);
    if (probe.path.empty() && !table.has("path"))
      table.context().complain(table.key(), "a probe without `path` and `path_file`", "one of them: how it is led");
  }
  return probe;
}

}  // namespace

Situation read_situation(const std::filesystem::path& path) {
  const toml::table parsed = parse_toml(read_file(path), path);
  TomlContext context{TomlPlaces(path), {}, {}};
  TomlTable root(parsed, "", context);
  check_format(root, "situation/1");
  const NamedFiles files{path.parent_path()};
  Situation s;
  s.file = path;
  s.duration = read_number(
      root, "duration", {.low = 0.0, .high = 3600.0, .low_allowed = false, .meaning = "a time in seconds"}, s.duration);
  s.frame_rate = read_number(
      root, "frame_rate", {.low = 0.0, .high = 1e5, .low_allowed = false, .meaning = "frames a second"}, s.frame_rate);
  s.keeps_held = root.optional<bool>("held").value_or(true);
  s.settles = root.optional<bool>("settle");
  s.gravity = read_key_frames(root, "gravity", "value");
  if (root.has("plane")) s.planes.emplace();
  root.each_block("plane", [&](TomlTable& block) { s.planes->push_back(read_plane(block)); });
  root.with_table("initial", [&](TomlTable& table) {
    s.pose.translation = table.optional<Vector3>("shift").value_or(Vector3::Zero());
    s.pose.rotation = rotation_of(degree * table.optional<Vector3>("turn_deg").value_or(Vector3::Zero()));
    s.linear_velocity = table.optional<Vector3>("linear_velocity").value_or(Vector3::Zero());
    s.angular_velocity = table.optional<Vector3>("angular_velocity").value_or(Vector3::Zero());
  });
  root.with_table("wind", [&](TomlTable& table) { s.wind = read_wind(table, false); });
  root.each_block("rain", [&](TomlTable& table) { s.rains.push_back(read_rain(table, s.duration)); });
  root.each_block("force", [&](TomlTable& table) { s.forces.push_back(read_force(table, false)); });
  root.each_block("hand", [&](TomlTable& table) { s.hands.push_back(read_hand(table, files)); });
  root.each_block("led", [&](TomlTable& table) { s.led.push_back(read_led(table, files)); });
  if (root.has("obstacle")) s.obstacles.emplace();
  root.each_block("obstacle", [&](TomlTable& table) { s.obstacles->push_back(read_obstacle(table, files, false)); });
  root.each_block("probe", [&](TomlTable& table) { s.probes.push_back(read_probe(table, files)); });
  root.each_block("copy", [&](TomlTable& table) {
    ObjectCopy copy;
    copy.shift = table.required<Vector3>("shift").value_or(Vector3::Zero());
    copy.delay = read_number(table, "delay", any_time, 0.0);
    s.copies.push_back(copy);
  });
  root.finish();
  context.throw_problems();
  return s;
}

}  // namespace pliant
