#include "output/situation_output.hpp"

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
#include "report/picture.hpp"
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

void draw_pictures(const SituationFiles& files, const Scene& scene, const Situation& situation,
                   const std::vector<std::array<int, 3>>& triangles, const std::vector<SeenCopy>& copies,
                   const std::vector<double>& times, const std::function<bool(int, int)>& progress) {
  const std::vector<SeenObstacle> obstacles = seen_obstacles(situation);
  Box box;
  for (const SeenCopy& copy : copies)
    for (const FloatPoints& surface : copy.surfaces) {
      box.extend(surface.colwise().minCoeff().cast<double>().transpose() + copy.shift);
      box.extend(surface.colwise().maxCoeff().cast<double>().transpose() + copy.shift);
    }
  const double degree = std::numbers::pi / 180.0;
  const Box whole = grown(box, 0.04 * box.extent().maxCoeff());
  const PinholeCamera camera = framed(view_of(whole, scene.world.up, files.width, files.height,
                                              files.azimuth_deg * degree, files.elevation_deg * degree),
                                      whole, files.width, files.height);
  const std::size_t frames = copies.front().surfaces.size();
  for (std::size_t frame = 0; frame < frames; ++frame) {
    PictureScene seen;
    std::vector<Vector3> vertices;
    const auto add = [&](const auto& points, const std::vector<std::array<int, 3>>& faces) {
      const int first = int(vertices.size());
      for (const Vector3& p : points) vertices.push_back(p);
      for (const auto& face : faces) seen.triangles.push_back({face[0] + first, face[1] + first, face[2] + first});
    };
    for (const SeenCopy& copy : copies) {
      if (frame >= copy.surfaces.size()) continue;
      std::vector<Vector3> points;
      for (Eigen::Index i = 0; i < copy.surfaces[frame].rows(); ++i)
        points.push_back(copy.surfaces[frame].row(i).cast<double>().transpose() + copy.shift);
      add(points, triangles);
      for (const Vector3& drop : copy.drops[frame]) seen.points.push_back(drop + copy.shift);
    }
    for (const SeenObstacle& obstacle : obstacles) {
      std::vector<Vector3> points = obstacle.mesh.vertices;
      const RigidMotion motion = obstacle.motion.at(times[frame]);
      for (Vector3& p : points) p = motion(p);
      add(points, obstacle.mesh.triangles);
    }
    seen.surface.resize(Eigen::Index(vertices.size()), 3);
    for (std::size_t i = 0; i < vertices.size(); ++i) seen.surface.row(Eigen::Index(i)) = vertices[i].transpose();
    seen.planes = situation.planes.value_or(scene.planes);
    PictureOptions options;
    options.disc_radius = 1.5;
    write_file(files.folder / "pictures" / fmt::format("{:06}.png", frame), encode_png(draw(seen, camera, options)));
    if (progress && !progress(int(frame) + 1, int(frames))) return;
  }
}

}  // namespace

RolloutSummary write_situation(const Model& model, const Situation& situation, const SituationFiles& files,
                               const std::function<bool(const char*, int, int)>& progress) {
  if (!files.video.empty()) require_ffmpeg(files.folder);
  const TriangleMesh& surface = *model.scene.object.surface;
  std::vector<SeenCopy> copies;
  std::vector<double> times;
  RolloutSummary first;
  bool was_stopped = false;
  for (int k = 0; k <= int(situation.copies.size()) && !was_stopped; ++k) {
    const SituationScene scene = make_scene(model, situation, k);
    times = scene.simulation.times;
    const fs::path folder = k == 0 ? files.folder : files.folder / fmt::format("copy_{}", k);
    SeenCopy& copy = copies.emplace_back();
    if (k > 0) copy.shift = situation.copies[std::size_t(k) - 1].shift;
    const Embedding vertices(*scene.body, surface.vertices);
    const RolloutSummary summary = write_trajectory(
        folder, scene.body, scene.simulation, scene.theta,
        [&](int done, int total) { return !(was_stopped = progress && !progress("simulated", done, total)); },
        [&](int frame, const State& state) {
          const Points now = vertices.positions(state.x);
          copy.surfaces.push_back(now.cast<float>());
          std::vector<Vector3>& drops = copy.drops.emplace_back();
          Box box;
          for (Eigen::Index i = 0; i < now.rows(); ++i) box.extend(now.row(i));
          const double margin = 0.5 * box.extent().maxCoeff();
          for (const Rain* rain : *scene.rains)
            for (const Vector3& drop : rain->drops_at(times[std::size_t(frame)], grown(box, margin)))
              drops.push_back(drop);
          if (!files.ply) return;
          TriangleMesh mesh = surface;
          for (Eigen::Index i = 0; i < now.rows(); ++i)
            mesh.vertices[std::size_t(i)] = now.row(i).transpose() + copy.shift;
          write_mesh(folder / "surface" / fmt::format("{:06}.ply", frame), mesh);
        });
    write_surfaces(folder / "surface.trajectory", times, copy);
    if (k == 0) first = summary;
    if (!summary.succeeded && first.succeeded) first = summary;
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
