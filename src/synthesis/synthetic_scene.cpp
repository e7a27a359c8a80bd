#include "synthesis/synthetic_scene.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <stdexcept>

#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "rays/look_at.hpp"
#include "scene/region.hpp"
#include "scene/scene_toml.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr double degree = std::numbers::pi / 180.0;

NumberRule positive(const char* meaning) { return {.low = 0.0, .low_allowed = false, .meaning = meaning}; }
NumberRule at_least_zero(const char* meaning) { return {.low = 0.0, .meaning = meaning}; }
NumberRule part(const char* meaning) { return {.low = 0.0, .high = 1.0, .meaning = meaning}; }

class Reader {
 public:
  Reader(const fs::path& folder, TomlContext& context) : files_{folder}, context_(context) {}

  SyntheticScene read(const toml::table& table) {
    scene_.scene.object.surface.emplace();
    TomlTable root(table, "", context_);
    check_format(root, "scene/1");
    scene_.name = root.required<std::string>("name", "give the recording a name").value_or("");
    scene_.seed = std::uint64_t(read_count(root, "seed", 0, 2'000'000'000, 1));
    scene_.write_trajectory = root.optional<bool>("truth_trajectory").value_or(false);
    read_table(root, "object", &Reader::read_object);
    has_controls_ = root.has("control");
    read_table(root, "material", &Reader::read_material);
    read_table(root, "world", &Reader::read_gravity);
    read_table(root, "timing", &Reader::read_frames);
    read_table(root, "simulation", &Reader::read_simulation);
    root.with_table("initial", [&](TomlTable& initial) { read_start(initial); });
    root.each_block("plane", [&](TomlTable& block) { read_scenery(block); });
    root.each_block("fixed", [&](TomlTable& block) { scene_.scene.fixed.push_back(read_fixed(block, files_)); });
    root.each_block("region", [&](TomlTable& block) {
      read_part_modulus(block);
      scene_.scene.regions.push_back(read_material_region(block, files_));
    });
    root.each_block("control", [&](TomlTable& block) {
      read_part_modulus(block);
      scene_.scene.controls.push_back(read_material_control(block, files_));
    });
    root.each_block("weight", [&](TomlTable& block) { read_hung(block); });
    root.with_table("wind", [&](TomlTable& wind) { scene_.scene.wind = read_wind(wind, true); });
    root.each_block("force", [&](TomlTable& block) { scene_.scene.forces.push_back(read_force(block, true)); });
    root.each_block("camera", [&](TomlTable& block) { scene_.cameras.push_back(read_camera(block)); });
    if (scene_.cameras.empty() && !root.has("camera"))
      context_.complain("camera", "no camera", "a block [[camera]]", "a recording needs at least one");
    check_names();
    check_vertex_lists(context_, scene_.scene);
    check_materials(context_, scene_.scene);
    root.finish();
    return std::move(scene_);
  }

 private:
  void read_table(TomlTable& root, const std::string& name, void (Reader::*read_it)(TomlTable&)) {
    root.with_table(
        name, [&](TomlTable& table) { (this->*read_it)(table); }, "[" + name + "]", "see docs/scene.md");
  }

  // ---- the object

  void read_object(TomlTable& object) {
    int shapes = 0;
    for (const char* name : {"surface", "torus", "box", "sphere"}) shapes += object.has(name);
    if (shapes != 1)
      context_.reject("object", shapes == 0 ? "no shape" : std::to_string(shapes) + " shapes",
                      "one of `surface`, `torus`, `box`, `sphere`");
    if (object.has("surface")) read_surface(object);
    if (auto torus = object.table("torus")) read_torus(*torus);
    if (auto box = object.table("box")) read_box(*box);
    if (auto sphere = object.table("sphere")) read_sphere(*sphere);
    place(object);
    scene_.scan_noise = read_number(object, "scan_noise", at_least_zero("in metres"), 0.0);
    require_mass_or_density(object);
    if (object.has("mass")) scene_.scene.object.mass = read_number(object, "mass", positive("in kilograms"));
    if (object.has("density")) scene_.scene.object.density = read_number(object, "density", positive("in kg/m^3"));
  }

  void read_surface(TomlTable& object) {
    const auto file = read_path(object, "surface", files_);
    if (!file) return;
    read_file_of(object, "surface", *file, [&](const fs::path& path) {
      surface() = read_mesh(path);
      const MeshReport report = examine(surface());
      if (!report.is_closed_solid)
        context_.reject("object.surface", report.complaints.empty() ? "an open surface" : report.complaints.front(),
                        "a closed surface");
    });
  }

  TriangleMesh& surface() { return *scene_.scene.object.surface; }

  // Ranges that are not told by the table's rules are told by the generator.
  template <class Make>
  void generate(TomlTable& table, const Make& make) {
    table.finish();
    if (!context_.is_sound(table.key())) return;
    try {
      surface() = make();
    } catch (const std::invalid_argument& error) {
      context_.reject(table.key(), error.what(), "sensible sizes");
    }
  }

  void read_torus(TomlTable& t) {
    const double ring = read_number(t, "ring_radius", positive("in metres")),
                 tube = read_number(t, "tube_radius", positive("in metres"));
    const int ring_segments = read_count(t, "ring_segments", 3, 4096, 96),
              tube_segments = read_count(t, "tube_segments", 3, 4096, 48);
    generate(t, [&] { return make_torus(ring, tube, ring_segments, tube_segments); });
  }

  void read_box(TomlTable& t) {
    const Vector3 size = t.required<Vector3>("size", "edge lengths in metres").value_or(Vector3::Ones());
    const double facet =
        read_number(t, "facet", positive("in metres"), std::max(size.minCoeff() / 8.0, size.maxCoeff() / 1000.0));
    generate(t, [&] { return make_box(size, facet); });
  }

  void read_sphere(TomlTable& t) {
    const double radius = read_number(t, "radius", positive("in metres"));
    const int subdivisions = read_count(t, "subdivisions", 0, 8, 4);
    generate(t, [&] { return make_sphere(radius, subdivisions); });
  }

  void place(TomlTable& object) {
    RigidMotion pose = object.optional<RigidMotion>("pose").value_or(RigidMotion{});
    if (object.has("pose") && (object.has("translation") || object.has("axis") || object.has("angle_deg")))
      context_.reject("object.pose", "both `pose` and `translation`, `axis` or `angle_deg`", "one of the two ways");
    if (const auto shift = object.optional<Vector3>("translation")) pose.translation = *shift;
    const auto axis = object.optional<Vector3>("axis");
    const auto angle = object.optional<double>("angle_deg");
    if (object.has("axis") != object.has("angle_deg") || (axis && axis->norm() < 1e-9))
      context_.reject("object", "a rotation without a proper axis and angle", "`axis` with a length, and `angle_deg`");
    else if (axis && angle)
      pose.rotation = Eigen::AngleAxisd(*angle * degree, axis->normalized()).toRotationMatrix();
    for (Vector3& vertex : surface().vertices) vertex = pose(vertex);
  }

  // ---- physics

  void read_material(TomlTable& t) {
    if (!has_controls_) scene_.youngs_modulus = read_number(t, "youngs_modulus", positive("in pascals"));
    scene_.poissons_ratio = read_number(
        t, "poissons_ratio",
        {.low = -1.0, .high = 0.5, .low_allowed = false, .high_allowed = false, .meaning = "0.3 is usual for foam"});
    scene_.mass_damping = read_number(t, "mass_damping", at_least_zero("Rayleigh's, in 1/s"), 0.0);
    scene_.stiffness_damping = read_number(t, "stiffness_damping", at_least_zero("in s"), 0.0);
    scene_.is_corotated = read_choice(t, "mean_strain", {"neo_hookean", "corotated"}) == "corotated";
    scene_.is_rayleigh = read_choice(t, "damping_law", {"kelvin_voigt", "rayleigh"}) == "rayleigh";
  }

  void read_gravity(TomlTable& t) { scene_.scene.world = read_world(t, true); }

  void read_frames(TomlTable& t) { scene_.scene.timing = read_even_timing(t, 100'000); }

  void read_simulation(TomlTable& t) {
    scene_.cell_size = read_number(t, "cell_size", positive("in metres"));
    scene_.substeps = read_count(t, "substeps", 1, 100'000, 4);
    scene_.newmark_theta =
        read_number(t, "newmark_theta", {.low = 0.5, .high = 1.0, .meaning = "0.5 does not damp by itself"}, 0.5);
    scene_.contact_stiffness = read_number(t, "contact_stiffness", at_least_zero("in Pa/m"), 0.0);
    scene_.contact_smoothing = read_number(t, "contact_smoothing", at_least_zero("in metres"), 0.0);
  }

  void read_start(TomlTable& table) {
    Initial& initial = scene_.scene.initial;
    initial = read_initial(table);
    if (initial.released != initial.release_of.has_value())
      context_.reject("initial", "only one of `released` and `release_of`", "both, or neither",
                      "a released object begins at its equilibrium under a weight whose string is cut");
    if (initial.release_of) check_weight("initial.release_of", *initial.release_of);
  }

  void read_scenery(TomlTable& block) {
    scene_.plane_half_sizes.push_back(read_number(block, "half_size", at_least_zero("in metres"), 1.0));
    scene_.scene.planes.push_back(read_plane(block));
  }

  void read_part_modulus(TomlTable& block) {
    scene_.part_moduli.push_back(read_number(block, "youngs_modulus", positive("in pascals")));
  }

  void read_hung(TomlTable& block) {
    scene_.scene.weights.push_back(read_weight(block));
    check_weight(block.key(), scene_.scene.weights.back());
  }

  void check_weight(const std::string& key, const Weight& weight) {
    if (context_.is_sound(key) && !(weight.mass > 0.0))
      context_.reject(key + ".mass", fmt::format("`mass` is {}", weight.mass), "above 0", "in kilograms");
  }

  // ---- cameras

  SyntheticCamera read_camera(TomlTable& block) {
    SyntheticCamera camera;
    camera.name = block.required<std::string>("name", "its images go into a folder of that name").value_or("");
    if (camera.name.find_first_of("/\\%") != std::string::npos || camera.name.starts_with('.'))
      context_.reject(block.key_of("name"), "the name \"" + camera.name + "\"", "a name that can be a folder");
    const int width = read_count(block, "width", 1, 8192), height = read_count(block, "height", 1, 8192);
    if (block.has("eye") == block.has("camera_to_world"))
      context_.reject(block.key(), "no single pose",
                      "`eye`, `target` and `vertical_fov_deg`, or `camera_to_world` with fx, fy, cx, cy");
    else
      camera.camera = block.has("eye") ? read_look_at(block, width, height) : read_pinhole(block, width, height);
    camera.depth_scale = read_number(block, "depth_scale", positive("raw units per metre"), 1000.0);
    camera.every = read_count(block, "every", 1, 100'000, 1);
    block.with_table("sensor", [&](TomlTable& sensor) { camera.sensor = read_sensor(sensor); });
    return camera;
  }

  Vector3 gravity() const { return scene_.scene.world.gravity.value_or(Vector3::Zero()); }

  PinholeCamera read_look_at(TomlTable& block, int width, int height) {
    const Vector3 eye = block.required<Vector3>("eye").value_or(Vector3::Zero());
    const Vector3 target = block.required<Vector3>("target").value_or(Vector3::UnitZ());
    const Vector3 up =
        block.optional<Vector3>("up").value_or(gravity().norm() > 0.0 ? Vector3(-gravity()) : Vector3::UnitY());
    const double angle =
        read_number(block, "vertical_fov_deg", {.low = 1.0, .high = 170.0, .meaning = "in degrees"}, 45.0);
    try {
      return look_at(eye, target, up, width, height, angle * degree);
    } catch (const std::invalid_argument& error) {
      context_.reject(block.key(), error.what(), "an eye apart from its target, and `up` across the view");
      return {};
    }
  }

  PinholeCamera read_pinhole(TomlTable& block, int width, int height) {
    PinholeCamera camera;
    camera.width = width, camera.height = height;
    camera.fx = read_number(block, "fx", positive("in pixels"));
    camera.fy = read_number(block, "fy", positive("in pixels"));
    camera.cx = read_number(block, "cx", {.meaning = "in pixels"}, 0.5 * (width - 1));
    camera.cy = read_number(block, "cy", {.meaning = "in pixels"}, 0.5 * (height - 1));
    camera.camera_to_world = block.required<RigidMotion>("camera_to_world").value_or(RigidMotion{});
    return camera;
  }

  SensorModel read_preset(TomlTable& t) {
    const std::string name = t.optional<std::string>("preset").value_or("ideal");
    try {
      return sensor_preset(name);
    } catch (const std::invalid_argument& error) {
      context_.reject(t.key_of("preset"), error.what(), fmt::format("one of {}", fmt::join(sensor_presets(), ", ")));
      return {};
    }
  }

  SensorModel read_sensor(TomlTable& t) {
    SensorModel s = read_preset(t);
    s.noise_base = read_number(t, "noise_base", at_least_zero("in metres"), s.noise_base);
    s.noise_growth = read_number(t, "noise_growth", at_least_zero("in 1/m"), s.noise_growth);
    s.noise_reference = read_number(t, "noise_reference", at_least_zero("in metres"), s.noise_reference);
    s.correlated_part = read_number(t, "correlated_part", part("of the variance"), s.correlated_part);
    s.correlation_length =
        read_number(t, "correlation_length", {.low = 0.0, .high = 50.0, .low_allowed = false, .meaning = "in pixels"},
                    s.correlation_length);
    s.step = read_number(t, "step", at_least_zero("in metres"), s.step);
    s.lateral_jitter = read_number(t, "lateral_jitter", at_least_zero("in pixels"), s.lateral_jitter);
    s.edge_loss = read_number(t, "edge_loss", part("a probability"), s.edge_loss);
    s.edge_flying = read_number(t, "edge_flying", part("a probability"), s.edge_flying);
    s.edge_jump = read_number(t, "edge_jump", positive("in metres"), s.edge_jump);
    s.grazing_angle = degree * read_number(t, "grazing_angle_deg", {.low = 0.0, .high = 90.0, .meaning = "in degrees"},
                                           s.grazing_angle / degree);
    s.hole_rate = read_number(t, "hole_rate", part("a probability"), s.hole_rate);
    return s;
  }

  void check_names() {
    for (size_t i = 0; i < scene_.cameras.size(); ++i)
      for (size_t j = 0; j < i; ++j)
        if (scene_.cameras[i].name == scene_.cameras[j].name)
          context_.reject(fmt::format("camera[{}].name", i), "two cameras called \"" + scene_.cameras[i].name + "\"",
                          "a name of its own");
  }

  NamedFiles files_;
  TomlContext& context_;
  SyntheticScene scene_;
  bool has_controls_ = false;
};

}  // namespace

double SyntheticScene::true_density() const {
  const Object& object = scene.object;
  return object.density ? *object.density : object.mass.value_or(0.0) / enclosed_volume(*object.surface);
}

std::vector<double> SyntheticScene::youngs_moduli() const {
  std::vector<double> moduli = part_moduli;
  if (scene.controls.empty()) moduli.insert(moduli.begin(), youngs_modulus);
  return moduli;
}

SyntheticScene read_synthetic_scene(const fs::path& path) {
  const toml::table table = parse_toml(read_file(path), path);
  TomlContext context{TomlPlaces(path), {}, {}};
  SyntheticScene scene = Reader(fs::absolute(path).parent_path(), context).read(table);
  context.throw_problems();
  return scene;
}

Synthesis synthesise(const SyntheticScene& scene, const Simulate& simulate) {
  Synthesis s;
  s.name = scene.name, s.scene = scene.scene, s.plane_half_sizes = scene.plane_half_sizes;
  s.scan_noise = scene.scan_noise, s.cameras = scene.cameras, s.seed = scene.seed;
  s.write_trajectory = scene.write_trajectory;
  s.truth = {{"poissons_ratio", scene.poissons_ratio, "1"},
             {"mass_damping", scene.mass_damping, "1/s"},
             {"stiffness_damping", scene.stiffness_damping, "s"},
             {"density", scene.true_density(), "kg/m^3"},
             {"gravity", *scene.scene.world.gravity, "m/s^2"},
             {"linear_velocity", scene.scene.initial.linear_velocity, "m/s"},
             {"angular_velocity", scene.scene.initial.angular_velocity, "rad/s"}};
  std::vector<std::string> names = named_moduli(scene.scene);
  if (names.empty()) names.emplace_back("youngs_modulus");
  const std::vector<double> moduli = scene.youngs_moduli();
  for (std::size_t i = 0; i < names.size(); ++i)
    s.truth.insert(s.truth.begin() + std::ptrdiff_t(i), {names[i], moduli[i], "Pa"});
  if (const auto& wind = scene.scene.wind) s.truth.push_back({"wind", wind->velocity, "m/s"});
  for (std::size_t k = 0; k < scene.scene.forces.size(); ++k)
    s.truth.push_back({fmt::format("strength@{}", k + 1), 1.0, "1"});
  s.trajectory = simulate(scene);
  if (int(s.trajectory.size()) != scene.scene.timing.frame_count())
    throw std::invalid_argument(fmt::format("synthesise: the simulation gave {} of {} frames", s.trajectory.size(),
                                            scene.scene.timing.frame_count()));
  return s;
}

}  // namespace pliant
