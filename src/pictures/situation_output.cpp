#include "pictures/situation_output.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <numbers>
#include <vector>

#include "base/error.hpp"
#include "base/files.hpp"
#include "geometry/mesh_io.hpp"
#include "pictures/field_pictures.hpp"
#include "report/picture.hpp"
#include "report/report.hpp"
#include "scene/obstacle.hpp"
#include "simulation/model_simulation.hpp"
#include "simulation/strain_range.hpp"
#include "simulation/trajectory.hpp"
#include "situation/situation_scene.hpp"

namespace pliant {

namespace fs = std::filesystem;

namespace {

using FloatPoints = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// What is seen of one copy of the object.
struct SeenCopy {
  Vector3 shift = Vector3::Zero();
  std::vector<FloatPoints> surfaces;        // one a frame [m]
  std::vector<std::vector<Vector3>> drops;  // of rain, one list a frame [m]
  std::vector<std::vector<Vector3>> falls;  // of each of them, its velocity [m/s]
};

/// Runs a program that writes what it complains about to a file. Its exit code; 127 where it is not installed.
int run_program(std::vector<std::string> words, const fs::path& complaints) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const std::string to = complaints.string();
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, to.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int failed = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) return 127;
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

void require_ffmpeg(const fs::path& folder) {
  const fs::path answer = folder / "ffmpeg.log";
  fs::create_directories(folder);
  const int code = run_program({"ffmpeg", "-version"}, answer);
  fs::remove(answer);
  if (code != 0)
    throw InputError({{},
                      "a video is asked for, and ffmpeg is not installed",
                      "the program ffmpeg on the PATH",
                      "install it, or write --pictures and make the video from those"});
}

void make_video(const SituationFiles& files, double frame_rate) {
  const fs::path log = files.folder / "ffmpeg.log";
  if (files.video.has_parent_path()) fs::create_directories(files.video.parent_path());
  const int code = run_program({"ffmpeg", "-y", "-loglevel", "error", "-framerate", fmt::format("{}", frame_rate), "-i",
                                (files.folder / "pictures" / "%06d.png").string(), "-c:v", "libx264", "-crf", "20",
                                "-pix_fmt", "yuv420p", "-movflags", "+faststart", files.video.string()},
                               log);
  if (code != 0)
    throw InputError({{files.video},
                      "ffmpeg could not make the video: " + read_file(log).substr(0, 300),
                      "a path that can be written, with an ending that ffmpeg knows, such as .mp4",
                      "the pictures lie in " + (files.folder / "pictures").string()});
  fs::remove(log);
}

/// Times and surfaces of all frames: the format is in docs/formats.md.
void write_surfaces(const fs::path& path, const std::vector<double>& times, const SeenCopy& copy) {
  write_file(path, [&](std::ostream& out) {
    const auto put = [&](const auto* data, std::size_t count) {
      out.write(reinterpret_cast<const char*>(data), std::streamsize(count * sizeof *data));
    };
    out << "pliant trajectory/1\n";
    const std::uint32_t counts[2] = {std::uint32_t(copy.surfaces.size()),
                                     std::uint32_t(copy.surfaces.empty() ? 0 : copy.surfaces.front().rows())};
    put(counts, 2);
    put(times.data(), copy.surfaces.size());
    for (const FloatPoints& surface : copy.surfaces) put(surface.data(), std::size_t(surface.size()));
  });
}

/// What is drawn of one frame: meshes, each in its colour.
class FrameDrawing {
 public:
  void add(const std::vector<Vector3>& points, const std::vector<std::array<int, 3>>& faces, const Rgb& colour) {
    const int first = int(vertices_.size());
    vertices_.insert(vertices_.end(), points.begin(), points.end());
    seen_.colours.insert(seen_.colours.end(), points.size(), colour);
    for (const auto& face : faces) seen_.triangles.push_back({face[0] + first, face[1] + first, face[2] + first});
  }
  /// An octahedron, drawn out along a direction.
  void add_mark(const Vector3& at, const Vector3& along, double width, double length, const Rgb& colour) {
    const Vector3 z = along.normalized(), x = z.unitOrthogonal(), y = z.cross(x);
    add({at + width * x, at + width * y, at - width * x, at - width * y, at + length * z, at - length * z},
        {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}}, colour);
  }
  PictureScene scene(const std::vector<Plane>& planes, const Box& about) {
    seen_.surface.resize(Eigen::Index(vertices_.size()), 3);
    for (std::size_t i = 0; i < vertices_.size(); ++i) seen_.surface.row(Eigen::Index(i)) = vertices_[i].transpose();
    seen_.planes = planes, seen_.about = about;
    return std::move(seen_);
  }

 private:
  PictureScene seen_;
  std::vector<Vector3> vertices_;
};

/// Where a hand is while it holds [m]; nothing: it does not.
std::optional<Vector3> place_of(const Hand& hand, double time) {
  if (time < hand.from || time > hand.until) return std::nullopt;
  if (!hand.path.empty()) return KeyFrames<3>(hand.path).at(time);
  return hand.at + KeyFrames<6>(hand.motion).at(time).head<3>();
}

void draw_pictures(const SituationFiles& files, const Scene& scene, const Situation& situation,
                   const std::vector<std::array<int, 3>>& triangles, const std::vector<SeenCopy>& copies,
                   const std::vector<double>& times, const std::function<bool(int, int)>& progress) {
  constexpr Rgb object{176, 182, 190}, obstacle_colour{214, 170, 110}, drop_colour{70, 130, 200}, hand{190, 60, 110};
  constexpr int some = 7;  // of the vertices frame the picture
  const std::vector<RigidObstacle> obstacles = obstacles_in(scene, situation);
  std::vector<TriangleMesh> surfaces;
  for (const RigidObstacle& obstacle : obstacles) surfaces.push_back(surface_of(obstacle));
  Box box;
  std::vector<Vector3> framing;
  for (const SeenCopy& copy : copies)
    for (const FloatPoints& surface : copy.surfaces)
      for (Eigen::Index i = 0; i < surface.rows(); i += some) {
        framing.push_back(surface.row(i).cast<double>().transpose() + copy.shift);
        box.extend(framing.back());
      }
  const double degree = std::numbers::pi / 180.0;
  const PinholeCamera camera = framed(
      view_of(box, scene.world.up, files.width, files.height, files.azimuth_deg * degree, files.elevation_deg * degree),
      framing, files.width, files.height);
  const double mark = 0.006 * box.extent().maxCoeff();
  const std::size_t frames = copies.front().surfaces.size();
  for (std::size_t frame = 0; frame < frames; ++frame) {
    FrameDrawing drawing;
    for (const SeenCopy& copy : copies) {
      if (frame >= copy.surfaces.size()) continue;
      std::vector<Vector3> points;
      for (Eigen::Index i = 0; i < copy.surfaces[frame].rows(); ++i)
        points.push_back(copy.surfaces[frame].row(i).cast<double>().transpose() + copy.shift);
      drawing.add(points, triangles, object);
      for (std::size_t d = 0; d < copy.drops[frame].size(); ++d)
        drawing.add_mark(copy.drops[frame][d] + copy.shift, copy.falls[frame][d], 0.5 * mark, 3.0 * mark, drop_colour);
      for (const Hand& h : situation.hands)
        if (const auto place = place_of(h, times[frame]))
          drawing.add_mark(*place + copy.shift, scene.world.up, 2.0 * mark, 2.0 * mark, hand);
    }
    std::vector<Plane> planes = situation.planes.value_or(scene.planes);
    for (std::size_t o = 0; o < obstacles.size(); ++o) {
      const RigidMotion motion = motion_of(obstacles[o]).at(times[frame]);
      std::vector<Vector3> points = surfaces[o].vertices;
      for (Vector3& p : points) p = motion(p);
      drawing.add(points, surfaces[o].triangles, obstacle_colour);
      if (const auto* plane = std::get_if<ShapePlane>(&obstacles[o].shape)) {
        Plane& ground = planes.emplace_back();
        ground.point = motion(plane->point), ground.normal = motion.rotation * plane->normal;
      }
    }
    const PictureScene seen = drawing.scene(planes, box);
    write_file(files.folder / "pictures" / fmt::format("{:06}.png", frame), encode_png(draw(seen, camera)));
    if (progress && !progress(int(frame) + 1, int(frames))) return;
  }
}

/// Fields of a model's body in motion, for `fields.html`.
FieldPictures fields_of(const Model& model, const std::shared_ptr<const Body>& body, const SimulationOptions& options,
                        const VectorX& theta) {
  const auto elasticity = scene_elasticity(body, options);
  elasticity->set_parameters(theta);
  const std::vector<double>& std = model.volume.youngs_modulus_std;
  const bool has_std = std.size() == std::size_t(body->element_count());
  return {body, *elasticity, *model.scene.object.surface, has_std ? std : std::vector<double>(),
          frames_at(options.times)};
}

void write_fields(const fs::path& folder, const Model& model, const std::vector<Plane>& planes,
                  const FieldPictures& fields) {
  Gallery gallery;
  gallery.triangles = model.scene.object.surface->triangles;
  gallery.planes = planes;
  gallery.up = model.scene.world.up;
  gallery.width = 480, gallery.height = 400;
  write_file(folder / "fields.html", fields_html(model.name, fields.draw(gallery)));
}

}  // namespace

WrittenMotion write_simulation(const Model& model, const fs::path& folder,
                               const std::function<bool(int, int)>& progress) {
  const ModelScene scene = make_scene(model);
  FieldPictures fields = fields_of(model, scene.body, scene.simulation, scene.theta);
  StrainRange strains(*scene.body);
  const RolloutSummary summary = write_trajectory(folder, scene.body, scene.simulation, scene.theta, progress,
                                                  [&](int frame, const State& state, const BodyFields& of) {
                                                    fields.add(frame, state.x, of);
                                                    strains.add(of, std::nullopt);
                                                  });
  write_fields(folder, model, model.scene.planes, fields);
  return {summary, strains.result()};
}

WrittenMotion write_situation(const Model& model, const Situation& situation, const SituationFiles& files,
                              const std::function<bool(const char*, int, int)>& progress) {
  if (!files.video.empty()) require_ffmpeg(files.folder);
  const TriangleMesh& surface = *model.scene.object.surface;
  std::vector<SeenCopy> copies;
  std::vector<double> times;
  WrittenMotion first;
  bool was_stopped = false;
  for (int k = 0; k <= int(situation.copies.size()) && !was_stopped; ++k) {
    const SituationScene scene = make_scene(model, situation, k);
    times = scene.simulation.times;
    const fs::path folder = k == 0 ? files.folder : files.folder / fmt::format("copy_{}", k);
    SeenCopy& copy = copies.emplace_back();
    if (k > 0) copy.shift = situation.copies[std::size_t(k) - 1].shift;
    const Embedding vertices(*scene.body, surface.vertices);
    FieldPictures fields = fields_of(model, scene.body, scene.simulation, scene.theta);
    StrainRange strains(*scene.body);
    const RolloutSummary summary = write_trajectory(
        folder, scene.body, scene.simulation, scene.theta,
        [&](int done, int total) { return !(was_stopped = progress && !progress("simulated", done, total)); },
        [&](int frame, const State& state, const BodyFields& of) {
          fields.add(frame, state.x, of);
          strains.add(of, std::nullopt);
          const Points now = vertices.positions(state.x);
          copy.surfaces.push_back(now.cast<float>());
          std::vector<Vector3>&drops = copy.drops.emplace_back(), &falls = copy.falls.emplace_back();
          Box box;
          for (Eigen::Index i = 0; i < now.rows(); ++i) box.extend(now.row(i));
          const double margin = 0.5 * box.extent().maxCoeff();
          for (const Rain* rain : *scene.rains)
            for (const Vector3& drop : rain->drops_at(times[std::size_t(frame)], grown(box, margin)))
              drops.push_back(drop), falls.push_back(rain->options().velocity);
          if (!files.ply) return;
          TriangleMesh mesh = surface;
          for (Eigen::Index i = 0; i < now.rows(); ++i)
            mesh.vertices[std::size_t(i)] = now.row(i).transpose() + copy.shift;
          write_mesh(folder / "surface" / fmt::format("{:06}.ply", frame), mesh);
        });
    write_surfaces(folder / "surface.trajectory", times, copy);
    write_fields(folder, model, situation.planes.value_or(model.scene.planes), fields);
    if (k == 0) first = {summary, strains.result()};
    if (!summary.succeeded && first.summary.succeeded) first.summary = summary;
  }
  if (!files.pictures && files.video.empty()) return first;
  if (was_stopped) return first;
  bool all = true;
  draw_pictures(files, model.scene, situation, surface.triangles, copies, times,
                [&](int done, int total) { return all = !progress || progress("drawn", done, total); });
  if (all && !files.video.empty()) make_video(files, situation.frame_rate);
  return first;
}

}  // namespace pliant
