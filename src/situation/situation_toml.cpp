#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "base/csv.hpp"
#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
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

/// Keys of a rigid motion: { time = 0, shift = [0, 0.1, 0], turn_deg = [0, 90, 0] }.
std::vector<KeyFrames<6>::Key> read_motion(TomlTable& owner) {
  std::vector<KeyFrames<6>::Key> keys;
  owner.each_block("motion", [&](TomlTable& block) {
    KeyFrames<6>::Key key{read_number(block, "time", any_time), {}};
    key.value.head<3>() = block.optional<Vector3>("shift").value_or(Vector3::Zero());
    key.value.tail<3>() = degree * block.optional<Vector3>("turn_deg").value_or(Vector3::Zero());
    keys.push_back(key);
  });
  check_times(owner, "motion", keys);
  return keys;
}

void read_span(TomlTable& table, double& from, double& until) {
  from = read_number(table, "from", any_time, -infinite);
  until = read_number(table, "until", any_time, infinite);
  if (!(from < until))
    table.context().complain(table.key_of("until"), fmt::format("`until` is {} s, and `from` is {} s", until, from),
                             "an end after the beginning");
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

Hand read_hand(TomlTable& table) {
  Hand hand;
  read_patch(table, hand.at, hand.radius);
  hand.stiffness = read_number(table, "stiffness", {.low = 0.0, .meaning = "in newtons a metre"}, 0.0);
  read_span(table, hand.from, hand.until);
  hand.motion = read_motion(table);
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
  const std::string text = read_file(file);
  std::string header = text.substr(0, text.find_first_of("\r\n"));
  std::erase(header, ' ');
  const auto form = std::ranges::find(path_forms, header, &PathForm::header);
  std::vector<Problem> problems;
  if (form == std::end(path_forms)) {
    std::string known;
    for (const PathForm& f : path_forms) known += fmt::format("{}`{}`", known.empty() ? "" : ", ", f.header);
    throw InputError({{file, 1, 1}, "the header `" + header + "`", "one of " + known, "metres, newtons and degrees"});
  }
  probe.led = form->led;
  read_csv(file, form->header, problems, [&](CsvRow& row) {
    KeyFrames<6>::Key key{row.number(0).value_or(0.0), KeyFrames<6>::Value::Zero()};
    for (int k = 0; k < form->numbers; ++k) key.value[k] = row.number(std::size_t(k) + 1).value_or(0.0);
    key.value.tail<3>() *= degree;
    if (!probe.path.empty() && !(key.time > probe.path.back().time))
      row.complain(0, fmt::format("{} s after {} s", key.time, probe.path.back().time),
                   "times that increase from line to line", "put the lines in order");
    probe.path.push_back(key);
  });
  if (!problems.empty()) throw InputError(problems);
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
      read_file_of(table, "mesh", *file, [&](const auto& path) { probe.mesh = read_mesh(path); });
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

LedRegion read_led(TomlTable& table, const NamedFiles& files) {
  LedRegion led{RegionBox{}, -infinite, infinite, {}};
  if (const auto region = read_region(table, files)) led.region = *region;
  read_span(table, led.from, led.until);
  led.motion = read_motion(table);
  return led;
}

RigidObstacle read_obstacle(TomlTable& table, const NamedFiles& files) {
  RigidObstacle obstacle{ShapeBall{Vector3::Zero(), 1.0}, 0.0, {}};
  int count = 0;
  table.with_table("ball", [&](TomlTable& t) {
    const Vector3 centre = t.required<Vector3>("centre").value_or(Vector3::Zero());
    obstacle.shape = ShapeBall{centre, read_number(t, "radius", positive_metres)}, ++count;
  });
  table.with_table("capsule", [&](TomlTable& t) {
    const Vector3 from = t.required<Vector3>("from").value_or(Vector3::Zero()),
                  to = t.required<Vector3>("to").value_or(Vector3::Zero());
    obstacle.shape = ShapeCapsule{from, to, read_number(t, "radius", positive_metres)}, ++count;
  });
  table.with_table("box", [&](TomlTable& t) {
    const Vector3 min = t.required<Vector3>("min").value_or(Vector3::Zero()),
                  max = t.required<Vector3>("max").value_or(Vector3::Ones());
    if (!(max.array() > min.array()).all())
      t.context().complain(t.key(), "a box whose `min` does not lie below its `max`", "min < max on each axis",
                           "swap them");
    obstacle.shape = ShapeBox{min, max}, ++count;
  });
  table.with_table("plane", [&](TomlTable& t) {
    const Vector3 point = t.required<Vector3>("point").value_or(Vector3::Zero());
    obstacle.shape = ShapePlane{point, read_direction(t, "normal").value_or(Vector3::UnitY())}, ++count;
  });
  if (const auto file = read_optional_path(table, "mesh", files)) {
    ShapeMesh shape{*file, {}};
    read_file_of(table, "mesh", *file, [&](const auto& path) { shape.mesh = read_mesh(path); });
    obstacle.shape = std::move(shape), ++count;
  } else if (table.has("mesh")) {
    ++count;
  }
  if (count != 1)
    table.context().complain(table.key(), fmt::format("an obstacle of {} shapes", count),
                             "one of `ball`, `capsule`, `box`, `plane`, `mesh`");
  obstacle.friction =
      read_number(table, "friction", {.low = 0.0, .high = 5.0, .meaning = "Coulomb's coefficient"}, 0.0);
  obstacle.motion = read_motion(table);
  return obstacle;
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
  root.each_block("hand", [&](TomlTable& table) { s.hands.push_back(read_hand(table)); });
  root.each_block("led", [&](TomlTable& table) { s.led.push_back(read_led(table, files)); });
  root.each_block("obstacle", [&](TomlTable& table) { s.obstacles.push_back(read_obstacle(table, files)); });
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
