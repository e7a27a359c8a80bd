#include <ostream>

#include "base/files.hpp"
#include "capture/capture.hpp"
#include "geometry/mesh_io.hpp"
#include "scene/inner_body.hpp"
#include "scene/scene_toml.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

const char* text_of(bool value) { return value ? "true" : "false"; }

std::string grip_file(std::size_t i) { return "grip_" + std::to_string(i) + ".txt"; }

// Writes the blocks of a capture.toml; paths come out relative to its folder.
class Writer {
 public:
  Writer(std::ostream& out, fs::path folder) : out_(out), folder_(std::move(folder)) {}

  void write(const Capture& capture, const std::string& comment) {
    const Scene& scene = capture.scene;
    if (!comment.empty()) out_ << "# " << comment << "\n";
    out_ << "format = \"capture/1\"\nname = " << toml_text(capture.name) << "\n\n";
    write_toml(out_, scene.object, scene.object.file.empty() ? "" : relative(scene.object.file));
    write_toml(out_, scene.world);
    if (!scene.timing.times.empty()) write_toml(out_, scene.timing);
    if (!scene.timing.times.empty() || scene.initial != Initial{}) write_toml(out_, scene.initial);
    write_toml_blocks(out_, scene);
    for (const DepthCamera& camera : capture.depth) write(camera);
    for (const SilhouetteCamera& camera : capture.silhouettes) write(camera);
    for (const CloudSequence& cloud : capture.clouds) write(cloud);
    for (const MarkerTrack& track : capture.markers)
      out_ << "[[markers]]\nrest = " << file_text(track.rest) << "\ntrack = " << file_text(track.track) << "\n\n";
    for (const Press& press : capture.presses) write(press);
    for (const Load& load : capture.loads) write(load);
    for (const Indentation& test : capture.indentations) write(test);
    for (std::size_t i = 0; i < capture.grips.size(); ++i) write(capture.grips[i], i);
    for (const MaterialCurve& test : capture.material_curves) write(test);
  }

 private:
  std::string relative(const fs::path& file) const {
    return fs::absolute(file).lexically_normal().lexically_relative(folder_).generic_string();
  }
  std::string file_text(const fs::path& file) const { return toml_text(relative(file)); }

  void write_file_key(const char* key, const std::optional<fs::path>& file) {
    if (file) out_ << key << " = " << file_text(*file) << "\n";
  }
  void write_every(int every) { out_ << "every = " << every << "\n"; }
  void write_noise(const std::optional<double>& noise) {
    if (noise) out_ << "noise = " << toml_text(*noise) << "   # m\n";
  }
  void write_pose_std(const PoseStd& std) {
    out_ << "pose_std = { turn = " << toml_text(std.turn) << ", shift = " << toml_text(std.shift) << " }   # rad, m\n";
  }

  /// What all kinds of cameras have.
  void write_camera(const char* kind, const RecordingCamera& camera) {
    const PinholeCamera& c = camera.camera;
    out_ << "[[" << kind << "]]\nname = " << toml_text(camera.name) << "\nwidth = " << c.width
         << "\nheight = " << c.height << "\n";
    for (const auto& [key, value] : {std::pair{"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy}})
      out_ << key << " = " << toml_text(value) << "\n";
    if (!c.lens.coefficients().empty()) out_ << "distortion = " << toml_text(c.lens.coefficients()) << "\n";
    if (camera.poses)
      write_file_key("poses", camera.poses);
    else
      out_ << "camera_to_world = " << toml_text(c.camera_to_world) << "\n";
    write_every(camera.every);
    if (camera.time_offset != 0.0) out_ << "time_offset = " << toml_text(camera.time_offset) << "   # s\n";
    if (camera.pose_std != PoseStd()) write_pose_std(camera.pose_std);
  }

  void write(const DepthCamera& depth) {
    write_camera("depth", depth);
    out_ << "images = " << toml_text(depth.images.pattern) << "\n";
    if (depth.masks) out_ << "masks = " << toml_text(depth.masks->pattern) << "\n";
    write_file_key("background", depth.background);
    out_ << "depth_scale = " << toml_text(depth.depth_scale) << "\n";
    write_noise(depth.noise);
    if (depth.range_std) out_ << "range_std = " << toml_text(*depth.range_std) << "   # m\n";
    if (depth.range_scale_std > 0.0) out_ << "range_scale_std = " << toml_text(depth.range_scale_std) << "\n";
    if (depth.focal_std > 0.0) out_ << "focal_std = " << toml_text(depth.focal_std) << "\n";
    out_ << "\n";
  }

  void write(const SilhouetteCamera& silhouette) {
    write_camera("silhouette", silhouette);
    out_ << "masks = " << toml_text(silhouette.masks.pattern) << "\n";
    if (silhouette.outline_std != SilhouetteCamera().outline_std)
      out_ << "outline_std = " << toml_text(silhouette.outline_std) << "   # pixels\n";
    if (silhouette.outline_error_std != SilhouetteCamera().outline_error_std)
      out_ << "outline_error_std = " << toml_text(silhouette.outline_error_std) << "   # pixels\n";
    out_ << "\n";
  }

  void write(const CloudSequence& cloud) {
    out_ << "[[cloud]]\npoints = " << toml_text(cloud.points.pattern) << "\n";
    write_file_key("background", cloud.background);
    write_every(cloud.every);
    write_noise(cloud.noise);
    if (cloud.pose_std) write_pose_std(*cloud.pose_std);
    out_ << "\n";
  }

  void write(const Press& press) {
    out_ << "[[press]]\nforce = " << toml_text(press.force)
         << "   # N\ncontact = { centre = " << toml_text(press.contact_centre)
         << ", radius = " << toml_text(press.contact_radius) << " }\n";
    if (press.probe)
      out_ << "probe = { point = " << toml_text(press.probe->point) << ", normal = " << toml_text(press.probe->normal)
           << " }\n";
    out_ << "markers = " << file_text(press.markers) << "\nmarkers_rest = " << file_text(press.markers_rest) << "\n";
    write_file_key("markers_std", press.markers_std);
    out_ << "role = " << toml_text(press.role) << "\nglued = " << text_of(press.glued) << "\n\n";
  }

  void write(const Load& load) {
    out_ << "[[load]]\nmass = " << toml_text(load.mass) << "   # kg\nat = " << toml_text(load.at) << "\n";
    write_file_key("cloud", load.cloud);
    write_file_key("markers", load.markers);
    write_file_key("markers_rest", load.markers_rest);
    for (const auto& [key, paths] : {std::pair{"images", &load.images}, {"masks", &load.masks}}) {
      if (paths->empty()) continue;
      out_ << key << " = {";
      const char* separator = " ";
      for (const auto& [camera, path] : *paths) {
        out_ << separator << toml_text(camera) << " = " << file_text(path);
        separator = ", ";
      }
      out_ << " }\n";
    }
    out_ << "role = " << toml_text(load.role) << "\n\n";
  }

  void write_name(const std::string& name) {
    if (!name.empty()) out_ << "name = " << toml_text(name) << "\n";
  }

  void write(const Indentation& test) {
    out_ << "[[indentation]]\n";
    write_name(test.name);
    out_ << "probe = " << (test.probe == IndenterShape::Ball ? "\"ball\"" : "\"punch\"")
         << "\nradius = " << toml_text(test.radius) << "   # m\ncontact = " << toml_text(test.contact)
         << "\ndirection = " << toml_text(test.direction) << "\n";
    if (test.contact_std > 0.0) out_ << "contact_std = " << toml_text(test.contact_std) << "   # m\n";
    out_ << "curve = " << file_text(test.curve) << "\nrole = " << toml_text(test.role) << "\n\n";
  }

  void write(const Grip& test, std::size_t i) {
    out_ << "[[grip]]\n";
    write_name(test.name);
    write_region(out_, test.region, grip_file(i));
    out_ << "displacement = " << toml_text(test.displacement) << "   # m\n";
    if (test.force) out_ << "force = " << toml_text(*test.force) << "   # N\n";
    if (test.force_std) out_ << "force_std = " << toml_text(*test.force_std) << "   # N\n";
    if (!test.force_direction.isZero()) out_ << "force_direction = " << toml_text(test.force_direction) << "\n";
    write_file_key("markers", test.markers);
    write_file_key("markers_rest", test.markers_rest);
    if (test.markers_std) out_ << "markers_std = " << toml_text(*test.markers_std) << "   # m\n";
    if (test.unseen) out_ << "unseen = " << toml_text(*test.unseen) << "\n";
    out_ << "role = " << toml_text(test.role) << "\n\n";
  }

  void write(const MaterialCurve& test) {
    out_ << "[[material_curve]]\n";
    write_name(test.name);
    out_ << "mode = " << toml_text(test_mode_names()[std::size_t(test.mode)])
         << "\nmeasure = " << toml_text(stress_measure_names()[std::size_t(test.measure)]) << "\n";
    if (test.prestretch != 1.0) out_ << "prestretch = " << toml_text(test.prestretch) << "\n";
    out_ << "curve = " << file_text(test.curve) << "\nrole = " << toml_text(test.role) << "\n\n";
  }

  std::ostream& out_;
  fs::path folder_;
};

}  // namespace

void write_capture(const fs::path& folder, const Capture& capture, const std::string& comment) {
  const fs::path place = (fs::absolute(folder) / "").lexically_normal().parent_path();
  Capture written = capture;
  written.scene.initial.pulls.clear(), written.scene.initial.pulled_at.clear();  // of models alone
  if (const auto& surface = capture.scene.object.surface; surface && capture.scene.object.file.empty()) {
    written.scene.object.file = place / "rest.ply";
    written.scene.object.volume.reset();
    write_mesh(written.scene.object.file, scanned_surface(*surface, capture.scene.inner));
  }
  write_scene_files(place, capture.scene);
  for (std::size_t i = 0; i < capture.grips.size(); ++i)
    write_region_file(place / grip_file(i), capture.grips[i].region);
  write_file(place / "capture.toml", [&](std::ostream& out) { Writer(out, place).write(written, comment); });
}

}  // namespace pliant
