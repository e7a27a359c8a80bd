#include "synthesis/synthesis.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "base/files.hpp"
#include "base/old_names.hpp"
#include "base/parallel.hpp"
#include "geometry/mesh_io.hpp"
#include "rays/ray_scene.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t scan_image = 0x7363616eu;  // the counter of the scan's noise

std::string image_name(const SyntheticCamera& camera, int frame) {
  return fmt::format("{}/{:06}.png", camera.name, frame);
}
std::string mask_name(const SyntheticCamera& camera, int frame) {
  return fmt::format("{}/mask_{:06}.png", camera.name, frame);
}

void check(const Synthesis& s) {
  const auto require = [](bool good, const char* what) {
    if (!good) throw std::invalid_argument(std::string("write_synthetic_capture: ") + what);
  };
  const Object& object = s.scene.object;
  require(object.surface && !object.surface->vertices.empty() && !s.trajectory.empty(),
          "a surface and at least one frame are needed");
  for (const Points& frame : s.trajectory)
    require(size_t(frame.rows()) == object.surface->vertices.size() && frame.allFinite(),
            "a frame does not fit the surface, or is not finite");
  require(object.mass.has_value() != object.density.has_value(), "exactly one of mass and density is needed");
  require(!s.cameras.empty(), "at least one camera is needed");
  require(s.plane_half_sizes.size() == s.scene.planes.size(), "each plane needs a visible size");
  const Timing& timing = s.scene.timing;
  require(timing.frame_rate > 0.0 && timing.start_frame >= 0 && timing.start_frame < timing.frame_count() &&
              timing.frame_count() == int(s.trajectory.size()),
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

RayScene scene_of(const Synthesis& s, const Points& frame) {
  RayScene scene;
  const TriangleMesh& rest = *s.scene.object.surface;
  scene.add(frame, rest.triangles);
  const Box box = bounding_box(rest);
  for (size_t i = 0; i < s.scene.planes.size(); ++i)
    if (s.plane_half_sizes[i] > 0.0)
      scene.add(patch(s.scene.planes[i], s.plane_half_sizes[i], 0.5 * (box.min + box.max)));
  return scene;
}

TriangleMesh scanned(const Synthesis& s) {
  TriangleMesh mesh = *s.scene.object.surface;
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

Capture capture_of(const Synthesis& s, const fs::path& folder) {
  Capture capture;
  capture.name = s.name;
  capture.scene = s.scene;
  capture.scene.object.file = folder / "rest.ply";
  for (const SyntheticCamera& camera : s.cameras)
    capture.depth.push_back({camera.name,
                             camera.camera,
                             {camera.name + "/%06d.png"},
                             camera.depth_scale,
                             FramePattern{camera.name + "/mask_%06d.png"},
                             {},
                             camera.every,
                             rounded(typical_noise(s, camera))});
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
  if (s.write_trajectory) json["trajectory"] = "truth/%06d.ply";
  return json.dump(2) + "\n";
}

void write_facts(const fs::path& folder, const Synthesis& s) {
  write_mesh(folder / "rest.ply", scanned(s));
  write_file(folder / "truth.json", truth_json(s));
}

void write_frame(const fs::path& folder, const Synthesis& s, int frame) {
  const RayScene scene = scene_of(s, s.trajectory[frame]);
  for (size_t k = 0; k < s.cameras.size(); ++k) {
    const SyntheticCamera& camera = s.cameras[k];
    if (frame % camera.every != 0) continue;
    const SensedFrame seen = sense(scene, 0, camera.camera, camera.sensor, camera.depth_scale, s.seed, int(k), frame);
    write_png(folder / image_name(camera, frame), seen.depth);
    write_png(folder / mask_name(camera, frame), seen.mask);
  }
  if (!s.write_trajectory) return;
  TriangleMesh mesh{{}, s.scene.object.surface->triangles};
  for (Eigen::Index i = 0; i < s.trajectory[frame].rows(); ++i) mesh.vertices.emplace_back(s.trajectory[frame].row(i));
  write_mesh(folder / fmt::format("truth/{:06}.ply", frame), mesh);
}

}  // namespace

void write_synthetic_capture(const fs::path& folder, const Synthesis& synthesis,
                             const std::function<void(int, int)>& progress) {
  check(synthesis);
  write_facts(folder, synthesis);
  std::mutex lock;
  int done = 0;
  const int frames = int(synthesis.trajectory.size());
  parallel_for(0, frames, [&](int frame) {
    write_frame(folder, synthesis, frame);
    const std::lock_guard guard(lock);
    ++done;
    if (progress) progress(done, frames);
  });
  write_capture(folder, capture_of(synthesis, folder), "A synthetic recording; its truth is in truth.json.");
}

}  // namespace pliant
