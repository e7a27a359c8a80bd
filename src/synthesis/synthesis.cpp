#include "synthesis/synthesis.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "base/files.hpp"
#include "base/old_names.hpp"
#include "base/parallel.hpp"
#include "capture/markers.hpp"
#include "capture/point_cloud.hpp"
#include "geometry/mesh_io.hpp"
#include "rays/ray_scene.hpp"
#include "scene/inner_body.hpp"
#include "scene/obstacle.hpp"
#include "synthesis/synthetic_markers.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t scan_image = 0x7363616eu,
                        force_image = 0x666f7263u;  // counters of the scan's and forces' noise
// Static tests have frame numbers of their own for random numbers, beyond those of the recording.
constexpr int first_load = 1'000'000, first_press = 2'000'000;

std::string image_name(const SyntheticCamera& camera, int frame) {
  return fmt::format("{}/{:06}.png", camera.name, frame);
}
std::string mask_name(const SyntheticCamera& camera, int frame) {
  return fmt::format("{}/mask_{:06}.png", camera.name, frame);
}

bool has_images(const Synthesis& s) { return !s.frames.empty() && (!s.cloud || s.cloud->with_images); }
bool has_images(const Synthesis& s, const SyntheticCamera& camera) {
  return camera.is_silhouette ? !s.frames.empty() : has_images(s);
}
bool measures_depth(const SyntheticCamera& camera) { return !camera.is_silhouette; }

void check(const Synthesis& s) {
  const auto require = [](bool good, const char* what) {
    if (!good) throw std::invalid_argument(std::string("write_synthetic_capture: ") + what);
  };
  const Object& object = s.scene.object;
  const bool is_tested = !s.loads.empty() || !s.presses.empty() || !s.indentations.empty();
  require(object.surface && !object.surface->vertices.empty() && (!s.frames.empty() || is_tested),
          "a surface and at least one frame or static test are needed");
  const auto vertices = Eigen::Index(object.surface->vertices.size());
  const Eigen::Index markers = s.markers ? Eigen::Index(s.markers->points.size()) : 0;
  const auto fits = [&](const TrueShape& shape) {
    return shape.vertices.rows() == vertices && shape.vertices.allFinite() && shape.markers.rows() == markers &&
           shape.markers.allFinite();
  };
  for (const TrueShape& frame : s.frames) require(fits(frame), "a frame does not fit the surface, or is not finite");
  for (const auto& frames : s.camera_frames)
    require(frames.empty() || (frames.size() == s.frames.size() && std::ranges::all_of(frames, fits)),
            "what a camera sees does not fit the frames");
  for (const TrueLoad& load : s.loads) require(fits(load.shape), "a load's shape does not fit the surface");
  for (const TruePress& press : s.presses) require(fits(press.shape), "a press' shape does not fit the surface");
  require(s.scan.rows() == 0 || s.scan.rows() == vertices, "the scan does not fit the surface");
  require(s.scan_markers.rows() == markers, "the markers at rest do not fit those of the frames");
  require(object.mass.has_value() != object.density.has_value(), "exactly one of mass and density is needed");
  require(!s.cameras.empty() || s.markers || !s.indentations.empty(), "at least one camera, or markers, are needed");
  require(!s.cloud || (std::ranges::any_of(s.cameras, measures_depth) && s.cloud->every >= 1),
          "a cloud needs a depth camera");
  require(s.presses.empty() || markers >= 3, "presses need three markers");
  require(s.plane_half_sizes.size() == s.scene.planes.size(), "each plane needs a visible size");
  const Timing& timing = s.scene.timing;
  require(s.frames.empty()
              ? timing.times.empty()
              : timing.frame_rate > 0.0 && timing.start_frame >= 0 && timing.start_frame < timing.frame_count() &&
                    timing.frame_count() == int(s.frames.size()),
          "the timing makes no sense");
  for (const SyntheticCamera& camera : s.cameras)
    require(!camera.name.empty() && camera.every >= 1 && camera.depth_scale > 0.0 && camera.sensor.validate().empty(),
            "a camera has no name, or settings out of range");
}

// The visible square of a plane around the object.
TriangleMesh patch(const Plane& plane, double half_size, const Vector3& centre) {
  const Vector3& n = plane.normal;
  const Vector3 middle = centre - n.dot(centre - plane.point) * n;
  const Vector3 a = half_size * n.unitOrthogonal(), b = n.cross(a);
  return {{middle - a - b, middle + a - b, middle + a + b, middle - a + b}, {{0, 1, 2}, {0, 2, 3}}};
}

// What rays meet at an instant [s].
RayScene scene_of(const Synthesis& s, const Points& frame, double time) {
  RayScene scene;
  const TriangleMesh& rest = *s.scene.object.surface;
  scene.add(frame, rest.triangles);
  const Box box = bounding_box(rest);
  for (size_t i = 0; i < s.scene.planes.size(); ++i)
    if (s.plane_half_sizes[i] > 0.0)
      scene.add(patch(s.scene.planes[i], s.plane_half_sizes[i], 0.5 * (box.min + box.max)));
  for (const RigidObstacle& obstacle : s.scene.obstacles) {
    TriangleMesh mesh = surface_of(obstacle);
    const RigidMotion motion = motion_of(obstacle).at(time);
    for (Vector3& vertex : mesh.vertices) vertex = motion(vertex);
    if (!mesh.triangles.empty()) scene.add(mesh);
  }
  return scene;
}

TriangleMesh with_vertices(const TriangleMesh& surface, const Points& vertices) {
  TriangleMesh mesh{{}, surface.triangles};
  for (Eigen::Index i = 0; i < vertices.rows(); ++i) mesh.vertices.emplace_back(vertices.row(i));
  return mesh;
}

TriangleMesh scanned(const Synthesis& s) {
  const TriangleMesh& surface = *s.scene.object.surface;
  TriangleMesh mesh = s.scan.rows() > 0 ? with_vertices(surface, s.scan) : surface;
  mesh = scanned_surface(std::move(mesh), s.scene.inner);
  const std::vector<Vector3> normals = vertex_normals(mesh);
  if (s.scan_noise > 0.0)
    for (size_t i = 0; i < mesh.vertices.size(); ++i)
      mesh.vertices[i] += s.scan_noise * counter_normal(s.seed, scan_image, 0, i) * normals[i];
  return mesh;
}

// A typical reading's deviation: at the object's distance, with the steps' rounding.
double typical_noise(const Synthesis& s, const SyntheticCamera& camera) {
  const Box box = bounding_box(*s.scene.object.surface);
  const double depth = camera.camera.project(0.5 * (box.min + box.max)).z();
  const double step = std::max(camera.sensor.step, 1.0 / camera.depth_scale);
  return std::sqrt(std::pow(camera.sensor.noise(depth), 2) + step * step / 12.0);
}

// Three digits: what a user would write down.
double rounded(double noise) { return std::stod(fmt::format("{:.3g}", noise)); }

// Of the clouds' points: the root mean square over cameras.
double cloud_noise(const Synthesis& s) {
  double squares = 0.0, count = 0.0;
  for (const SyntheticCamera& camera : s.cameras)
    if (measures_depth(camera)) squares += std::pow(typical_noise(s, camera), 2), ++count;
  return std::sqrt(squares / count);
}

std::string test_name(const char* kind, std::size_t i, const char* ending) {
  return fmt::format("{}/{:03}.{}", kind, i, ending);
}

Capture capture_of(const Synthesis& s, const fs::path& folder) {
  Capture capture;
  capture.name = s.name;
  capture.scene = s.scene;
  capture.scene.object.file = folder / "rest.ply";
  capture.scene.object.surface_noise = 0.0;  // it is the surface of the simulated body
  capture.scene.object.stiffness_std = 0.0;
  for (const SyntheticCamera& camera : s.cameras) {
    if (!has_images(s, camera)) continue;
    RecordingCamera facts{camera.name, camera.camera, camera.every,
                          camera.stated.time_offset.value_or(camera.time_offset)};
    facts.camera.camera_to_world = camera.stated.camera_to_world.value_or(facts.camera.camera_to_world);
    facts.camera.lens = camera.stated.lens.value_or(facts.camera.lens);
    const FramePattern masks{camera.name + "/mask_%06d.png"};
    if (camera.is_silhouette)
      capture.silhouettes.push_back({facts, masks});
    else
      capture.depth.push_back(
          {facts, {camera.name + "/%06d.png"}, camera.depth_scale, masks, {}, rounded(typical_noise(s, camera))});
  }
  const fs::path rest = folder / "markers_rest.csv";
  if (!s.frames.empty() && s.cloud)
    capture.clouds.push_back({{"clouds/%06d.ply"}, s.cloud->every, rounded(cloud_noise(s))});
  if (!s.frames.empty() && s.markers) capture.markers.push_back({rest, folder / "markers.csv"});
  for (std::size_t i = 0; i < s.loads.size(); ++i) {
    const TrueLoad& hung = s.loads[i];
    Load load;
    load.mass = hung.weight.mass, load.at = hung.weight.at, load.role = hung.role;
    if (s.cloud) load.cloud = folder / test_name("load", i, "ply");
    if (s.markers) load.markers = folder / test_name("load", i, "csv"), load.markers_rest = rest;
    if (has_images(s))
      for (const SyntheticCamera& camera : s.cameras) {
        if (!measures_depth(camera)) continue;
        load.images[camera.name] = folder / fmt::format("load/{:03}_{}.png", i, camera.name);
        load.masks[camera.name] = folder / fmt::format("load/{:03}_{}_mask.png", i, camera.name);
      }
    capture.loads.push_back(std::move(load));
  }
  for (std::size_t i = 0; i < s.presses.size(); ++i) {
    const TruePress& made = s.presses[i];
    Press press = made.facts;
    for (int k = 0; k < 3; ++k)
      press.force[k] += made.force_noise * counter_normal(s.seed, force_image, std::uint64_t(k), i);
    press.probe = Plane{press.contact_centre + made.shift, made.axis};
    press.markers = folder / test_name("press", i, "csv"), press.markers_rest = rest;
    capture.presses.push_back(std::move(press));
  }
  for (std::size_t i = 0; i < s.indentations.size(); ++i) {
    capture.indentations.push_back(s.indentations[i].facts);
    capture.indentations.back().curve = folder / test_name("indentation", i, "csv");
  }
  return capture;
}

nlohmann::ordered_json vector_json(const Vector3& v) { return {v.x(), v.y(), v.z()}; }

std::string truth_json(const Synthesis& s) {
  nlohmann::ordered_json json{{"format", "synth-truth/1"}, {"name", s.name}, {"seed", s.seed}};
  json["parameters"] = nlohmann::ordered_json::object();
  for (const TrueParameter& p : s.truth) {
    const auto* number = std::get_if<double>(&p.value);
    for (const std::string& name : {p.name, former_name(p.name)})
      if (!name.empty())
        json["parameters"][name] = {
            {"value", number ? nlohmann::ordered_json(*number) : vector_json(std::get<Vector3>(p.value))},
            {"unit", p.unit}};
  }
  json["scan_noise"] = s.scan_noise;
  for (const SyntheticCamera& camera : s.cameras) {
    const RigidMotion& pose = camera.camera.camera_to_world;
    nlohmann::ordered_json& own = json["cameras"][camera.name];
    for (int i = 0; i < 3; ++i)
      own["camera_to_world"].push_back(
          {pose.rotation(i, 0), pose.rotation(i, 1), pose.rotation(i, 2), pose.translation[i]});
    own["camera_to_world"].push_back({0.0, 0.0, 0.0, 1.0});
    own["distortion"] = camera.camera.lens.coefficients(), own["time_offset"] = camera.time_offset;
  }
  if (s.scan.rows() > 0) json["load_free"] = "truth/load_free.ply";
  for (const TruePress& press : s.presses)
    json["presses"].push_back({{"force", vector_json(press.facts.force)}, {"shift", vector_json(press.shift)}});
  for (const TrueIndentation& test : s.indentations)
    json["indentations"].push_back({{"depths", test.curve.depths}, {"forces", test.curve.forces}});
  if (s.write_trajectory) json["trajectory"] = "truth/%06d.ply";
  return json.dump(2) + "\n";
}

std::vector<std::string> marker_ids(const Synthesis& s) {
  std::vector<std::string> ids;
  for (std::size_t i = 0; i < s.markers->points.size(); ++i) ids.push_back(fmt::format("m{:03}", i));
  return ids;
}

Points measured(const Synthesis& s, const TrueShape& shape, int occasion) {
  return measured_markers(*s.markers, s.scan_markers, shape.markers, s.seed, occasion);
}

// Those that the probe covers are hidden.
Points measured(const Synthesis& s, const TruePress& press, int occasion) {
  Points seen = measured(s, press.shape, occasion);
  for (Eigen::Index m = 0; m < seen.rows(); ++m) {
    const Vector3 from = s.scan_markers.row(m).transpose() - press.facts.contact_centre;
    if (from.norm() <= press.facts.contact_radius) seen.row(m).setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  return seen;
}

void write_marker_files(const fs::path& folder, const Synthesis& s) {
  const std::vector<std::string> ids = marker_ids(s);
  write_marker_positions(folder / "markers_rest.csv", {ids, measured(s, TrueShape{{}, s.scan_markers}, -1)});
  std::vector<Points> frames;
  for (std::size_t i = 0; i < s.frames.size(); ++i) frames.push_back(measured(s, s.frames[i], int(i)));
  if (!frames.empty()) write_marker_track(folder / "markers.csv", ids, frames);
  for (std::size_t i = 0; i < s.loads.size(); ++i)
    write_marker_positions(folder / test_name("load", i, "csv"),
                           {ids, measured(s, s.loads[i].shape, first_load + int(i))});
  for (std::size_t i = 0; i < s.presses.size(); ++i)
    write_marker_positions(folder / test_name("press", i, "csv"),
                           {ids, measured(s, s.presses[i], first_press + int(i))});
}

void write_curves(const fs::path& folder, const Synthesis& s) {
  for (std::size_t i = 0; i < s.indentations.size(); ++i) {
    ForceCurve curve = s.indentations[i].curve;
    for (std::size_t k = 0; k < curve.forces.size(); ++k)
      curve.forces[k] += curve.stds[k] * counter_normal(s.seed, force_image, 3 + i, k);
    write_force_curve(folder / test_name("indentation", i, "csv"), curve);
  }
}

void write_facts(const fs::path& folder, const Synthesis& s) {
  write_mesh(folder / "rest.ply", scanned(s));
  write_file(folder / "truth.json", truth_json(s));
  if (s.scan.rows() > 0) write_mesh(folder / "truth/load_free.ply", *s.scene.object.surface);
  if (s.markers) write_marker_files(folder, s);
  write_curves(folder, s);
}

SensedFrame sensed(const Synthesis& s, const RayScene& scene, std::size_t k, int frame) {
  const SyntheticCamera& camera = s.cameras[k];
  return sense(scene, 0, camera.camera, camera.sensor, camera.depth_scale, s.seed, int(k), frame);
}

// What a camera saw of the object, or of everything, in the world [m].
void add_points(const Synthesis& s, std::size_t k, const SensedFrame& seen, std::vector<Vector3>& points) {
  const SyntheticCamera& camera = s.cameras[k];
  for (int v = 0; v < seen.depth.height; ++v)
    for (int u = 0; u < seen.depth.width; ++u)
      if (seen.depth(u, v) > 0 && (seen.mask(u, v) > 0 || s.cloud->with_background))
        points.push_back(camera.camera.unproject(u, v, seen.depth(u, v) / camera.depth_scale));
}

void write_cloud(const fs::path& file, const std::vector<Vector3>& points) {
  if (points.empty())
    throw InputError({{file}, "a cloud without a point", "cameras that see the object", "move or widen a [[camera]]"});
  write_points(file, points);
}

void write_frame(const fs::path& folder, const Synthesis& s, int frame) {
  const bool has_cloud = s.cloud && frame % s.cloud->every == 0;
  std::vector<Vector3> points;
  if (!s.cameras.empty()) {
    const double time = s.scene.timing.times[std::size_t(frame)];
    const RayScene at_frame = scene_of(s, s.frames[std::size_t(frame)].vertices, time);
    for (std::size_t k = 0; k < s.cameras.size(); ++k) {
      const bool has_image = has_images(s, s.cameras[k]) && frame % s.cameras[k].every == 0;
      if (!has_image && !has_cloud) continue;
      const bool is_later = k < s.camera_frames.size() && !s.camera_frames[k].empty();
      const SensedFrame seen =
          is_later
              ? sensed(s, scene_of(s, s.camera_frames[k][std::size_t(frame)].vertices, time + s.cameras[k].time_offset),
                       k, frame)
              : sensed(s, at_frame, k, frame);
      if (has_cloud && measures_depth(s.cameras[k])) add_points(s, k, seen, points);
      if (!has_image) continue;
      if (measures_depth(s.cameras[k])) write_png(folder / image_name(s.cameras[k], frame), seen.depth);
      write_png(folder / mask_name(s.cameras[k], frame), seen.mask);
    }
  }
  if (has_cloud) write_cloud(folder / fmt::format("clouds/{:06}.ply", frame), points);
  if (s.write_trajectory)
    write_mesh(folder / fmt::format("truth/{:06}.ply", frame),
               with_vertices(*s.scene.object.surface, s.frames[std::size_t(frame)].vertices));
}

// What a test's truth is judged by: the surface as it was.
void write_true_test(const fs::path& folder, const Synthesis& s, const std::string& name, const TrueShape& shape) {
  if (s.write_trajectory) write_mesh(folder / "truth" / name, with_vertices(*s.scene.object.surface, shape.vertices));
}

void write_load(const fs::path& folder, const Synthesis& s, std::size_t i) {
  write_true_test(folder, s, test_name("load", i, "ply"), s.loads[i].shape);
  if (!s.cloud && !has_images(s)) return;
  const RayScene scene = scene_of(s, s.loads[i].shape.vertices, 0.0);
  std::vector<Vector3> points;
  for (std::size_t k = 0; k < s.cameras.size(); ++k) {
    if (!measures_depth(s.cameras[k])) continue;
    const SensedFrame seen = sensed(s, scene, k, first_load + int(i));
    if (s.cloud) add_points(s, k, seen, points);
    if (!has_images(s)) continue;
    write_png(folder / fmt::format("load/{:03}_{}.png", i, s.cameras[k].name), seen.depth);
    write_png(folder / fmt::format("load/{:03}_{}_mask.png", i, s.cameras[k].name), seen.mask);
  }
  if (s.cloud) write_cloud(folder / test_name("load", i, "ply"), points);
}

}  // namespace

void write_synthetic_capture(const fs::path& folder, const Synthesis& synthesis,
                             const std::function<void(int, int)>& progress) {
  check(synthesis);
  write_facts(folder, synthesis);
  std::mutex lock;
  int done = 0;
  const int frames = int(synthesis.frames.size()), loads = int(synthesis.loads.size());
  parallel_for(0, frames + loads, [&](int i) {
    if (i < frames)
      write_frame(folder, synthesis, i);
    else
      write_load(folder, synthesis, std::size_t(i - frames));
    const std::lock_guard guard(lock);
    ++done;
    if (progress) progress(done, frames + loads);
  });
  for (std::size_t i = 0; i < synthesis.presses.size(); ++i)
    write_true_test(folder, synthesis, test_name("press", i, "ply"), synthesis.presses[i].shape);
  write_capture(folder, capture_of(synthesis, folder), "A synthetic recording; its truth is in truth.json.");
}

}  // namespace pliant
