#include "synthesis/synthetic_scene.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "geometry/primitives.hpp"
#include "geometry/solid_surface.hpp"
#include "rays/look_at.hpp"
#include "scene/inner_body.hpp"
#include "scene/obstacle.hpp"
#include "scene/region.hpp"
#include "scene/scene_toml.hpp"
#include "synthesis/synthetic_markers.hpp"

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
    has_tests_ = root.has("press") || root.has("load") || root.has("indentation");
    read_table(root, "object", &Reader::read_object);
    has_controls_ = root.has("control");
    read_table(root, "material", &Reader::read_material);
    read_table(root, "world", &Reader::read_gravity);
    if (root.has("timing") || !has_tests_) read_table(root, "timing", &Reader::read_frames);
    read_table(root, "simulation", &Reader::read_simulation);
    root.with_table("initial", [&](TomlTable& initial) { read_start(initial); });
    root.each_block("plane", [&](TomlTable& block) { read_scenery(block); });
    root.each_block("fixed", [&](TomlTable& block) { scene_.scene.fixed.push_back(read_fixed(block, files_)); });
    root.each_block("obstacle",
                    [&](TomlTable& block) { scene_.scene.obstacles.push_back(read_obstacle(block, files_, true)); });
    root.each_block("led", [&](TomlTable& block) { scene_.scene.led.push_back(read_led(block, files_)); });
    root.each_block("inner", [&](TomlTable& block) { scene_.scene.inner.push_back(read_inner(block, files_)); });
    cut_out_inner_bodies(context_, scene_.scene);
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
    root.with_table("cloud", [&](TomlTable& cloud) { read_cloud(cloud); });
    root.with_table("markers", [&](TomlTable& markers) { read_markers(markers); });
    root.each_block("load", [&](TomlTable& block) { read_load(block); });
    root.each_block("press", [&](TomlTable& block) { read_press(block); });
    root.each_block("indentation", [&](TomlTable& block) { read_indentation(block); });
    if (!root.has("camera") && !root.has("markers") && !root.has("indentation"))
      context_.complain("camera", "no camera", "a block [[camera]], or [markers]", "a recording needs at least one");
    check_names();
    check_vertex_lists(context_, scene_.scene);
    check_materials(context_, scene_.scene);
    check_what_is_held(root);
    check_what_is_seen(root);
    settle_law(root);
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
    if (read_choice(object, "shape_is", {"reference", "static"}) == "static")
      scene_.scene.object.shape_is = ShapeIs::Static;
  }

  void read_surface(TomlTable& object) {
    const auto file = read_path(object, "surface", files_);
    if (!file) return;
    read_file_of(object, "surface", *file, [&](const fs::path& path) {
      surface() = pliant::read_surface(path);
      const MeshReport report = examine(surface());
      if (!report.is_closed_solid)
        context_.reject("object.surface", report.complaints.front(), "a closed surface", report.cure);
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
    if (!t.has("poissons_ratios")) scene_.poissons_ratio = read_number(t, "poissons_ratio", ratio_rule);
    law_name_ = read_choice(t, "law", {"neo_hookean", "linear", "ogden"});
    const bool is_corotated = read_choice(t, "mean_strain", {"neo_hookean", "corotated"}) == "corotated";
    if (law_name_ == "linear" || is_corotated) scene_.material.elastic = ElasticLaw::Corotated;
    own_numbers_.push_back(read_law_numbers(t, {scene_.poissons_ratio, {}, {}, {}}));
    scene_.mass_damping = read_number(t, "mass_damping", at_least_zero("Rayleigh's, in 1/s"), 0.0);
    scene_.stiffness_damping = read_number(t, "stiffness_damping", at_least_zero("in s"), 0.0);
    if (read_choice(t, "damping_law", {"kelvin_voigt", "rayleigh"}) == "rayleigh")
      scene_.material.damping = StiffnessDamping::Rayleigh;
  }

  void read_gravity(TomlTable& t) { scene_.scene.world = read_world(t, true); }

  void read_frames(TomlTable& t) {
    scene_.scene.timing = read_even_timing(t, 100'000);
    scene_.scene.timing.is_static = t.optional<bool>("static").value_or(false);
  }

  /// Of Ogden's law; what is not written is that of `otherwise`.
  SyntheticNumbers read_law_numbers(TomlTable& t, SyntheticNumbers otherwise) {
    SyntheticNumbers& numbers = otherwise;
    using List = std::vector<double>;
    for (const auto& [key, list] : {std::pair<const char*, List*>{"exponents", &numbers.exponents},
                                    {"stiffness_ratios", &numbers.stiffness_ratios},
                                    {"poissons_ratios", &numbers.poissons_ratios}})
      if (auto values = t.optional<List>(key)) {
        *list = std::move(*values);
        if (law_name_ != "ogden")
          context_.reject(t.key_of(key), "`" + std::string(key) + "` of a law without terms", "law = \"ogden\"",
                          "in [material]");
      }
    if (law_name_ != "ogden") return numbers;
    const std::size_t terms = numbers.exponents.size();
    const auto check = [&](bool good, const char* key, const std::string& expected) {
      if (!good && context_.is_sound(t.key()))
        context_.reject(t.key_of(key), "`" + std::string(key) + "` does not suit", expected, "see docs/scene.md");
    };
    check(terms >= 1 && terms <= 4 && std::ranges::none_of(numbers.exponents, [](double a) { return a == 0.0; }),
          "exponents", "one to four numbers, none of them 0");
    check(numbers.stiffness_ratios.size() + 1 == terms &&
              std::ranges::all_of(numbers.stiffness_ratios, [](double r) { return r > 0.0; }),
          "stiffness_ratios", "a number above 0 for each term but the first");
    const auto is_ratio = [](double nu) { return nu > -1.0 && nu < 0.5; };
    check((numbers.poissons_ratios.empty() || numbers.poissons_ratios.size() == terms) &&
              std::ranges::all_of(numbers.poissons_ratios, is_ratio),
          "poissons_ratios", "a number between -1 and 0.5 for each term");
    if (!numbers.poissons_ratios.empty()) numbers.poissons_ratio = numbers.poissons_ratios.front();
    return numbers;
  }

  /// What the parts' laws have of their own, and what elements that asks for.
  void settle_law(TomlTable& root) {
    const bool has_own = std::ranges::find(part_has_own_, true) != part_has_own_.end();
    const bool is_tested = root.has("press") || root.has("indentation");
    if (has_own || law_name_ == "ogden") {
      LawForm form;
      form.controls = int(scene_.youngs_moduli().size());
      form.terms = int(own_numbers_.front().exponents.size());
      form.laws = has_own ? form.controls : 1;
      form.own_ratios = !own_numbers_.front().poissons_ratios.empty();
      if (form.terms == 0) form.two_numbers = *scene_.material.of_mean_strain();
      scene_.law = form;
      scene_.law_numbers = own_numbers_;
      if (!has_own) scene_.law_numbers.resize(1);
      if (has_own && has_controls_) scene_.law_numbers.erase(scene_.law_numbers.begin());
      for (const SyntheticNumbers& numbers : scene_.law_numbers)
        if (numbers.exponents.size() != std::size_t(form.terms) || numbers.poissons_ratios.empty() == form.own_ratios)
          context_.reject("material", "laws of different forms", "as many terms everywhere",
                          "give each region as many `exponents` as [material]");
    }
    if (!has_element_) scene_.element = scene_.law || is_tested ? ElementKind::QuadraticTetrahedron : scene_.element;
    if (scene_.element == ElementKind::Hexahedron && (scene_.law || is_tested))
      context_.reject("simulation.element", "hexahedra that are pressed, or of a law of their own",
                      "\"quadratic_tetrahedra\" or \"tetrahedra\"", "leave the key out");
  }

  void read_simulation(TomlTable& t) {
    has_element_ = t.has("element");
    const std::string element = read_choice(t, "element", {"hexahedra", "tetrahedra", "quadratic_tetrahedra"});
    if (element == "tetrahedra") scene_.element = ElementKind::Tetrahedron;
    if (element == "quadratic_tetrahedra") scene_.element = ElementKind::QuadraticTetrahedron;
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
    table.with_table("pulled", [&](TomlTable& pull) { read_pull(pull); });
    if (initial.released != (initial.release_of.has_value() || scene_.pull.has_value()))
      context_.reject("initial",
                      initial.released ? "`released` without `release_of` or `pulled`"
                                       : "`release_of` or `pulled` without `released`",
                      "`released` and one of `release_of` and `pulled`, or none of them",
                      "a released object begins at its equilibrium under what held it");
    if (initial.release_of && scene_.pull)
      context_.reject("initial", "both `release_of` and `pulled`", "one of them", "a [[weight]] hangs in every frame");
    if (initial.release_of) check_weight("initial.release_of", *initial.release_of);
  }

  void read_pull(TomlTable& table) {
    SyntheticPull& pull = scene_.pull.emplace();
    read_patch(table, pull.at, pull.radius);
    pull.at = on_surface(table, "at", pull.at);
    pull.force = table.optional<Vector3>("force");
    const auto shift = table.optional<Vector3>("shift"), turn = table.optional<Vector3>("turn_deg");
    if (pull.force.has_value() == (shift || turn))
      context_.reject(table.key(), "neither or both of a force and a way", "`force`, or `shift` and `turn_deg`",
                      "a hand pulls with a force, or leads what it grips to a place");
    if (!pull.force && context_.is_sound(table.key()) && !(pull.radius > 0.0))
      context_.reject(table.key_of("radius"), "a grip without a size", "above 0", "in metres");
    const Vector3 angle = degree * turn.value_or(Vector3::Zero());
    if (angle.norm() > 0.0) pull.to.rotation = Eigen::AngleAxisd(angle.norm(), angle.normalized()).toRotationMatrix();
    pull.to.translation = pull.at - pull.to.rotation * pull.at + shift.value_or(Vector3::Zero());
  }

  void read_scenery(TomlTable& block) {
    scene_.plane_half_sizes.push_back(read_number(block, "half_size", at_least_zero("in metres"), 1.0));
    scene_.scene.planes.push_back(read_plane(block));
  }

  void read_part_modulus(TomlTable& block) {
    scene_.part_moduli.push_back(read_number(block, "youngs_modulus", positive("in pascals")));
    SyntheticNumbers numbers = own_numbers_.empty() ? SyntheticNumbers{} : own_numbers_.front();
    bool has_own = false;
    for (const char* key : {"poissons_ratio", "exponents", "stiffness_ratios", "poissons_ratios"})
      has_own = has_own || block.has(key);
    numbers.poissons_ratio = read_poissons_ratio(block, numbers.poissons_ratio);
    own_numbers_.push_back(read_law_numbers(block, numbers));
    part_has_own_.push_back(has_own);
  }

  static constexpr NumberRule ratio_rule = {
      .low = -1.0, .high = 0.5, .low_allowed = false, .high_allowed = false, .meaning = "0.3 is usual for foam"};
  double read_poissons_ratio(TomlTable& block, double fallback) {
    return read_number(block, "poissons_ratio", ratio_rule, fallback);
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
    camera.camera.lens = read_lens(block);
    camera.time_offset = read_number(block, "time_offset", offset_rule, 0.0);
    camera.is_silhouette = block.optional<bool>("silhouette").value_or(false);
    if (camera.is_silhouette)
      for (const char* key : {"depth_scale", "sensor"})
        if (block.has(key))
          context_.reject(block.key_of(key), "a silhouette camera with `" + std::string(key) + "`",
                          "neither `depth_scale` nor `sensor`",
                          "its masks show where its pixels' own rays meet the object");
    block.with_table("stated", [&](TomlTable& stated) { camera.stated = read_stated(stated, camera); });
    block.with_table("sensor", [&](TomlTable& sensor) { camera.sensor = read_sensor(sensor); });
    return camera;
  }

  static constexpr NumberRule offset_rule = {.low = -1.0, .high = 1.0, .meaning = "in seconds"};

  // The pose is turned about where the optical axis passes the object, and moved.
  StatedCamera read_stated(TomlTable& table, const SyntheticCamera& camera) {
    StatedCamera stated;
    if (table.has("turn_deg") || table.has("shift")) {
      const Vector3 turn = degree * table.optional<Vector3>("turn_deg").value_or(Vector3::Zero());
      const Vector3 shift = table.optional<Vector3>("shift").value_or(Vector3::Zero());
      const Box box = scene_.scene.object.surface ? bounding_box(*scene_.scene.object.surface) : Box{};
      const Vector3 about = scene_.scene.object.surface ? Vector3(0.5 * (box.min + box.max)) : Vector3(Vector3::Zero());
      Matrix3 R = Matrix3::Identity();
      if (turn.norm() > 0.0) R = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
      const RigidMotion& truth = camera.camera.camera_to_world;
      stated.camera_to_world = RigidMotion{R * truth.rotation, R * (truth.translation - about) + about + shift};
    }
    if (table.has("distortion")) stated.lens = read_lens(table);
    if (table.has("time_offset")) stated.time_offset = read_number(table, "time_offset", offset_rule, 0.0);
    return stated;
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

  // ---- clouds, markers, static tests

  void read_cloud(TomlTable& t) {
    SyntheticCloud& cloud = scene_.cloud.emplace();
    cloud.every = read_count(t, "every", 1, 100'000, 1);
    cloud.with_background = t.optional<bool>("background").value_or(false);
    cloud.with_images = t.optional<bool>("images").value_or(false);
  }

  void read_markers(TomlTable& t) {
    SyntheticMarkers& markers = scene_.markers.emplace();
    markers.noise = read_number(t, "noise", at_least_zero("of a coordinate, in metres"), 0.0);
    markers.relative_noise = read_number(t, "relative_noise", part("of how far a marker moved"), 0.0);
    markers.lost = read_number(t, "lost", part("a probability"), 0.0);
    const bool is_listed = t.has("points");
    if (is_listed == t.has("count"))
      context_.reject(t.key(), "neither or both of `points` and `count`", "one of them",
                      "`count` markers are spread over the surface");
    if (is_listed) {
      for (const Vector3& p : t.optional<std::vector<Vector3>>("points").value_or(std::vector<Vector3>{}))
        markers.points.push_back(on_surface(t, "points", p));
      return;
    }
    const int count = read_count(t, "count", 3, 100'000, 3);
    std::function<bool(const Vector3&)> is_wanted;
    for (const char* key : {"box", "sphere", "half_space"})
      if (t.has(key) && !is_wanted)
        if (const auto region = read_region(t, files_))
          is_wanted = [region = *region](const Vector3& p) { return contains(region, p); };
    if (!context_.is_sound("object") || !context_.is_sound(t.key()) || surface().triangles.empty()) return;
    std::vector<Vector3> held;
    for (const FixedRegion& fixed : scene_.scene.fixed)
      std::ranges::copy_if(surface().vertices, std::back_inserter(held), is_in_region(surface(), fixed.region));
    try {
      markers.points = spread_markers(surface(), count, is_wanted, held, scene_.seed);
    } catch (const std::invalid_argument& error) {
      context_.reject(t.key(), error.what(), "a region with more of the surface");
    }
  }

  std::string read_role(TomlTable& block) { return read_choice(block, "role", {"fit", "test"}); }

  /// The point of the surface nearest to one that a key names; a complaint where that is far away.
  Vector3 on_surface(TomlTable& table, const std::string& name, const Vector3& point) {
    constexpr double slack = 0.05;  // of the object's size
    if (!context_.is_sound("object") || surface().triangles.empty()) return point;
    const Vector3 there = nearest_place(surface(), point)(surface(), vertex_points(surface()));
    if (const double off = (there - point).norm(); off > slack * bounding_box(surface()).extent().maxCoeff())
      context_.reject(table.key_of(name), fmt::format("a point {:.3g} m off the object's surface", off),
                      "a point of the stress-free surface, in metres");
    return there;
  }

  void read_load(TomlTable& block) {
    SyntheticScene::HungLoad load{read_weight(block), read_role(block)};
    check_weight(block.key(), load.weight);
    load.weight.at = on_surface(block, "at", load.weight.at);
    scene_.loads.push_back(load);
  }

  void read_press(TomlTable& block) {
    SyntheticPress press;
    press.at = on_surface(block, "at", block.required<Vector3>("at", "where it touches").value_or(Vector3::Zero()));
    press.radius = read_number(block, "radius", positive("in metres"));
    if (block.has("axis")) press.axis = read_direction(block, "axis", "it points into the object");
    press.glued = block.optional<bool>("glued").value_or(true);
    press.force_noise = read_number(block, "force_noise", at_least_zero("in newtons"), 0.0);
    press.role = read_role(block);
    using Led = SyntheticPress::Led;
    int ways = 0;
    for (const auto& [key, led] : {std::pair{"force", Led::Force}, {"shift", Led::Shift}})
      if (const auto vector = block.optional<Vector3>(key)) press.led = led, press.vector = *vector, ++ways;
    for (const auto& [key, led] : {std::pair{"push", Led::Push}, {"depth", Led::Depth}})
      if (block.has(key)) press.led = led, press.number = read_number(block, key, NumberRule{}), ++ways;
    if (ways != 1)
      context_.reject(block.key(), fmt::format("{} ways to press", ways == 0 ? "no" : std::to_string(ways)),
                      "one of `push` and `force` [N], `depth` and `shift` [m]");
    scene_.presses.push_back(press);
  }

  void read_indentation(TomlTable& block) {
    SyntheticIndentation test;
    test.facts.name = block.optional<std::string>("name").value_or("");
    test.facts.probe =
        read_choice(block, "probe", {"ball", "punch"}) == "ball" ? IndenterShape::Ball : IndenterShape::Punch;
    test.facts.radius = read_number(block, "radius", positive("in metres"));
    test.facts.contact =
        on_surface(block, "contact", block.required<Vector3>("contact", "where it touches").value_or(Vector3::Zero()));
    test.facts.direction = Vector3::Zero();
    if (block.has("direction"))
      test.facts.direction = read_direction(block, "direction", "into the object").value_or(Vector3::Zero());
    test.depths = block.required<std::vector<double>>("depths", "in metres").value_or(std::vector<double>{});
    if (context_.is_sound(block.key()) &&
        (test.depths.empty() || !(test.depths.front() > 0.0) ||
         std::ranges::adjacent_find(test.depths, std::greater_equal<>()) != test.depths.end()))
      context_.reject(block.key_of("depths"), "depths that do not grow from above 0", "[0.001, 0.002, ...]",
                      "in metres");
    test.force_noise = read_number(block, "force_noise", positive("in newtons"));
    test.facts.role = read_role(block);
    scene_.indentations.push_back(std::move(test));
  }

  // ---- what does not go together

  void check_what_is_held(TomlTable& root) {
    const Scene& scene = scene_.scene;
    const bool is_pressed = root.has("press") || root.has("indentation");
    const auto need_fixed = [&](const std::string& key, const char* what) {
      if (!scene.is_held() && !root.has("fixed"))
        context_.complain(key, std::string(what) + " that nothing holds", "a block [[fixed]], or a glued [[inner]]",
                          "say where the object stands or is clamped");
    };
    if (is_pressed && !scene.led.empty())
      context_.complain("led[0]", "a led region of an object that is pressed", "[[fixed]]", "presses take no time");
    if (is_pressed && !scene.obstacles.empty())
      context_.complain("obstacle[0]", "an obstacle beside an object that is pressed", "[[inner]] for what it lies on",
                        "equilibria under probes know no obstacles");
    if (scene_.sags() && (!scene.led.empty() || !scene.inner.empty()))
      context_.complain(scene.led.empty() ? "inner[0]" : "led[0]",
                        "a led region or a rigid body of an object that sags", "[[fixed]] alone",
                        "load-free shapes know what is fixed");
    if (scene_.sags()) {
      need_fixed("object.shape_is", "an object that sags");
      if (scene.world.gravity && scene.world.gravity->isZero())
        context_.complain("object.shape_is", "an object that sags without gravity", "a gravity that pulls at it");
      for (std::size_t i = 0; i < scene.fixed.size(); ++i)
        if (scene.fixed[i].displaced_to && !scene.timing.is_static)
          context_.complain(fmt::format("fixed[{}].displaced_to", i), "a held region that moved since the scan",
                            "static = true in [timing], or no `displaced_to`");
      if (is_pressed)
        context_.complain("object.shape_is", "presses of an object that is scanned as it sags",
                          "shape_is = \"reference\"", "fits of presses take the scan as stress-free");
    }
    if (scene_.pull) need_fixed("initial.pulled", "a pulled object");
    if (is_pressed) {
      need_fixed(root.has("press") ? "press[0]" : "indentation[0]", "a pressed object");
      if (!scene.weights.empty())
        context_.complain("weight[0]", "a weight at an object that is pressed", "one of them",
                          "fits of presses know no weights");
    }
    if (root.has("load") && !scene.is_held() && !scene.is_touched())
      context_.complain("load[0]", "a load on an object that nothing holds", "a block [[fixed]]",
                        "say where the object stands or is clamped");
    if (scene.timing.is_static) {
      if (!scene.is_held())
        context_.complain("timing.static", "an object at rest that nothing holds", "a block [[fixed]]",
                          "say where the object stands or is clamped");
      if (scene.initial != Initial{})
        context_.complain("timing.static", "an object at rest, and how it begins to move", "no [initial]");
    }
  }

  void check_what_is_seen(TomlTable& root) {
    const bool has_depth = std::ranges::any_of(scene_.cameras, [](const auto& c) { return !c.is_silhouette; });
    const bool moves = root.has("timing"),
               has_images = root.has("camera") && (!scene_.cloud || scene_.cloud->with_images);
    if (scene_.cloud && !has_depth)
      context_.complain("cloud", "a cloud without a camera that measures depth", "a block [[camera]]",
                        "clouds are fused from depth cameras, which silhouettes are not");
    if (!moves && has_images)
      context_.complain("camera[0]", "images without frames", "[timing], or [cloud] without images",
                        "loads alone are seen as clouds or markers");
    if (root.has("press") && !root.has("markers"))
      context_.complain("press[0]", "presses without markers", "[markers]", "markers are how a press is seen");
    if (root.has("load") && !has_depth && !root.has("markers"))
      context_.complain("load[0]", "loads that nobody sees", "[[camera]] or [markers]");
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
  bool has_controls_ = false, has_tests_ = false, has_element_ = false;
  std::string law_name_ = "neo_hookean";
  std::vector<SyntheticNumbers> own_numbers_;  // of the object's own material, then of each region or control point
  std::vector<bool> part_has_own_;             // of each of the latter
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

LawLayout SyntheticScene::law_layout() const {
  const LawForm own{int(youngs_moduli().size()), 0, 1, false, *material.of_mean_strain()};
  return LawLayout(law.value_or(own), named_moduli(scene));
}

VectorX SyntheticScene::law_parameters(const LawLayout& layout) const {
  VectorX theta = VectorX::Zero(layout.size());
  const std::vector<double> moduli = youngs_moduli();
  for (std::size_t k = 0; k < moduli.size(); ++k) theta[layout.modulus(int(k))] = moduli[k];
  for (int l = 0; l < layout.form().laws; ++l) {
    const SyntheticNumbers numbers = law ? law_numbers[std::size_t(l)] : SyntheticNumbers{poissons_ratio, {}, {}, {}};
    theta[layout.poissons_ratio(0, l)] = numbers.poissons_ratio;
    for (int i = 0; i < layout.form().terms; ++i) {
      theta[layout.exponent(i, l)] = numbers.exponents[std::size_t(i)];
      if (i > 0) theta[layout.stiffness_ratio(i, l)] = numbers.stiffness_ratios[std::size_t(i) - 1];
      if (layout.form().own_ratios) theta[layout.poissons_ratio(i, l)] = numbers.poissons_ratios[std::size_t(i)];
    }
  }
  return theta;
}

}  // namespace pliant
