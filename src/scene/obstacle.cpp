#include "scene/obstacle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "base/csv.hpp"
#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "geometry/solid_surface.hpp"
#include "geometry/surface_distance.hpp"
#include "scene/region.hpp"
#include "scene/scene_toml.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double degree = std::numbers::pi / 180.0;
constexpr KeyTable motion_tables[] = {{"time,x,y,z", 3}, {"time,x,y,z,turn_x,turn_y,turn_z", 6}};

const NumberRule positive_metres{.low = 0.0, .low_allowed = false, .meaning = "a length in metres"};
const NumberRule any_time{.meaning = "a time in seconds"};

std::string mesh_name(std::size_t number) { return fmt::format("obstacle_{}.ply", number); }
std::string vertices_name(std::size_t number) { return fmt::format("led_{}.txt", number); }

void write_motion(std::ostream& out, const std::vector<KeyFrames<6>::Key>& keys) {
  if (keys.empty()) return;
  out << "motion = [";
  for (std::size_t k = 0; k < keys.size(); ++k)
    out << (k > 0 ? ", " : " ") << "{ time = " << toml_text(keys[k].time)
        << ", shift = " << toml_text(Vector3(keys[k].value.head<3>()))
        << ", turn_deg = " << toml_text(Vector3(keys[k].value.tail<3>() / degree)) << " }";
  out << " ]\n";
}

std::string shape_text(const RigidObstacle& obstacle, const std::string& mesh_file) {
  if (const auto* ball = std::get_if<ShapeBall>(&obstacle.shape))
    return "ball = { centre = " + toml_text(ball->centre) + ", radius = " + toml_text(ball->radius) + " }\n";
  if (const auto* rod = std::get_if<ShapeCapsule>(&obstacle.shape))
    return "capsule = { from = " + toml_text(rod->from) + ", to = " + toml_text(rod->to) +
           ", radius = " + toml_text(rod->radius) + " }\n";
  if (const auto* box = std::get_if<ShapeBox>(&obstacle.shape))
    return "box = { min = " + toml_text(box->min) + ", max = " + toml_text(box->max) + " }\n";
  if (const auto* plane = std::get_if<ShapePlane>(&obstacle.shape))
    return "plane = { point = " + toml_text(plane->point) + ", normal = " + toml_text(plane->normal) + " }\n";
  return "mesh = " + toml_text(mesh_file) + "\n";
}

}  // namespace

Box box_of(const RigidObstacle& obstacle) {
  if (const auto* ball = std::get_if<ShapeBall>(&obstacle.shape))
    return grown({ball->centre, ball->centre}, ball->radius);
  if (const auto* rod = std::get_if<ShapeCapsule>(&obstacle.shape))
    return grown({rod->from.cwiseMin(rod->to), rod->from.cwiseMax(rod->to)}, rod->radius);
  if (const auto* box = std::get_if<ShapeBox>(&obstacle.shape)) return {box->min, box->max};
  if (const auto* plane = std::get_if<ShapePlane>(&obstacle.shape)) return {plane->point, plane->point};
  return bounding_box(std::get<ShapeMesh>(obstacle.shape).mesh);
}

KeyedMotion keyed_motion(const Vector3& centre, const std::vector<KeyFrames<6>::Key>& keys) {
  return keys.empty() ? KeyedMotion() : KeyedMotion(centre, KeyFrames<6>(keys));
}

KeyedMotion motion_of(const RigidObstacle& obstacle) {
  const Box box = box_of(obstacle);
  return keyed_motion(0.5 * (box.min + box.max), obstacle.motion);
}

KeyedMotion motion_of(const LedRegion& led, const TriangleMesh& surface) {
  const Box own = bounding_box(surface);
  Box box;
  if (const auto* held = std::get_if<RegionBox>(&led.region))
    box = {held->min.cwiseMax(own.min), held->max.cwiseMin(own.max)};
  else if (const auto* sphere = std::get_if<RegionSphere>(&led.region))
    box = {sphere->centre, sphere->centre};
  else
    for (int v = 0; v < int(surface.vertices.size()); ++v)
      if (contains_vertex(led.region, surface, v)) box.extend(surface.vertices[std::size_t(v)]);
  return keyed_motion(0.5 * (box.min + box.max), led.motion);
}

std::function<double(const Vector3&)> distance_to(const RigidObstacle& obstacle) {
  if (const auto* ball = std::get_if<ShapeBall>(&obstacle.shape))
    return [ball = *ball](const Vector3& p) { return (p - ball.centre).norm() - ball.radius; };
  if (const auto* rod = std::get_if<ShapeCapsule>(&obstacle.shape))
    return [rod = *rod](const Vector3& p) {
      const Vector3 along = rod.to - rod.from;
      const double t = std::clamp((p - rod.from).dot(along) / std::max(along.squaredNorm(), 1e-300), 0.0, 1.0);
      return (p - rod.from - t * along).norm() - rod.radius;
    };
  if (const auto* box = std::get_if<ShapeBox>(&obstacle.shape))
    return [box = *box](const Vector3& p) {
      const Vector3 outside = (box.min - p).cwiseMax(p - box.max);
      return outside.cwiseMax(0.0).norm() + std::min(0.0, outside.maxCoeff());
    };
  if (const auto* plane = std::get_if<ShapePlane>(&obstacle.shape))
    return [plane = *plane](const Vector3& p) { return plane.normal.dot(p - plane.point); };
  return SurfaceDistance(std::get<ShapeMesh>(obstacle.shape).mesh);
}

double greatest_depth(const RigidObstacle& obstacle, std::span<const Vector3> points) {
  const auto distance = distance_to(obstacle);
  const auto* shape = std::get_if<ShapeMesh>(&obstacle.shape);
  const Box box = box_of(obstacle);
  double depth = 0.0;
  for (const Vector3& p : points) {
    if (shape && ((p.array() < box.min.array()).any() || (p.array() > box.max.array()).any())) continue;
    const bool is_inside = !shape || winding_number(shape->mesh, p) > 0.5;
    if (is_inside) depth = std::max(depth, shape ? distance(p) : -distance(p));
  }
  return depth;
}

TriangleMesh surface_of(const RigidObstacle& obstacle) {
  constexpr int subdivisions = 4;
  constexpr double spacings = 40.0;  // along a capsule
  if (std::holds_alternative<ShapePlane>(obstacle.shape)) return {};
  if (const auto* shape = std::get_if<ShapeMesh>(&obstacle.shape)) return shape->mesh;
  const Box box = box_of(obstacle);
  if (const auto* rod = std::get_if<ShapeCapsule>(&obstacle.shape)) {
    const double spacing = std::min(box.extent().maxCoeff() / spacings, 0.25 * rod->radius);
    return make_level_surface(distance_to(obstacle), grown(box, 2.0 * spacing), spacing);
  }
  const auto* ball = std::get_if<ShapeBall>(&obstacle.shape);
  TriangleMesh mesh = ball ? make_sphere(ball->radius, subdivisions) : make_box(box.extent(), box.extent().maxCoeff());
  for (Vector3& vertex : mesh.vertices) vertex += 0.5 * (box.min + box.max);
  return mesh;
}

std::size_t read_key_table(const fs::path& file, std::span<const KeyTable> forms,
                           std::vector<KeyFrames<6>::Key>& keys) {
  const std::string text = read_file(file);
  std::string header = text.substr(0, text.find_first_of("\r\n"));
  std::erase(header, ' ');
  const auto form = std::ranges::find(forms, header, &KeyTable::header);
  if (form == forms.end()) {
    std::string known;
    for (const KeyTable& f : forms) known += fmt::format("{}`{}`", known.empty() ? "" : ", ", f.header);
    throw InputError({{file, 1, 1}, "the header `" + header + "`", "one of " + known, "metres, newtons and degrees"});
  }
  std::vector<Problem> problems;
  read_csv(file, form->header, problems, [&](CsvRow& row) {
    KeyFrames<6>::Key key{row.number(0).value_or(0.0), KeyFrames<6>::Value::Zero()};
    for (int k = 0; k < form->numbers; ++k) key.value[k] = row.number(std::size_t(k) + 1).value_or(0.0);
    key.value.tail<3>() *= degree;
    if (!keys.empty() && !(key.time > keys.back().time))
      row.complain(0, fmt::format("{} s after {} s", key.time, keys.back().time),
                   "times that increase from line to line", "put the lines in order");
    keys.push_back(key);
  });
  if (!problems.empty()) throw InputError(problems);
  return std::size_t(form - forms.begin());
}

std::vector<KeyFrames<6>::Key> read_motion(TomlTable& owner, const NamedFiles& files) {
  std::vector<KeyFrames<6>::Key> keys;
  std::vector<double> times;
  owner.each_block("motion", [&](TomlTable& block) {
    KeyFrames<6>::Key key{read_number(block, "time", any_time), {}};
    key.value.head<3>() = block.optional<Vector3>("shift").value_or(Vector3::Zero());
    key.value.tail<3>() = degree * block.optional<Vector3>("turn_deg").value_or(Vector3::Zero());
    times.push_back(key.time), keys.push_back(key);
  });
  check_key_times(owner, "motion", times);
  if (const auto file = read_optional_path(owner, "motion_file", files)) {
    if (owner.has("motion"))
      owner.context().complain(owner.key_of("motion_file"), "`motion` and `motion_file`", "one of them");
    read_file_of(owner, "motion_file", *file, [&](const fs::path& path) { read_key_table(path, motion_tables, keys); });
  }
  return keys;
}

void read_span(TomlTable& table, double& from, double& until) {
  from = read_number(table, "from", any_time, -infinite);
  until = read_number(table, "until", any_time, infinite);
  if (!(from < until))
    table.context().complain(table.key_of("until"), fmt::format("`until` is {} s, and `from` is {} s", until, from),
                             "an end after the beginning");
}

LedRegion read_led(TomlTable& block, const NamedFiles& files) {
  LedRegion led{RegionBox{}};
  if (auto region = read_region(block, files)) led.region = std::move(*region);
  read_span(block, led.from, led.until);
  led.motion = read_motion(block, files);
  return led;
}

RigidObstacle read_obstacle(TomlTable& block, const NamedFiles& files, bool may_be_unknown) {
  RigidObstacle obstacle{ShapeBall{Vector3::Zero(), 1.0}};
  int count = 0;
  block.with_table("ball", [&](TomlTable& t) {
    const Vector3 centre = t.required<Vector3>("centre").value_or(Vector3::Zero());
    obstacle.shape = ShapeBall{centre, read_number(t, "radius", positive_metres)}, ++count;
  });
  block.with_table("capsule", [&](TomlTable& t) {
    const Vector3 from = t.required<Vector3>("from").value_or(Vector3::Zero()),
                  to = t.required<Vector3>("to").value_or(Vector3::Zero());
    obstacle.shape = ShapeCapsule{from, to, read_number(t, "radius", positive_metres)}, ++count;
  });
  block.with_table("box", [&](TomlTable& t) {
    const Vector3 min = t.required<Vector3>("min").value_or(Vector3::Zero()),
                  max = t.required<Vector3>("max").value_or(Vector3::Ones());
    if (!(max.array() > min.array()).all())
      t.context().complain(t.key(), "a box whose `min` does not lie below its `max`", "min < max on each axis",
                           "swap them");
    obstacle.shape = ShapeBox{min, max}, ++count;
  });
  block.with_table("plane", [&](TomlTable& t) {
    const Vector3 point = t.required<Vector3>("point").value_or(Vector3::Zero());
    obstacle.shape = ShapePlane{point, read_direction(t, "normal").value_or(Vector3::UnitY())}, ++count;
  });
  if (const auto file = read_optional_path(block, "mesh", files)) {
    ShapeMesh shape{*file, {}};
    read_file_of(block, "mesh", *file, [&](const fs::path& path) {
      shape.mesh = read_surface(path);
      const MeshReport report = examine(shape.mesh);
      if (!report.is_closed_solid)
        block.context().reject(block.key_of("mesh"), report.complaints.front(),
                               "a closed surface of the rigid body, facing outwards", report.cure);
    });
    obstacle.shape = std::move(shape), ++count;
  } else if (block.has("mesh")) {
    ++count;
  }
  if (count != 1)
    block.context().complain(block.key(), fmt::format("an obstacle of {} shapes", count),
                             "one of `ball`, `capsule`, `box`, `plane`, `mesh`");
  obstacle.knows_friction = !may_be_unknown || block.has("friction");
  obstacle.friction =
      read_number(block, "friction", {.low = 0.0, .high = 5.0, .meaning = "Coulomb's coefficient"}, 0.0);
  obstacle.motion = read_motion(block, files);
  return obstacle;
}

void write_obstacle_blocks(std::ostream& out, const Scene& scene) {
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    const RigidObstacle& obstacle = scene.obstacles[i];
    out << "[[obstacle]]\n" << shape_text(obstacle, mesh_name(i));
    if (obstacle.knows_friction) out << "friction = " << toml_text(obstacle.friction) << "   # Coulomb's coefficient\n";
    write_motion(out, obstacle.motion);
    out << "\n";
  }
  for (std::size_t i = 0; i < scene.led.size(); ++i) {
    const LedRegion& led = scene.led[i];
    out << "[[led]]\n";
    write_region(out, led.region, vertices_name(i));
    if (led.from > -infinite) out << "from = " << toml_text(led.from) << "   # s\n";
    if (led.until < infinite) out << "until = " << toml_text(led.until) << "   # s\n";
    write_motion(out, led.motion);
    out << "\n";
  }
}

void write_obstacle_files(const fs::path& folder, const Scene& scene) {
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i)
    if (const auto* shape = std::get_if<ShapeMesh>(&scene.obstacles[i].shape))
      write_mesh(folder / mesh_name(i), shape->mesh);
  for (std::size_t i = 0; i < scene.led.size(); ++i) write_region_file(folder / vertices_name(i), scene.led[i].region);
}

}  // namespace pliant
