#include <fmt/format.h>

#include <functional>

#include "base/files.hpp"
#include "base/points.hpp"
#include "exports/formats.hpp"
#include "exports/moving_surface.hpp"
#include "geometry/mesh_io.hpp"
#include "model/vtu.hpp"

namespace pliant {

namespace {

namespace fs = std::filesystem;

std::string frame_name(std::size_t frame, const char* ending) { return fmt::format("frames/{:06}.{}", frame, ending); }

/// Frames of a longer motion that stood in the folder before.
void remove_further_frames(const fs::path& folder, std::size_t count, const char* ending) {
  for (std::size_t frame = count; is_file(folder / frame_name(frame, ending)); ++frame)
    remove_file(folder / frame_name(frame, ending));
}

/// A file a frame, and `frames.csv` with their times.
std::vector<std::string> write_frames(const MovingSurface& moving, const fs::path& folder, const char* ending,
                                      const std::function<void(const fs::path& file, std::size_t frame)>& write) {
  if (moving.frames.empty()) return {};
  std::string times = "frame,time [s],file\n";
  std::vector<std::string> files = {"frames.csv"};
  for (std::size_t frame = 0; frame < moving.frames.size(); ++frame) {
    files.push_back(frame_name(frame, ending));
    write(folder / files.back(), frame);
    times += fmt::format("{},{:.9g},{}\n", frame, moving.times[frame], files.back());
  }
  remove_further_frames(folder, moving.frames.size(), ending);
  write_file(folder / "frames.csv", times);
  return files;
}

/// Runs in Blender 4 and 5: one object, a shape key a frame.
constexpr const char* blender_script =
    R"(# blender --python blender.py: the frames beside this file as shape keys of one object
import csv
import pathlib

import bpy

folder = pathlib.Path(__file__).resolve().parent
with open(folder / "frames.csv", newline="") as file:
    rows = list(csv.DictReader(file))
load = bpy.ops.wm.obj_import if rows[0]["file"].endswith(".obj") else bpy.ops.wm.ply_import
rate = bpy.context.scene.render.fps / bpy.context.scene.render.fps_base
moving = None
for k, row in enumerate(rows):
    load(filepath=str(folder / row["file"]))
    frame = bpy.context.object
    if moving is None:
        moving = frame
        moving.shape_key_add(name="rest")
        continue
    key = moving.shape_key_add(name=row["frame"])
    for corner, vertex in zip(key.data, frame.data.vertices):
        corner.co = vertex.co
    now, before, after = (1 + rate * float(r["time [s]"]) for r in (row, rows[k - 1], rows[min(k + 1, len(rows) - 1)]))
    for at, value in ((before, 0.0), (after, 0.0), (now, 1.0)):
        key.value = value
        key.keyframe_insert("value", frame=at)
    bpy.data.objects.remove(frame)
)";

std::vector<std::string> write_meshes(const Model& model, const fs::path& folder, const ExportProgress& progress,
                                      const char* ending) {
  const MovingSurface moving = moving_surface(model, progress);
  TriangleMesh mesh;
  mesh.triangles = moving.triangles;
  std::vector<std::string> files = write_frames(moving, folder, ending, [&](const fs::path& file, std::size_t frame) {
    mesh.vertices = to_vectors(moving.frames[frame]);
    write_mesh(file, mesh);
  });
  if (files.empty()) return files;
  write_file(folder / "blender.py", blender_script);
  files.push_back("blender.py");
  return files;
}

}  // namespace

std::vector<std::string> write_obj_frames(const Model& model, const fs::path& folder, const ExportProgress& progress) {
  return write_meshes(model, folder, progress, "obj");
}

std::vector<std::string> write_ply_frames(const Model& model, const fs::path& folder, const ExportProgress& progress) {
  return write_meshes(model, folder, progress, "ply");
}

/// Besides the frames `motion.pvd`, which opens them with their times.
std::vector<std::string> write_vtu_frames(const Model& model, const fs::path& folder, const ExportProgress& progress) {
  const MovingSurface moving = moving_surface(model, progress);
  VtuGrid grid;
  grid.kind = VtuCell::Triangle;
  for (const std::array<int, 3>& triangle : moving.triangles)
    grid.connectivity.insert(grid.connectivity.end(), triangle.begin(), triangle.end());
  std::vector<PvdEntry> entries;
  std::vector<std::string> files = write_frames(moving, folder, "vtu", [&](const fs::path& file, std::size_t frame) {
    grid.points = moving.frames[frame];
    VtuArray moved{"displacement [m]", 3, {}};
    for (const auto& vertex : (moving.frames[frame] - moving.frames.front()).rowwise())
      moved.values.insert(moved.values.end(), {vertex[0], vertex[1], vertex[2]});
    grid.point_data = {std::move(moved)};
    write_vtu(file, grid, VtuPrecision::Single);
    entries.push_back({moving.times[frame], frame_name(frame, "vtu")});
  });
  if (files.empty()) return files;
  write_pvd(folder / "motion.pvd", entries);
  files.push_back("motion.pvd");
  return files;
}

}  // namespace pliant
